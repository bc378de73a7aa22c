"""The buffer between planning and servo, and how well the period of the servo was kept."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lathesim.live.samples import LiveError
from lathesim.motion import playback
from lathesim.record import FloatArray

LARGEST_CAPACITY = 1_000_000


@dataclass(frozen=True)
class BufferCount:
    """What a buffer saw: set-points ``arrived`` and ``consumed``, its ``fill`` and the lowest, periods of underrun and dead stop."""

    arrived: int
    consumed: float
    fill: float
    lowest: float
    underruns: int
    hard_stops: int


class SetPointBuffer:
    """Holds at most ``capacity`` set-points of ``axes`` axes. ``put`` takes what fits, ``play`` consumes at the servo period.

    ``rho`` is the largest change of the playback rate in a period; None is the mode ``hold``. See :mod:`lathesim.motion.playback`.
    """

    def __init__(self, axes: int, capacity: int, rho: float | None = None) -> None:
        if not 2 <= capacity <= LARGEST_CAPACITY:
            raise LiveError(f"the buffer has room for {capacity} set-points.", remedy=f"Give it between 2 and {LARGEST_CAPACITY}.")
        if rho is not None and not 0.0 < rho <= 1.0:
            raise LiveError(f"the playback rate may change by {rho:g} in a period.", remedy="Give a number above 0 and up to 1.")
        self._ring = np.zeros((capacity + 2, axes))
        self._state = np.zeros(playback.NUMBERS)
        self._state[playback.RATE] = 1.0
        self._state[playback.LOWEST] = np.inf
        self.capacity = capacity
        self.rho = 0.0 if rho is None else rho
        self.arrived = 0
        self.ended = False

    @property
    def fill(self) -> float:
        """Return how many set-points wait."""
        return self.arrived - float(self._state[playback.PLACE])

    @property
    def room(self) -> int:
        """Return how many set-points fit."""
        return max(0, self.capacity - int(np.ceil(self.fill)))

    @property
    def finished(self) -> bool:
        """Return whether the stream ended and all of it was played."""
        return self.ended and self.fill <= 0.0

    def put(self, set_points: FloatArray) -> int:
        """Take set-points (count, axes) as far as there is room; return how many were taken."""
        count = min(len(set_points), self.room)
        self._ring[(self.arrived + np.arange(count)) % len(self._ring)] = set_points[:count]
        self.arrived += count
        return count

    def end(self) -> None:
        """Note that no more set-points come: the rest is played to its end, without slowing down for an empty buffer."""
        self.ended = True

    def play(self, periods: int) -> FloatArray:
        """Return the set-points of the next periods, (periods, axes); fewer only at the end of the stream, or 0 before its beginning."""
        out = np.empty((periods, self._ring.shape[1]))
        if self.arrived == 0:
            return out[:0]
        played: int = playback.play(self._ring, self.arrived, self.ended, self.rho, self._state, out)
        return out[:played]

    def count(self) -> BufferCount:
        """Return what happened so far."""
        lowest = float(self._state[playback.LOWEST])
        return BufferCount(
            self.arrived,
            float(self._state[playback.PLACE]),
            self.fill,
            lowest if np.isfinite(lowest) else self.fill,
            int(self._state[playback.UNDERRUNS]),
            int(self._state[playback.STANDING]),
        )


@dataclass
class ClockStatistics:
    """Running statistics of how late [s] the servo side came to its periods, and of the fill of its buffer."""

    wakes: int = 0
    mean: float = 0.0
    square: float = 0.0
    latest: float = 0.0
    lowest_fill: float = math.inf
    fill_sum: float = 0.0

    def add(self, late: float, fill: float) -> None:
        """Take one wake: how late it was and how full the buffer is (Welford's update)."""
        self.wakes += 1
        off = late - self.mean
        self.mean += off / self.wakes
        self.square += off * (late - self.mean)
        self.latest = max(self.latest, late)
        self.lowest_fill = min(self.lowest_fill, fill)
        self.fill_sum += fill

    def as_json(self) -> dict[str, float | int | None]:
        """Return the statistics as plain data."""
        if not self.wakes:
            return {"wakes": 0}
        return {
            "wakes": self.wakes,
            "late_mean_s": self.mean,
            "jitter_s": math.sqrt(self.square / self.wakes),
            "latest_s": self.latest,
            "lowest_fill": self.lowest_fill,
            "mean_fill": self.fill_sum / self.wakes,
        }
