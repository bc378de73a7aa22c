"""A channel on its way to a tolerance after a drift was told."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lathesim.live.watching.event import Event
from lathesim.live.watching.forecast import forecast
from lathesim.live.watching.watch import Watch

_POINTS = 400
"""Points of a drift that are kept; with more of them every second one goes."""
_POINT = 20.0
"""Seconds of each point: about a lap, over which what differs comes and goes."""


@dataclass
class DriftCourse:
    """A channel on its way to a tolerance: the rms of its residual above the first laps, of 20 s each; fewer as time goes on."""

    channel: str
    tolerance: float
    next_told: float = 0.0
    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    _squares: list[float] = field(default_factory=list)
    _since: float = np.nan
    _reached: bool = False

    def take(self, watch: Watch, now: float) -> Event | None:
        """Take what is new, and return a forecast every minute until the tolerance is reached."""
        self._since = now if np.isnan(self._since) else self._since
        self._squares.append(watch.excess(self.channel))
        if now - self._since < _POINT or self._reached:
            return None
        self.times.append(0.5 * (self._since + now))
        self.values.append(float(np.sqrt(max(0.0, float(np.mean(self._squares))))))
        self._since, self._squares = now, []
        if len(self.times) > _POINTS:
            self.times, self.values = self.times[::2], self.values[::2]
        if now < self.next_told:
            return None
        found = forecast(np.array(self.times), np.array(self.values), self.tolerance)
        if found is None:
            return None
        self.next_told = now + 60.0
        self._reached = found.time <= now
        if self._reached:
            sentence = f"t = {now:.1f} s: {self.channel} has reached its tolerance."
            return Event("forecast", now, sentence, {"channel": self.channel, "at_s": found.time, "low_s": now, "high_s": now})
        left, low, high = (max(0.0, time - now) for time in (found.time, found.low, found.high))
        sentence = (
            f"t = {now:.1f} s: {self.channel} reaches its tolerance in {left:.0f} s, between {low:.0f} and {high:.0f} s from now (95 %)."
        )
        data = {"channel": self.channel, "at_s": found.time, "low_s": found.low, "high_s": _finite(found.high)}
        return Event("forecast", now, sentence, data)


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
