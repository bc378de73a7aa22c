"""Arrays of binary files as columns: vectors by name, matrices as ``name_1``, ``name_2`` and so on, single numbers as constants."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import RecordingError
from lathesim.record import FloatArray
from lathesim.recordings.raw_table import MOST_VALUES, RawTable, as_table, refuse_size


@dataclass
class ArrayColumns:
    """Columns, constants and notes, gathered array by array."""

    path: Path
    columns: dict[str, FloatArray] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    constants: dict[str, float] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)

    def check(self, shape: tuple[int, ...]) -> None:
        """Refuse (:class:`RecordingError`) an array that is too large, before it is read."""
        longest = max(shape, default=1)
        count = int(np.prod(shape, dtype=np.int64)) if shape else 1
        refuse_size(self.path, longest, max(count // max(longest, 1), 1))
        if sum(len(values) for values in self.columns.values()) + count > MOST_VALUES:
            fact = f"the file holds more than {MOST_VALUES:,} values, the most that are read.".replace(",", " ")
            raise RecordingError(fact, place=str(self.path), remedy="Keep fewer signals, or a part of the time.")

    def take(self, name: str, array: Any, unit: str = "") -> None:
        """Take an array; what is not real numbers of at most two dimensions is left out by name."""
        values = np.asarray(array)
        if values.dtype.kind not in "fiub" or values.size == 0:
            self.left_out.append(name)
            return
        squeezed = np.squeeze(values).astype(np.float64)
        if squeezed.ndim == 0:
            self.constants[name] = float(squeezed)
        elif squeezed.ndim == 1:
            self._put(name, squeezed, unit)
        elif squeezed.ndim == 2:
            table = squeezed if squeezed.shape[0] >= squeezed.shape[1] else squeezed.T
            if table.shape[1] > 64:
                self.left_out.append(name)
                return
            for number, column in enumerate(table.T, start=1):
                self._put(f"{name}_{number}", column, unit)
        else:
            self.left_out.append(name)

    def _put(self, name: str, values: FloatArray, unit: str) -> None:
        self.columns[name] = np.ascontiguousarray(values)
        self.units[name] = unit

    def table(self) -> RawTable:
        """Return the table of what was gathered."""
        notes = (f"left out, no columns of numbers: {', '.join(self.left_out)}",) if self.left_out else ()
        return as_table(self.path, self.columns, self.units, notes, self.constants)
