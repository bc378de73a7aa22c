"""A record read block by block, so that memory does not grow with its length."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import RecordError, nearest
from lathesim.hdf5_guard import own_item
from lathesim.json_text import parsed_json
from lathesim.live.sources.samples import Block, Signal
from lathesim.record import is_record

BLOCK = 8192


class RecordBlocks:
    """An open record file: its ``signals``, its length, and its samples in blocks. Raises :class:`RecordError` where it is no record."""

    def __init__(self, path: str | Path) -> None:
        import h5py

        self.path = Path(path)
        if not self.path.is_file() or not is_record(self.path):
            from lathesim.record import load

            load(self.path)  # which says in one sentence what is wrong
            raise RecordError("the file is no record.", place=str(path))
        self._file: Any = h5py.File(self.path, "r")
        channels = own_item(self._file, "channels")
        columns = {name: own_item(channels, name).attrs for name in _names(self._file)}
        self.signals = tuple(Signal(name, str(noted["unit"]), str(noted["description"])) for name, noted in columns.items())
        self._time = own_item(self._file, "time")

    def __len__(self) -> int:
        return min([int(self._time.shape[0]), *(int(self._file["channels"][signal.name].shape[0]) for signal in self.signals)])

    @property
    def period(self) -> float:
        """Return the median step of the first samples [s]; 0 with fewer than two."""
        first = self._time[:1000]
        return float(np.median(np.diff(first))) if len(first) > 1 else 0.0

    def named(self, names: Sequence[str]) -> list[str]:
        """Return ``names``, or refuse the first that is not there."""
        known = [signal.name for signal in self.signals]
        for name in names:
            if name not in known:
                remedy = nearest(name, known) or f"It has {', '.join(known[:6])}."
                raise RecordError(f"the record has no channel '{name}'.", place=str(self.path), remedy=remedy)
        return list(names)

    def blocks(self, names: Sequence[str] | None = None, size: int = BLOCK) -> Iterator[Block]:
        """Return the samples of some channels, or of all, in blocks."""
        wanted = self.named(names) if names is not None else [signal.name for signal in self.signals]
        columns = [self._file["channels"][name] for name in wanted]
        for begin in range(0, len(self), size):
            end = begin + size
            values = np.array([column[begin:end] for column in columns]).reshape(len(columns), -1)
            yield Block(np.asarray(self._time[begin:end]), values)

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _names(file: Any) -> list[str]:

    raw = file["channel_names"][()]
    names = parsed_json(raw.decode("utf-8") if isinstance(raw, bytes) else raw)
    return [str(name) for name in names]
