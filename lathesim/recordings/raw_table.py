"""What a reader finds in a file: named columns of numbers as they stand there, with the units the file gives; and what a reader is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lathesim.errors import RecordingError, nearest, visible
from lathesim.record import FloatArray

MOST_ROWS = 20_000_000
"""Values of one column that are read; a longer file is refused before it fills the memory."""
MOST_VALUES = 100_000_000
"""Values of a whole file that are read, 0.8 GB."""


@dataclass(frozen=True, eq=False)
class RawTable:
    """Columns by name in the order of the file, each (rows,), NaN where a cell holds no number.

    Columns of one file may differ in length (a MAT file holds what it holds). ``units`` gives the unit text of each column as the file
    writes it, empty where it writes none. ``constants`` are the single numbers of the file, ``notes`` what was seen while reading.
    """

    columns: dict[str, FloatArray]
    units: dict[str, str]
    source: Path
    notes: tuple[str, ...] = ()
    constants: dict[str, float] = field(default_factory=dict)
    other_names: dict[str, str] = field(default_factory=dict)
    """Further names of columns (name -> column): another header line, or the position in a row."""

    def __post_init__(self) -> None:
        """Show control characters in the names of columns as escapes; a mapping uses the same names."""
        for item in ("columns", "units", "constants", "other_names"):
            object.__setattr__(self, item, {visible(name): value for name, value in getattr(self, item).items()})
        object.__setattr__(self, "units", {name: visible(unit) for name, unit in self.units.items()})
        object.__setattr__(self, "other_names", {name: visible(column) for name, column in self.other_names.items()})
        object.__setattr__(self, "notes", tuple(visible(note) for note in self.notes))

    def column_name(self, wanted: str) -> str | None:
        """Return the name of a column, asked for with or without the unit behind it, or None."""
        if wanted in self.columns:
            return wanted
        plain = split_unit(wanted)[0]
        return plain if plain in self.columns else self.other_names.get(plain)

    def column(self, wanted: str) -> FloatArray:
        """Return the values of a column; :class:`RecordingError` with the nearest name where there is none."""
        name = self.column_name(wanted)
        if name is None:
            raise RecordingError(f"the file has no column '{wanted}'.", place=str(self.source), remedy=self.near(wanted))
        return self.columns[name]

    def near(self, wanted: str) -> str:
        """Return the remedy for a missing column: the nearest name, or the names there are."""
        names = list(self.columns)
        more = f" and {len(names) - 8} more" if len(names) > 8 else ""
        return nearest(wanted, names) or (f"It has {', '.join(names[:8])}{more}." if names else "It has no columns.")


def split_unit(header: str) -> tuple[str, str]:
    """Return name and unit of ``"time [s]"``, ``"time (s)"`` or ``"time / s"``; the unit is empty where none is written.

    What stands in round brackets or behind a slash counts only where it is a unit: ``"velocity (filtered)"`` stays a name.
    """
    text = header.strip()
    for opening, closing, surely in (("[", "]", True), ("(", ")", False)):
        begin = text.rfind(opening)
        if text.endswith(closing) and begin > 0:
            unit = plain_unit(text[begin + 1 : -1])
            if surely or is_unit(unit):
                return text[:begin].strip(), unit
    name, slash, unit = text.rpartition(" / ")
    return (name.strip(), plain_unit(unit)) if slash and is_unit(plain_unit(unit)) else (text, "")


def plain_unit(text: str) -> str:
    """Return a unit in the signs the program uses: ``u`` for micro, ``^2``, ``*``; a dash and ``-`` count as no unit."""
    unit = text.strip().translate(_SIGNS).replace("**", "^")
    return "" if unit in ("-", "--", "_") else unit


_SIGNS = str.maketrans({"µ": "u", "μ": "u", "²": "^2", "³": "^3", "·": "*", "⋅": "*", "×": "*", "°": "deg", "–": "-", "—": "-"})  # noqa: RUF001


def is_unit(text: str) -> bool:
    """Return whether a text is a unit."""
    from lathesim.errors import UnitError
    from lathesim.units import si_factor

    if not text or len(text) > 20:
        return False
    try:
        si_factor(text)
    except UnitError:
        return False
    return True


def refuse_size(path: Path, rows: int, columns: int) -> None:
    """Refuse (:class:`RecordingError`) what would not fit the memory of an ordinary computer."""
    most = min(MOST_ROWS, MOST_VALUES // max(columns, 1))
    if rows > most:
        fact = f"the file has {rows:,} rows of {columns} columns; at most {most:,} rows are read.".replace(",", " ")
        raise RecordingError(fact, place=str(path), remedy="Keep every n-th row, fewer columns, or a part of the time.")


def unique_names(names: list[str]) -> list[str]:
    """Return names none of which comes twice: a repeated one gets a number, an empty one is called after its place."""
    taken: set[str] = set()
    found = []
    for place, given in enumerate(names, start=1):
        name, number = given or f"column_{place}", 1
        while name in taken:
            number += 1
            name = f"{given or f'column_{place}'}_{number}"
        taken.add(name)
        found.append(name)
    return found


def as_table(
    path: Path, named: Mapping[str, FloatArray], units: Mapping[str, str], notes: tuple[str, ...], constants: Mapping[str, float]
) -> RawTable:
    """Return the table of what a reader found; :class:`RecordingError` where it found no column of numbers."""
    if not named:
        seen = f" It holds single numbers only: {', '.join(list(constants)[:8])}." if constants else ""
        raise RecordingError(
            f"the file holds no column of numbers.{seen}", place=str(path), remedy="Give a file with one value an instant and signal."
        )
    columns = {name: np.ascontiguousarray(values, dtype=np.float64) for name, values in named.items()}
    return RawTable(columns, {name: units.get(name, "") for name in columns}, path, notes, dict(constants))


@dataclass(frozen=True)
class Reader:
    """Reads one kind of file.

    ``suffixes`` are the endings such files usually have, lower case with the dot. ``reads`` looks into a file, whatever its ending, and
    says whether it is of this kind, without raising. ``read`` gives its columns and raises :class:`RecordingError` in one sentence.
    ``rows`` counts the rows of a file that takes long to read, quickly: no fewer than it has.
    """

    name: str
    suffixes: tuple[str, ...]
    description: str
    reads: Callable[[Path], bool]
    read: Callable[[Path], RawTable]
    rows: Callable[[Path], int] | None = None
