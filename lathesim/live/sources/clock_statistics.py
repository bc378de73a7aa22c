"""How well a period was kept: mean, jitter, latest wake, in memory that does not grow."""

from __future__ import annotations

import math
from dataclasses import dataclass


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
