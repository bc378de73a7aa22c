"""What a reader finds in a file: named columns of numbers as they stand there, with the units the file gives; and what a reader is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lathesim.errors import RecordingError, nearest, visible
from lathesim.record import FloatArray
from lathesim.recordings.recording_thresholds import READING


def counted(number: int, noun: str, one: str = "", several: str = "") -> str:
    """Return ``1 sample is``, ``2 samples are``: a number, what it counts, and the verb ``one`` or ``several`` where there is one."""
    text = f"{number} {noun} {one}" if number == 1 else f"{number} {noun}s {several}"
    return text.strip()


@dataclass(frozen=True)
class Finding:
    """What was found in a recording, and what was done about it.

    ``kind`` is a word for programs (``unit``, ``gap``, ``frozen`` ...), ``channel`` the channel (several with ``, `` between, empty for
    the whole recording), ``fact`` and ``done`` read as a sentence. ``serious`` ones make the recording unfit to name physics from.
    """

    kind: str
    channel: str
    fact: str
    done: str
    serious: bool = False

    def __str__(self) -> str:
        place = f"{self.channel}: " if self.channel else ""
        return f"{place}{self.fact}; {self.done}." if self.done else f"{place}{self.fact}."


MOST_ROWS = 20_000_000
"""Values of one column that are read; a longer file is refused before it fills the memory."""
MOST_VALUES = 100_000_000
"""Values of a whole file that are read, 0.8 GB."""


USUAL_PERIOD = "usual period [s]"
"""The constant of a file without a clock for the period at which its program samples where nobody chose another."""


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
        more = f" and {len(names) - READING.named} more" if len(names) > READING.named else ""
        return nearest(wanted, names) or (f"It has {', '.join(names[: READING.named])}{more}." if names else "It has no columns.")


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

    if not text or len(text) > READING.unit:
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


@dataclass(frozen=True, eq=False)
class TimedChannel:
    """A channel with its own times [s]: name, unit as the file writes it, and values of the same length."""

    name: str
    unit: str
    times: FloatArray
    values: FloatArray


def timed_table(path: Path, series: Sequence[TimedChannel], notes: tuple[str, ...] = ()) -> RawTable:
    """Return the table of channels that have times of their own. Those with equal times share a column of them.

    It is called ``time`` for the times of the most channels, and ``time of NAME``, after the first of its channels, for others.
    """
    clocks: dict[bytes, list[TimedChannel]] = {}
    for item in series:
        clocks.setdefault(np.ascontiguousarray(item.times, dtype=np.float64).tobytes(), []).append(item)
    columns: dict[str, FloatArray] = {}
    units: dict[str, str] = {}
    for number, group in enumerate(sorted(clocks.values(), key=len, reverse=True)):
        refuse_size(path, len(group[0].values), len(series))
        clock = "time" if number == 0 else f"time of {group[0].name}"
        if back := int(np.count_nonzero(np.diff(group[0].times) < 0.0)):
            notes = (*notes, f"{clock}: {counted(back, 'row', 'is', 'are')} earlier than the row before")
        found = unique_names([*columns, clock, *(item.name for item in group)])[len(columns) :]
        columns |= dict(zip(found, [group[0].times, *(item.values for item in group)], strict=True))
        units |= dict(zip(found, ["s", *(plain_unit(item.unit) for item in group)], strict=True))
    if len(clocks) > 1:
        notes = (*notes, f"the channels have {len(clocks)} clocks; map those of one")
    notes += tuple(
        f"{name}: {missing} of {len(v)} values are no numbers" for name, v in columns.items() if (missing := int(np.isnan(v).sum()))
    )
    return as_table(path, columns, units, notes, {})


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


ENOUGH_SAMPLES = 100
"""Fewer samples than this say nothing about a machine."""
MOST_COMPARED = 1_000_000
"""Largest number of samples of a comparison or a fit: a few runs take 20 s and 0.7 GB."""
MOST_STEPS = 1e9
"""Largest number of steps of a recording: a compiled simulation takes about a minute for them."""
SHORTER = "Keep a part of the time, or every n-th row after a low-pass filter."
_HEAD = 100
"""Largest number of header lines of a text (assumed)."""


def reader_of(path: str | Path, readers: Mapping[str, Reader] | Iterable[Reader]) -> Reader:
    """Return the reader that fits a file: of those for its ending the first that recognises it, or else of all.

    Raises :class:`RecordingError` where the file is missing or is of no known kind.
    """
    place = Path(path)
    _check_place(place)
    known: list[Reader] = list(readers.values() if isinstance(readers, Mapping) else readers)
    fitting = [reader for reader in known if place.suffix.lower() in reader.suffixes]
    for reader in [*fitting, *(reader for reader in known if reader not in fitting)]:
        if reader.reads(place):
            return reader
    suffixes = ", ".join(dict.fromkeys(suffix for reader in known for suffix in reader.suffixes))
    if fitting:
        kinds = " or ".join(dict.fromkeys(reader.description for reader in fitting))
        raise RecordingError(f"the file ends in {place.suffix} and holds no {kinds}.", place=str(place), remedy=f"Read are {suffixes}.")
    raise RecordingError("the file is no recording of a known kind.", place=str(place), remedy=f"Read are {suffixes}.")


def read_recording(path: str | Path, readers: Mapping[str, Reader] | Iterable[Reader], most: int | None = None) -> RawTable:
    """Read a recording with the reader that fits, see :func:`reader_of`.

    A file with more than ``most`` rows, with some for a head, is refused before it is read where the reader can count them.

    Raises :class:`RecordingError` where the file is missing, is of no known kind, or cannot be read.
    """
    place, reader = Path(path), reader_of(path, readers)
    if most is not None and reader.rows is not None and (rows := reader.rows(place)) > most + _HEAD:
        fact = f"the file has {rows:,} rows; at most {most:,} are accepted here.".replace(",", " ")
        raise RecordingError(fact, place=str(place), remedy=SHORTER)
    return reader.read(place)


def _check_place(path: Path) -> None:
    if path.is_dir():
        raise RecordingError("this is a folder.", place=str(path), remedy="Give the name of a file.")
    if not path.exists():
        others = [other.name for other in path.parent.iterdir() if other.is_file()] if path.parent.is_dir() else []
        raise RecordingError("there is no such file.", place=str(path), remedy=nearest(path.name, others))
    try:
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as error:
        raise RecordingError(f"the file cannot be read: {error.strerror or error}.", place=str(path)) from error
    if empty:
        raise RecordingError("the file is empty.", place=str(path), remedy="Record again, or give another file.")


def too_short(place: str, count: int, needed: str, findings: Sequence[Finding], remedy: str) -> RecordingError:
    """Return the error of a recording with fewer samples than are needed: with its gaps, where these are why, or with a ``remedy``."""
    gap = next((finding for finding in findings if finding.kind == "gap" and "too long" in finding.fact), None)
    if gap is None:
        return RecordingError(f"the recording has {count} usable samples{needed}.", place=place, remedy=remedy)
    fact = f"{gap.fact}. The longest stretch between them has {count} samples{needed}."
    fill = "Record without gaps. Where it is known how the machine moved in them, fill them with rows at an even period (numpy.interp)."
    return RecordingError(fact, place=place, remedy=fill)
