"""Whether the size of a known effect grows or shrinks, and since when."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lathesim.live.watching.courses.drift_course import Series
from lathesim.live.watching.courses.forecast import bend, line_through
from lathesim.live.watching.courses.value_course import SEGMENT
from lathesim.live.watching.thresholds import FOLLOWING
from lathesim.record import FloatArray

_FALSE = SEGMENT / (8.0 * 3600.0)
"""Probability of each test to be wrong: one in eight hours of segments, as asked of the alarms."""


_NEWEST = 10
"""Segments from which the next one is foretold: of some minutes, over which a drift is straight."""


@dataclass(frozen=True)
class Growth:
    """A size moved from ``before`` to ``now`` [SI], ``since`` [s], at a ``rate`` [SI/s]; 0 for a step."""

    before: float
    now: float
    since: float
    rate: float = 0.0


@dataclass
class GrowthCourse:
    """The course of one size whose scale is ``scale`` [SI]; ``named`` [s] is since when it is known to drift, where it is known."""

    scale: float
    value: float
    named: float | None = None
    told: bool = False
    _series: Series = field(default_factory=Series)
    _stepped: float | None = None
    _mixed: tuple[float, float] | None = None

    def take(self, time: float, value: float, deviation: float) -> Growth | None:
        """Take the size over a segment around ``time`` [s], with its standard deviation; return its growth where that can be told, once."""
        if self._stepped is not None and time - 0.5 * SEGMENT < self._stepped:
            self._mixed = (time, value)  # a segment with the step in it is neither before nor after
            return None
        stepped, self._stepped = self._stepped, None
        if stepped is not None:
            step = self._confirmed(stepped, time, value, deviation)
            if step is not None:
                return step
        self._series.add(time, value)
        times, values = np.array(self._series.times), np.array(self._series.values)
        if self.told or not self._moves(times, values):
            return None
        bent = bend(times, values)
        line = line_through(times[times >= bent], values[times >= bent]) or line_through(times[-_NEWEST:], values[-_NEWEST:])
        if line is None or abs(line.at(time) - line.at(max(bent, times[0]))) < FOLLOWING.worth * self.scale:
            return None
        self.told = True
        first = max(bent, float(times[0]))
        return Growth(line.at(first), line.at(time), bent if self.named is None else self.named, line.slope)

    def _confirmed(self, begun: float, time: float, value: float, deviation: float) -> Growth | None:
        """Return the step at ``begun`` [s] that the segment around ``time`` [s] confirms, and begin anew there; None where it does not."""
        expected, unsure = self._expected(time)
        mixed, self._mixed = self._mixed, None
        if abs(value - expected) <= max(FOLLOWING.worth * self.scale, FOLLOWING.step * np.hypot(deviation, unsure)):
            if mixed is not None:
                self._series.add(*mixed)
            return None
        self._series.clear()
        self.told = False
        self._series.add(time, value)
        return Growth(expected, value, begun)

    def _moves(self, times: FloatArray, values: FloatArray) -> bool:
        """Return whether the size rises or falls over the newest ten segments, or twice, four times ... as many."""
        counts = [_NEWEST * 2**power for power in range(12) if power == 0 or _NEWEST * 2 ** (power - 1) < len(times)]
        lines = [line_through(times[-count:], values[-count:]) for count in counts]
        return any(line is not None and line.rises(_FALSE / len(counts)) != 0.0 for line in lines)

    def stepped(self, begun: float) -> None:
        """Take note that the size seems to have stepped at ``begun`` [s]; the next whole segment tells."""
        self._stepped = begun if self._stepped is None else self._stepped

    def _expected(self, time: float) -> tuple[float, float]:
        """Return the size at ``time`` [s] as the newest segments go on, and its standard deviation."""
        times, values = np.array(self._series.times[-_NEWEST:]), np.array(self._series.values[-_NEWEST:])
        line = line_through(times, values)
        if line is None:  # a slope is not known, and what the few points differ by may be one
            return self.newest, float(np.ptp(values)) if len(values) > 1 else np.inf
        unsure = np.sqrt(line.variance * (1.0 + 1.0 / line.count + (time - line.middle) ** 2 / line.spread))
        return line.at(time), float(unsure)

    @property
    def until(self) -> float:
        """Return the time [s] of the newest segment that counts."""
        return self._series.times[-1]

    @property
    def newest(self) -> float:
        """Return the size now: of the line where it moves, else the mean of the newest segments; the lesson's before the first."""
        if not self._series.times:
            return self.value
        times, values = np.array(self._series.times[-_NEWEST:]), np.array(self._series.values[-_NEWEST:])
        line = line_through(times, values)
        return float(values.mean()) if line is None or not self.told else line.at(times[-1])
