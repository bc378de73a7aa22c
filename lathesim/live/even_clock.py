"""Samples put on an even clock, and values that come one by one put together to rows."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lathesim.live.samples import SampleBlock
from lathesim.record import FloatArray

BRIDGED = 5
"""Missing samples in a row that are interpolated linearly; after more of them the simulation starts anew."""
_MOST_FAULTS = 100
"""Faults that are kept until they are taken; all are counted."""
_OFF = 0.5
"""Share of a period by which a sample may come beside its instant; a jitter of the time stamp is no gap."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Samples without a gap: ``begin`` [s], ``values`` (signals, samples); ``fresh`` where the one before does not go on into it."""

    begin: float
    values: FloatArray
    fresh: bool


@dataclass(frozen=True)
class ClockFault:
    """A fault of the recording: when [s], what, and how many samples."""

    time: float
    kind: str
    samples: int


@dataclass
class SampleClock:
    """Puts blocks on the clock ``period`` [s]; memory is one sample. Faults are kept until they are taken."""

    period: float
    faults: list[ClockFault] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    _last: float = np.nan
    _row: FloatArray | None = None

    def take(self, block: SampleBlock) -> list[Stretch]:
        """Return the samples of a block in whole stretches."""
        found: list[Stretch] = []
        if block.fresh:
            self._row, self._last = None, np.nan
        for note in block.notes:
            self._fault(float(block.time[0]) if len(block) else self._last, note, 0)
        pieces: list[FloatArray] = []
        fresh, begin = self._row is None, np.nan
        for begun, ended, missing in self._runs(block):
            values = block.values[:, begun:ended]
            if missing > BRIDGED and self._row is not None:
                if pieces:
                    found.append(Stretch(begin, np.concatenate(pieces, axis=1), fresh))
                pieces, fresh, begin = [], True, np.nan
            elif missing and self._row is not None:
                share = np.arange(1, missing + 1) / (missing + 1)
                pieces.append(self._row[:, None] + share * (values[:, :1] - self._row[:, None]))
                begin = self._last + self.period if np.isnan(begin) else begin
            begin = float(block.time[begun]) - (missing * self.period if missing <= BRIDGED else 0.0) if np.isnan(begin) else begin
            pieces.append(values)
            self._row, self._last = values[:, -1].copy(), float(block.time[ended - 1])
        if pieces:
            found.append(Stretch(begin, np.concatenate(pieces, axis=1), fresh))
        return found

    def _runs(self, block: SampleBlock) -> list[tuple[int, int, int]]:
        """Return runs (first, behind the last, samples missing before) of samples a period apart; others are left out and counted."""
        keep: list[tuple[int, int, int]] = []
        last = self._last
        usable = np.asarray(np.isfinite(block.values).all(axis=0))
        steps = np.diff(block.time)
        if len(block) and usable.all() and np.all(np.abs(steps - self.period) < _OFF * self.period) and not np.isnan(last):
            first = block.time[0] - last
            if abs(first - self.period) < _OFF * self.period:
                return [(0, len(block), 0)]
        for at in range(len(block)):
            time = float(block.time[at])
            step = np.inf if np.isnan(last) else (time - last) / self.period
            if not usable[at]:
                self._fault(time, "a value is not a number", 1)
                continue
            if step < _OFF:
                self._fault(time, "came twice or out of order", 1)
                continue
            missing = 0 if np.isinf(step) else max(0, round(step) - 1)
            if missing:
                self._fault(last, "missing", missing)
            if keep and not missing and keep[-1][1] == at and not np.isinf(step):
                keep[-1] = (keep[-1][0], at + 1, keep[-1][2])
            else:
                keep.append((at, at + 1, missing))
            last = time
        return keep

    def _fault(self, time: float, kind: str, samples: int) -> None:
        self.counts[kind] = self.counts.get(kind, 0) + max(1, samples)
        if len(self.faults) < _MOST_FAULTS:
            self.faults.append(ClockFault(0.0 if np.isnan(time) else time, kind, samples))

    def told(self) -> list[ClockFault]:
        """Return the faults since the last call, and forget them."""
        found, self.faults = self.faults, []
        return found


MOST_WAITING = 20_000
"""Instants that may wait for a value that has not come; then the oldest are closed as they are."""


@dataclass
class RowAssembly:
    """Puts values with time stamps together to rows of ``width`` values.

    A row is whole once every item has a value at its instant or at a later one: what an item did not send it did not change, so its last
    value holds.
    """

    width: int
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
        self._rows.setdefault(time, {})[item] = value
        self._newest[item] = max(self._newest[item], time)
        return True

    def whole(self) -> SampleBlock:
        """Return the rows that are whole now."""
        return self._close(min(self._newest, default=-np.inf))

    def quiet(self) -> SampleBlock:
        """Return all rows that wait: the sender has been quiet long enough that nothing more comes for them."""
        return self._close(np.inf)

    def restart(self) -> SampleBlock:
        """Return all rows that wait, and forget: the sender starts anew, perhaps with another clock."""
        block = self.quiet()
        self._newest = [-np.inf] * self.width
        self._last = [np.nan] * self.width
        self._closed = -np.inf
        return block

    def _close(self, until: float) -> SampleBlock:
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
        return SampleBlock(np.array(times, dtype=np.float64), values)
