"""Text that controls and drives write: tables whose head says which program made them, and with that the units and the clock.

Klipper's accelerometer, ODrive, moteus, SINUMERIK Edge, the scope of Heidenhain as pyLSV2 exports it, LinuxCNC's halscope, TwinCAT Scope.
Sources: Klipper, Measuring Resonances; ODrive and mjbots moteus, reference of their telemetry; LinuxCNC, ``scope_files.c``; Beckhoff
Infosys TF3300, export to CSV. Left out: trigger events and markers of TwinCAT, the alarms of Edge.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lathesim.errors import RecordingError
from lathesim.record import FloatArray
from lathesim.recordings.delimited_text import find_layout, is_number, read_text, told
from lathesim.recordings.number_rows import NUMBER, RowFormat, chunks, count_lines, head_lines, read_rows
from lathesim.recordings.raw_table import USUAL_PERIOD, RawTable, Reader, TimedChannel, as_table, refuse_size, timed_table, unique_names

_HEAD_LINES = 30
_TABLE = "table of numbers in text"
_AXIS = r"(?:\d|[xyzuvw]\d?)"
_LINEAR = r"[_|](?:[xyz]|X\d?|Y\d?|Z\d?)$"
_TURNING = r"[_|](?:sp|[abc]|SP\d?|A\d?|B\d?|C\d?)$"


@dataclass(frozen=True)
class TextForm:
    """The table of a program: the ``mark`` in its first lines, and the units of its columns by patterns of their whole names.

    ``clock`` finds the period [s] times ``tick`` in the first lines of a table that has no column of times. ``note`` is what else holds.
    """

    name: str
    suffixes: tuple[str, ...]
    mark: re.Pattern[str]
    units: tuple[tuple[str, str], ...] = ()
    clock: re.Pattern[str] | None = None
    tick: float = 1.0
    note: str = ""
    usual: float = 0.0
    """The period [s] at which the program samples where nobody chose another, for a table without a clock."""

    def unit(self, column: str) -> str:
        """Return the unit of a column, empty where the program has none for it."""
        return next((unit for pattern, unit in self.units if re.fullmatch(pattern, column, re.IGNORECASE)), "")

    def reads(self, path: Path) -> bool:
        """Return whether a file is such a table."""
        lines = head_lines(path)
        return self.mark.search("\n".join(lines[:_HEAD_LINES])) is not None and find_layout(lines) is not None

    def read(self, path: Path) -> RawTable:
        """Read the table; units of its own head count before those of the program."""
        table = read_text(path)
        found = {name: table.units[name] or self.unit(name) for name in table.columns}
        notes = (*table.notes, self.note) if self.note else table.notes
        if self.clock is None:
            return replace(table, units=found, notes=notes, constants={USUAL_PERIOD: self.usual} if self.usual else {})
        period = _period(self.clock, path) * self.tick
        times: FloatArray = period * np.arange(len(next(iter(table.columns.values()))), dtype=np.float64)
        return replace(table, columns={"time": times, **table.columns}, units={"time": "s", **found}, notes=notes)

    @property
    def reader(self) -> Reader:
        """The reader of such tables."""
        return Reader(self.name, self.suffixes, _TABLE, self.reads, self.read, count_lines)


def _period(clock: re.Pattern[str], path: Path) -> float:
    """Return the period that the head of a file tells; :class:`RecordingError` where it is none."""
    match = clock.search("\n".join(head_lines(path)[:_HEAD_LINES]))
    if match is None or not float(match[1]) > 0.0:
        raise RecordingError("the head of the file tells no sampling period.", place=str(path), remedy="Save the trace again.")
    return float(match[1])


_TIME = (r"#?time(?:stamp)?(?: ?\(s\))?", "s")
_HALSCOPE = re.compile(r"^# Sampling period is (\d+) ns", re.MULTILINE)
TEXT_FORMS = (
    TextForm(
        "Klipper accelerometer", (".csv",), re.compile(r"^#time,accel_x,accel_y,accel_z", re.MULTILINE),
        (_TIME, (r"accel_[xyz]", "mm/s^2")),
    ),
    TextForm(
        "ODrive log", (".csv",), re.compile(r"ODrive \d+ (?:Position|Velocity|Current)|\b(?:pos|vel)_estimate\b"),
        (
            _TIME, (r"(?:.*[. ])?(?:position|pos_estimate|input_pos|pos_setpoint)", "rev"),
            (r"(?:.*[. ])?(?:velocity|vel_estimate|input_vel|vel_setpoint)", "rev/s"),
            (r"(?:.*[. ])?(?:current|i[qd]_(?:measured|setpoint)|ibus)", "A"),
            (r"(?:.*[. ])?(?:torque_(?:estimate|setpoint)|input_torque|torque)", "N*m"), (r"(?:.*[. ])?vbus_voltage", "V"),
        ),
        note="positions count in turns, as ODrive counts from firmware 0.5 on",
    ),
    TextForm(
        "moteus log", (".csv", ".log"), re.compile(r"(?i)^(?=.*\bq_current)(?=.*\bvelocity)", re.MULTILINE),
        (
            _TIME, (r"(?:.*[. ])?(?:(?:abs_|encoder_\d_|control_)?position)", "rev"),
            (r"(?:.*[. ])?(?:(?:encoder_\d_|control_)?velocity)", "rev/s"), (r"(?:.*[. ])?(?:control_)?torque", "N*m"),
            (r"(?:.*[. ])?(?:control_)?[qd]_current", "A"), (r"(?:.*[. ])?voltage", "V"), (r"(?:.*[. ])?power", "W"),
        ),
    ),
    TextForm(
        "SINUMERIK Edge table", (".csv",),
        re.compile(rf"^(?=.*(?:DES_POS\|\d|\bcmd_pos_{_AXIS}\b))(?=.*(?:CONT_DEV\|\d|\bcont_dev_{_AXIS}\b))", re.MULTILINE),
        (
            _TIME, (rf"(?:(?:cmd_)?pos|cont_dev){_LINEAR}", "mm"), (rf"(?:(?:cmd_)?pos|cont_dev){_TURNING}", "deg"),
            (rf"(?:cmd_)?v{_LINEAR}", "mm/s"), (rf"(?:cmd_)?v{_TURNING}", "deg/s"), (rf"a{_LINEAR}", "mm/s^2"),
            (rf"a{_TURNING}", "deg/s^2"), (r"curr(?:ent)?[_|].*", "A"),
        ),
    ),
    TextForm(
        "Heidenhain scope", (".csv",),
        re.compile(r"\A(?=[^\n]*(?:^|[_,])[svai]_(?:act|nom|diff|ist|soll))[a-z][a-z0-9_]*(?:,[a-z][a-z0-9_]*)*$", re.MULTILINE),
        note="the export has neither times nor units; its program reads every 21 ms where no other interval was given",
        usual=0.021,
    ),
    TextForm("LinuxCNC halscope", (".csv", ".txt", ".log"), _HALSCOPE, clock=_HALSCOPE, tick=1e-9),
)  # fmt: skip


_OLD_SCOPE = re.compile(r"Sampling period is (\d+) nSec")


def reads_old_scope(path: Path) -> bool:
    """Return whether a file is what halscope wrote until LinuxCNC 2.8: the period, then rows of labels and values."""
    return bool(lines := head_lines(path)) and _OLD_SCOPE.match(lines[0]) is not None


def read_old_scope(path: Path) -> RawTable:
    """Read the rows; one with other labels than the first counts as missing. The commas of some languages are points."""
    period = _period(_OLD_SCOPE, path) * 1e-9
    rows = [[word if place % 2 == 0 else word.replace(",", ".") for place, word in enumerate(words)] for words in _word_rows(path) if words]
    labels = rows[0][::2] if rows else []
    refuse_size(path, len(rows), len(labels))
    lost = [row[::2] != labels or len(row) != 2 * len(labels) or not all(re.fullmatch(NUMBER, word) for word in row[1::2]) for row in rows]
    values = np.array([[np.nan] * len(labels) if bad else [float(word) for word in row[1::2]] for row, bad in zip(rows, lost, strict=True)])
    notes = (f"{sum(lost)} rows are damaged and count as missing",) if any(lost) else ()
    named = dict(zip(unique_names(["time", *labels]), [period * np.arange(len(rows)), *values.reshape(len(rows), -1).T], strict=True))
    return as_table(path, named, {"time": "s"}, notes, {})


def _word_rows(path: Path) -> Iterator[list[str]]:
    for piece in chunks(path, 1):
        yield from (line.decode("utf-8", errors="replace").split() for line in piece.split(b"\n"))


_SCOPE = re.compile(r"Name([\t ;,:])[^\n]*\nFile\1")
_TYPES = "Data-Type"
_KEYS = ("Name", _TYPES, "SymbolName", "Unit", "ScaleFactor", "Offset")
_PLAIN = {"ScaleFactor": "1", "Offset": "0"}


@dataclass(frozen=True)
class ScopeLayout:
    """Where the rows of a TwinCAT Scope table begin, and how they are written.

    ``channels`` has for each channel the cells of its time and its value, its name and its unit.
    """

    skip: int
    form: RowFormat
    channels: tuple[tuple[int, int, str, str], ...]
    notes: tuple[str, ...]


def scope_layout(lines: Sequence[str]) -> ScopeLayout | None:
    """Return the layout of a TwinCAT Scope table from its first lines; None where it is none.

    A cell with the key of its line, such as ``Data-Type``, stands over a column of times and begins a group of channels with these times.
    """
    match = _SCOPE.match("\n".join(lines[:2]))
    if match is None:
        return None
    mark = match[1]
    rows = [line.split(mark) for line in lines]
    block: dict[str, list[str]] = {}
    for row, line in zip(rows[4:], lines[4:], strict=True):
        if row[0] in _KEYS:
            block.setdefault(row[0], _unit_cells(line) if row[0] == "Unit" and mark == " " else row)
    filled = [number for number, row in enumerate(rows[5:], start=5) if row[0].strip()]
    first = next((number for number in filled if is_number(rows[number][0], comma=mark != ",")), None)
    if first is None or _TYPES not in block:
        return None
    kinds = block[_TYPES] if block[_TYPES][-1] else block[_TYPES][:-1]
    begins = [cell for cell, kind in enumerate(kinds) if kind == _TYPES]
    if begins[0] != 0:
        return None
    names, notes = _scope_names(block, kinds)
    units = block.get("Unit", [])
    valued = [cell for cell in range(len(kinds)) if cell not in begins]
    channels = tuple(
        (max(begin for begin in begins if begin < cell), cell, name, units[cell].partition("(")[0] if len(units) > cell else "")
        for cell, name in zip(valued, unique_names([names[cell] for cell in valued]), strict=True)
    )
    comma = mark != "," and any(re.search(r"\d,\d", line) for line in lines[first:])
    form = RowFormat(mark.strip(" "), comma, max(len(kinds), len(rows[first])), ends=frozenset(begins[1:]), end_mark=b"EOF")
    return ScopeLayout(first, form, channels, tuple(notes))


def _unit_cells(line: str) -> list[str]:
    """Return the cells of a line of units in which blanks separate them and stand inside them: ``Unit V (Voltage) (None)``."""
    return re.findall(r"Unit|(?:[^\s()]+ )?\([^)]*\)", line)


def _scope_names(block: dict[str, list[str]], kinds: list[str]) -> tuple[list[str], list[str]]:
    """Return the names of the cells, and what a person should know of the head."""
    notes = []
    names = block.get("Name", [])
    names = names[:-1] if names and not names[-1] else names
    if [name == "Name" for name in names] != [kind == _TYPES for kind in kinds]:
        names = block.get("SymbolName", [])[: len(kinds)]
        notes.append("the names of the channels cannot be told apart; they are called as their symbols")
    if len(names) < len(kinds):
        names = [f"column_{place}" for place in range(1, len(kinds) + 1)]
    if any(cell not in (plain, key, "") for key, plain in _PLAIN.items() for cell in block.get(key, [])):
        notes.append("the head has scales; the values are taken as scaled already")
    return names, notes


def reads_scope(path: Path) -> bool:
    """Return whether a file is a table of TwinCAT Scope."""
    return scope_layout(head_lines(path)) is not None


def read_scope(path: Path) -> RawTable:
    """Read the channels of a TwinCAT Scope table with their times, of which slower channels have fewer."""
    layout = scope_layout(head_lines(path))
    if layout is None:
        return as_table(path, {}, {}, (), {})
    rows = read_rows(path, layout.form, range(layout.form.width), layout.skip)
    series = []
    for time, cell, name, unit in layout.channels:
        known = np.flatnonzero(np.isfinite(rows.values[time]) | np.isfinite(rows.values[cell]))
        length = int(known[-1]) + 1 if len(known) else 0
        series.append(TimedChannel(name, unit, 1e-3 * rows.values[time, :length], rows.values[cell, :length]))
    return timed_table(path, series, (*layout.notes, *told(replace(rows, texts=()), [])))


@dataclass(frozen=True)
class _Refused:
    """A kind of file that no library reads, its first bytes, and what to do instead."""

    name: str
    suffix: str
    mark: bytes
    remedy: str

    def reads(self, path: Path) -> bool:
        with path.open("rb") as file:
            return path.suffix.lower() == self.suffix and file.read(len(self.mark)) == self.mark

    def read(self, path: Path) -> RawTable:
        raise RecordingError(f"this is a {self.name}, which no library reads.", place=str(path), remedy=self.remedy)


_REFUSED = (
    _Refused("project of TwinCAT Scope", ".svdx", b"", "Export it as CSV, with its header, from TwinCAT Scope."),
    _Refused("log of moteus's diagnostic tool", ".log", b"TLOG", "Write a CSV with moteus's Python library, one row for each query."),
)
TEXT_TRACE_READERS = [
    *(Reader(item.name, (item.suffix,), _TABLE, item.reads, item.read) for item in _REFUSED),
    Reader("TwinCAT Scope", (".csv", ".txt"), _TABLE, reads_scope, read_scope, count_lines),
    Reader("LinuxCNC halscope, until 2.8", (".txt", ".log"), _TABLE, reads_old_scope, read_old_scope, count_lines),
    *(form.reader for form in TEXT_FORMS),
]
