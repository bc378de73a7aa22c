"""A channel on its way to a tolerance after a drift was told, or while a known effect grows."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lathesim.live.watching.courses.forecast import forecast
from lathesim.live.watching.event import Event
from lathesim.live.watching.thresholds import ERRORS, FOLLOWING

POINTS = 400
"""Points of a course that are kept; with more of them every second one goes."""
_EVERY = 60.0
"""Seconds between two forecasts."""


@dataclass
class Series:
    """Points of a course in time; fewer as time goes on."""

    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    def add(self, time: float, value: float) -> None:
        """Add a point."""
        self.times.append(time)
        self.values.append(value)
        if len(self.times) > POINTS:
            self.times, self.values = self.times[::2], self.values[::2]

    def clear(self) -> None:
        """Begin anew."""
        self.times, self.values = [], []


@dataclass
class DriftCourse:
    """A channel on its way to a tolerance: by how much it differs from the first laps, as a root mean square over segments."""

    channel: str
    tolerance: float
    series: Series = field(default_factory=Series)
    _next_told: float = 0.0
    _reached: bool = False

    def begin(self) -> None:
        """Begin anew: what differs is measured in another way from now on."""
        self.series.clear()

    def only_since(self, time: float) -> None:
        """Forget the points before ``time`` [s], when it began to move."""
        points = [(at, value) for at, value in zip(self.series.times, self.series.values, strict=True) if at >= time]
        self.series.times, self.series.values = [at for at, _ in points], [value for _, value in points]

    def take(self, time: float, value: float, now: float, *, drifts: bool = True, doubt: float = 0.0) -> Event | None:
        """Take a point of the course. Where it ``drifts``, return a forecast every minute until the tolerance is reached.

        ``doubt`` [SI] is the standard deviation of what other causes may do to the channel.
        """
        if self._reached or not np.isfinite(value):
            return None
        self.series.add(time, value)
        if now < self._next_told or not drifts:
            return None
        unsure = float(np.hypot(ERRORS.least_floor, doubt / self.tolerance))
        found = forecast(np.array(self.series.times), np.array(self.series.values), self.tolerance, unsure, FOLLOWING.bend)
        if found is None:
            return None
        self._next_told = now + _EVERY
        self._reached = found.time <= now
        if self._reached:
            sentence = f"t = {now:.1f} s: {self.channel} has reached its tolerance."
            return Event("forecast", now, sentence, {"channel": self.channel, "at_s": found.time, "low_s": now, "high_s": now})
        left, low, high = (max(0.0, time - now) for time in (found.time, found.low, found.high))
        until = f"between {low:.0f} and {high:.0f} s" if np.isfinite(high) else f"{low:.0f} s at least"
        sentence = f"t = {now:.1f} s: {self.channel} reaches its tolerance in {left:.0f} s, {until} from now (95 %)."
        data = {"channel": self.channel, "at_s": found.time, "low_s": found.low, "high_s": high + now if np.isfinite(high) else None}
        return Event("forecast", now, sentence, data)
