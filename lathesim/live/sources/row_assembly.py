"""Values that come one by one, each with its own time stamp, put together to rows of values that belong together."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lathesim.live.sources.samples import Block

MOST_WAITING = 20_000
"""Instants that may wait for a value that has not come; then the oldest are closed as they are."""


@dataclass
class RowAssembly:
    """Puts values with time stamps together to rows of ``width`` values.

    A row is whole once every item has a value at its instant or at a later one: what an item did not send it did not change, so its last
    value holds. ``repeated`` counts values that came again with the same time stamp.
    """

    width: int
    repeated: int = 0
    _rows: dict[float, dict[int, float]] = field(default_factory=dict)
    _newest: list[float] = field(default_factory=list)
    _last: list[float] = field(default_factory=list)
    _closed: float = -np.inf

    def __post_init__(self) -> None:
        self._newest = [-np.inf] * self.width
        self._last = [np.nan] * self.width

    def add(self, item: int, time: float, value: float) -> bool:
        """Take a value; return False where its time lies before rows that are closed, so that it cannot be placed any more."""
        if time <= self._closed:
            return False
        row = self._rows.setdefault(time, {})
        if item in row:
            self.repeated += 1
        row[item] = value
        self._newest[item] = max(self._newest[item], time)
        return True

    def whole(self) -> Block:
        """Return the rows that are whole now."""
        return self._close(min(self._newest, default=-np.inf))

    def quiet(self) -> Block:
        """Return all rows that wait: the sender has been quiet long enough that nothing more comes for them."""
        return self._close(np.inf)

    def restart(self) -> Block:
        """Return all rows that wait, and forget: the sender starts anew, perhaps with another clock."""
        block = self.quiet()
        self._newest = [-np.inf] * self.width
        self._last = [np.nan] * self.width
        self._closed = -np.inf
        return block

    def _close(self, until: float) -> Block:
        times = sorted(time for time in self._rows if time <= until)
        if len(self._rows) - len(times) > MOST_WAITING:
            times = sorted(self._rows)[: len(self._rows) - MOST_WAITING // 2]
        values = np.empty((self.width, len(times)))
        for column, time in enumerate(times):
            for item, value in self._rows.pop(time).items():
                self._last[item] = value
            values[:, column] = self._last
        if times:
            self._closed = times[-1]
        return Block(np.array(times, dtype=np.float64), values)
