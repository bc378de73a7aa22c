"""Recordings as a source: one file after another, with the channels named as the lesson's machine names them."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator, Sequence
from pathlib import Path

import numpy as np

from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared
from lathesim.live.recording_run import BLOCK, RecordBlocks
from lathesim.live.samples import LiveError, SampleBlock, Signal
from lathesim.plugins import Registry
from lathesim.record import FloatArray, is_record
from lathesim.recordings.mapping import SignalMapping
from lathesim.units import si_factor


class FileSource:
    """Samples of recordings, in the order of the files; each begins at its own time, moved behind the end of the one before.

    ``starts`` holds the time [s] at which each file begins. A record of this program is read in blocks, whatever its length, in the units
    that stand in it.
    """

    def __init__(self, files: Sequence[Path], prepared: Prepared, registry: Registry) -> None:
        mapping = mapping_of(prepared.case.lesson, prepared.machinery)
        self._files, self._registry = list(files), registry
        self._mapping = mapping
        self.mapped = mapping.signals
        self.starts: dict[str, float] = {}
        self._end = -np.inf

    @property
    def name(self) -> str:
        """Return the names of the files."""
        return ", ".join(str(file) for file in self._files[:3])

    @property
    def signals(self) -> tuple[Signal, ...]:
        """Return the driven inputs and compared outputs of the lesson."""
        return tuple(Signal(item.target, item.si_unit) for item in self.mapped)

    def where(self, time: float) -> str:
        """Return in which of several files a time [s] of the stream lies, as `` (april.h5, 15.0 s after it begins)``."""
        begun = [(start, name) for name, start in self.starts.items() if start <= time]
        if len(self._files) < 2 or not begun:
            return ""
        start, name = max(begun)
        return f" ({name}, {time - start:.1f} s after it begins)"

    async def blocks(self) -> AsyncIterator[SampleBlock]:
        """Return the samples of all files."""
        for file in self._files:
            for block in self._file(file):
                yield block

    def _file(self, file: Path) -> Iterator[SampleBlock]:
        offset: float | None = None
        for time, columns in self._raw(file):
            fresh = offset is None
            if offset is None:
                offset = 0.0 if not np.isfinite(self._end) else self._end + 1.0 - float(time[0])
                self.starts[file.name] = float(time[0]) + offset
            values = np.array([column * item.scale * si_factor(unit)[0] + item.offset for column, item, unit in columns])
            self._end = float(time[-1]) + offset
            notes = (f"{file.name} begins",) if fresh and len(self._files) > 1 else ()
            yield SampleBlock(time + offset, values, notes, fresh)

    def _raw(self, file: Path) -> Iterator[tuple[FloatArray, list[tuple[FloatArray, SignalMapping, str]]]]:
        if is_record(file):
            source = RecordBlocks(file)
            try:
                units = {signal.name: signal.unit for signal in source.signals}
                names = [_column(item, set(units), file) for item in self.mapped]
                for block in source.blocks(names):
                    yield block.time, [*zip(block.values, self.mapped, [units[name] for name in names], strict=True)]
            finally:
                source.close()
            return
        from lathesim.recordings.reading import read_recording

        table = read_recording(file, self._registry.readers)
        columns = [table.column(_column(item, set(table.columns), file)) for item in self.mapped]
        if self._mapping.time_column is not None:
            time = table.column(self._mapping.time_column) * si_factor(self._mapping.time_unit)[0]
        else:
            assert self._mapping.rate is not None
            time = np.arange(len(columns[0])) / self._mapping.rate
        for begin in range(0, len(time), BLOCK):
            part = slice(begin, begin + BLOCK)
            yield time[part], [(column[part], item, item.unit) for column, item in zip(columns, self.mapped, strict=True)]


def _column(item: SignalMapping, known: set[str], file: Path) -> str:
    for name in (item.column, item.target, *item.also):
        if name in known:
            return name
    plain = {name.partition("[")[0].strip(): name for name in known}
    if item.column in plain:
        return plain[item.column]
    raise LiveError(f"the file has no column '{item.column}'.", place=str(file), remedy=f"It has {', '.join(sorted(known)[:8])}.")
