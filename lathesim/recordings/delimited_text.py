"""Text tables: CSV in any of its forms, and the lines that LinuxCNC's ``halsampler`` prints.

Text with one value per line, ``name, date, time, value``, as ``camonitor`` of EPICS prints it, read into a column for each name.

Source: EPICS R3.14 Channel Access Reference Manual, section on ``camonitor``. A monitored value is printed where it changes, each name at
its own moments. Left out: values that are no numbers, the state of an alarm.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lathesim.record import FloatArray
from lathesim.recordings.number_rows import NUMBER, STAMP, NumberRows, RowFormat, chunks, count_lines, head_lines, read_rows
from lathesim.recordings.raw_table import RawTable, Reader, as_table, counted, is_unit, plain_unit, refuse_size, split_unit, unique_names
from lathesim.recordings.recording_thresholds import EQUAL, READING

_NUMBER = re.compile(NUMBER)
_VALUE = re.compile(r"[+-]?[\d.,]+([-:/.]\d+)*$|\d+([-:/.]\d+)+([ T]|$)")
"""A number, a date or a time of day, which is the value of a preamble and names no column."""
_WHEN = re.compile(STAMP.decode() + r"Z?")
_FORMS = (("\t", False), (";", False), (",", False), ("\t", True), (";", True), ("", False), ("", True))
_LOOKED_AT = 60
_NO_EXCEPTION = 0.3
"""Share of the cells of a column that decides its kind (assumed: half the lines of a short file may be its header)."""


@dataclass(frozen=True)
class TextLayout:
    """Where the rows begin (lines to skip) and how they are written, and the names and units of the cells."""

    skip: int
    form: RowFormat
    names: list[str]
    units: list[str]
    numeric: list[bool]
    """For each cell whether it holds numbers, as far as the first rows show."""
    named: bool
    odd_head: bool
    """Whether the names are fewer or more than the columns of numbers, so that they may stand over others."""
    other_names: dict[str, int]
    """Further names of the columns: other header lines, and the position in the row."""


def find_layout(lines: Sequence[str]) -> TextLayout | None:
    """Return the layout of a text table from its first lines, or None where there is no table of numbers in it."""
    filled = [(number, line) for number, line in enumerate(lines) if line.strip() and line[0] not in "#%"]
    sample = [line for _, line in filled[-_LOOKED_AT:]]
    if not sample:
        return None
    delimiter, comma, width = _written(sample)
    if width == 0:
        return None
    inside = comma or (delimiter == "," and any('"' in line for line in sample))
    kinds = _kinds([row for line in sample if len(row := cells(line, delimiter)) == width], width, inside)
    first = _first_row(filled, delimiter, comma, kinds)
    if first is None:
        return None
    above = [line for number, line in filled if number < first]
    if delimiter == "," and width == 2 and above and "," not in above[-1]:
        delimiter, comma, width, kinds = ";", True, 1, kinds[:1]
        inside = True
    rows = [cells(line, delimiter) for number, line in filled if number >= first][:_LOOKED_AT]
    rows = [row for row in rows if len(row) == width]
    names, units, count = _names(lines[:first], delimiter, width)
    numeric = [_numeric_share([row[cell] for row in rows], inside) > 0.0 for cell in range(width)]
    stamps = next((cell for cell, kind in enumerate(kinds) if kind == "when"), None)
    if stamps is not None:
        numeric[stamps] = True
        units[stamps] = "s"
    others = _other_names(above, delimiter, width)
    odd_head = count > width or (count > 0 and any(numeric[count:]))
    return TextLayout(first, RowFormat(delimiter, comma, width, stamps), unique_names(names), units, numeric, count > 0, odd_head, others)


def cells(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, without quotes and surrounding blanks."""
    if not delimiter:
        return line.split()
    if '"' in line:
        import csv

        try:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
        except csv.Error:  # a quoted cell longer than any line of numbers
            return [line]
    return [cell.strip() for cell in line.split(delimiter)]


def _written(sample: Sequence[str]) -> tuple[str, bool, int]:
    best, found = 0.0, ("", False, 0)
    quoted = any('"' in line for line in sample)
    for delimiter, comma in _FORMS:
        rows = [cells(line, delimiter) for line in sample]
        width, often = Counter(len(row) for row in rows).most_common(1)[0]
        if width < 2:
            continue
        share = _numeric_share([cell for row in rows for cell in row], comma or (quoted and delimiter == ","))
        score = share * often / len(rows)
        if score > best + EQUAL:
            best, found = score, (delimiter, comma, width)
    if best >= READING.numeric:
        return found
    for comma in (False, True):
        if _numeric_share([line.strip().strip('"') for line in sample], comma) > READING.column:
            return ";", comma, 1
    return "", False, 0


def _numeric_share(texts: Sequence[str], comma: bool) -> float:
    """Return the share of the cells that are not empty which are numbers."""
    given = [text for text in texts if text]
    return sum(is_number(text, comma) for text in given) / len(given) if given else 0.0


def is_number(text: str, comma: bool = False) -> bool:
    """Return whether a cell is a number, a date with time, or TRUE or FALSE."""
    plain = text.strip().strip('"')
    if comma:
        plain = plain.replace(",", ".")
    return _NUMBER.fullmatch(plain) is not None or plain.lower() in ("true", "false") or _WHEN.fullmatch(plain) is not None


def _kind(text: str, comma: bool) -> str:
    """Return ``when`` for a date and time, ``number``, ``text``, or nothing for an empty cell."""
    if not text:
        return ""
    if _WHEN.fullmatch(text.strip('"')):
        return "when"
    return "number" if is_number(text, comma) else "text"


def _kinds(rows: Sequence[Sequence[str]], width: int, comma: bool) -> list[str]:
    """Return the kind of each column: numbers or moments, whichever are more and not an exception, else text."""
    found = []
    for cell in range(width):
        counted = Counter(kind for row in rows if (kind := _kind(row[cell], comma)))
        most = max(("number", "when"), key=lambda kind: counted[kind])
        found.append(most if counted[most] >= _NO_EXCEPTION * max(counted.total(), 1) and counted else "text")
    return found


def _first_row(filled: Sequence[tuple[int, str]], delimiter: str, comma: bool, kinds: Sequence[str]) -> int | None:
    """Return the first line of which half of the cells, and the leftmost, have the ``kinds`` of their columns; preambles have labels."""
    leading = next((cell for cell, kind in enumerate(kinds) if kind in ("number", "when")), 0)
    for number, line in filled:
        row = cells(line, delimiter)
        quoted = delimiter == "," and '"' in line
        own = [_kind(cell, comma or quoted) for cell in row]
        if len(row) != len(kinds) or own[leading] not in ("", kinds[leading]):
            continue
        given = [place for place, kind in enumerate(own) if kind]
        if given and 2 * sum(own[place] in ("number", "when") and own[place] == kinds[place] for place in given) >= len(given):
            return number
    return None


def _names(above: Sequence[str], delimiter: str, width: int) -> tuple[list[str], list[str], int]:
    """Return names and units from the lines above the rows, and how many names stand there, empty ones at the end not counted.

    They stand in a row of names, perhaps with one of units below it, or in a comment line.
    """
    full = [row for line in above if line.strip() and line[0] not in "#%" and _fits(row := cells(line, delimiter), width)]
    full = [row for row in full if not any(_VALUE.match(cell) for cell in row)] or [row for row in full if not all(map(is_number, row))]
    if not full:
        notes = [line.lstrip("#% ") for line in above if line[:1] in ("#", "%")]
        full = [row for line in notes[-1:] if _fits(row := cells(line, delimiter), width)]
    if not full:
        return [f"column_{place}" for place in range(1, width + 1)], [""] * width, 0
    units = [""] * width
    names = full[-1]
    if len(full) > 1 and _are_units(full[-1]) and sum(map(bool, full[-2])) >= sum(map(bool, full[-1])):
        names = full[-2]
        units = [unit if (unit := _unit_cell(text)).lower() not in _LABELS else "" for text in _filled_up(full[-1], width)]
    pairs = [split_unit(name) for name in _filled_up(names, width)]
    count = max((place for place, name in enumerate(names, start=1) if name), default=0)
    return [name for name, _ in pairs], [own or unit for (_, own), unit in zip(pairs, units, strict=True)], count


def _other_names(above: Sequence[str], delimiter: str, width: int) -> dict[str, int]:
    """Return the header texts above each column, the nearest first, and ``column_1``, ``column_2`` ..., each with its position."""
    found: dict[str, int] = {}
    for line in reversed(above):
        row = [split_unit(cell)[0] for cell in cells(line, delimiter)]
        if len(row) == width:
            for place, name in enumerate(row):
                found.setdefault(name, place)
    return found | {f"column_{place + 1}": place for place in range(width)}


def _fits(row: Sequence[str], width: int) -> bool:
    """Return whether a line of text can name the cells of a row: as many cells, but for empty or unused ones at the end."""
    return abs(len(row) - width) <= 1 and 2 * sum(bool(cell) for cell in row) >= width


def _filled_up(row: Sequence[str], width: int) -> list[str]:
    return [*row[:width], *[""] * (width - len(row))]


def _are_units(row: Sequence[str]) -> bool:
    given = [text for text in (_unit_cell(cell) for cell in row) if text and text.lower() not in _LABELS]
    bracketed = all(cell[0] + cell[-1] in ("[]", "()") for cell in row if cell)
    return bracketed or (bool(given) and 2 * sum(is_unit(text) for text in given) > len(given))


def _unit_cell(text: str) -> str:
    return plain_unit(text.strip("[]() ")) if text else ""


_LABELS = ("unit", "units", "einheit")
"""Words that introduce a row of units and are no units."""


def reads_text(path: Path) -> bool:
    """Return whether a file is text with a table of numbers in it."""
    return find_layout(head_lines(path)) is not None


def read_text(path: Path) -> RawTable:
    """Read a text table. Columns of text are left out; files without names get ``column_1``, ``column_2`` and so on."""
    layout = find_layout(head_lines(path))
    if layout is None:
        return as_table(path, {}, {}, (), {})
    used = [cell for cell, numeric in enumerate(layout.numeric) if numeric]
    if not used:
        return as_table(path, {}, {}, (), {})
    rows = read_rows(path, layout.form, used, layout.skip)
    notes = told(rows, [layout.names[cell] for cell in used])
    dropped = [name for name, numeric in zip(layout.names, layout.numeric, strict=True) if not numeric and not name.startswith("column_")]
    if dropped:
        notes.append(f"left out, no numbers in them: {', '.join(dropped)}")
    columns: dict[str, FloatArray] = {}
    for cell, values in zip(used, rows.values, strict=True):
        if len(values) and np.isnan(values).all() and layout.names[cell].startswith("column_"):
            continue
        columns[layout.names[cell]] = values
    table = as_table(path, columns, dict(zip(layout.names, layout.units, strict=True)), (*_form(layout), *notes), {})
    others = {other: name for other, cell in layout.other_names.items() if (name := layout.names[cell]) in columns}
    return replace(table, other_names=others)


def told(rows: NumberRows, names: list[str]) -> list[str]:
    """Return what a person should know of the rows that were read."""
    notes = []
    if rows.odd_rows:
        notes.append(f"{rows.odd_rows} rows have another number of cells, the first is line {rows.first_odd}; they count as missing")
    if rows.cut_row:
        notes.append("the last row is cut off and was dropped")
    count = rows.values.shape[1]
    notes += [f"{name}: {texts} of {count} cells hold no number" for name, texts in zip(names, rows.texts, strict=True) if texts]
    return notes


def _form(layout: TextLayout) -> list[str]:
    notes = []
    if layout.form.decimal_comma:
        notes.append("numbers are written with a decimal comma")
    if layout.odd_head:
        notes.append("the head has fewer or more names than the rows have columns; they may stand over others")
    if not layout.named:
        notes.append("the file names no columns; they are column_1, column_2 and so on")
    return notes


TEXT_READER = Reader(
    "delimited text", (".csv", ".txt", ".tsv", ".dat", ".asc", ".log"), "table of numbers in text", reads_text, read_text, count_lines
)


def reads_samples(path: Path) -> bool:
    """Return whether every line is a row of numbers and bits between single blanks, as ``halsampler`` prints them."""
    lines = [line for line in head_lines(path) if line.strip() and line.strip() != "overrun"][:200]
    if not lines or any(mark in line for line in lines for mark in ",;\t#%"):
        return False
    rows = [line.split() for line in lines]
    whole = [row for row in rows if len(row) == len(rows[0])]
    return len(whole) >= len(rows) - 1 and all(is_number(cell) for row in whole for cell in row)


def read_samples(path: Path) -> RawTable:
    """Read the samples. The number of the sample that option ``-t`` puts first is called ``sample``, the rest ``column_2`` and so on.

    A gap in the sample numbers (an overrun) stays visible in ``sample``, which can be mapped as the time, in thread periods.
    """
    lines = [line for line in head_lines(path) if line.strip() and line.strip() != "overrun"]
    width = len(lines[0].split())
    rows = read_rows(path, RowFormat("", False, width), range(width), 0)
    names = [f"column_{place}" for place in range(1, width + 1)]
    values, notes = rows.values, []
    lost = rows.odd_rows if width > 1 else 0
    if width > 1 and values.shape[1] > 1 and _counts(values[0]):
        names[0] = "sample"
        values = values[:, np.isfinite(values[0])]
        missing = int(np.sum(np.diff(values[0]) - 1.0))
        if missing:
            notes.append(f"{missing} samples are missing by their numbers (overrun)")
        lost = 0
    notes += [note for note in told(rows, names) if lost or "number of cells" not in note]
    return as_table(path, dict(zip(names, values, strict=True)), {}, tuple(notes), {})


def _counts(first: FloatArray) -> bool:
    known = first[np.isfinite(first)]
    if len(known) < 2 or not np.array_equal(known, np.floor(known)):
        return False
    steps = np.diff(known)
    return bool(np.all(steps >= 1.0) and np.median(steps) == 1.0)


HALSAMPLER_READER = Reader(
    "LinuxCNC halsampler", (".hal", ".halsampler", ".sampler", ".txt"), "samples of halsampler", reads_samples, read_samples, count_lines
)


_BETWEEN = rb"[ \t]*[,;\t ][ \t]*"
_NAME = rb'^[ \t]*"?([A-Za-z_][^\s,;"]*)"?'
_MOMENT = rb'"?(\d{4}-\d\d-\d\d)"?(?:T|' + _BETWEEN + rb')"?(\d\d:\d\d:\d\d(?:\.\d{1,9})?)Z?"?'
# an alarm state may follow the number, but no other number
_LONG_VALUE = rb'"?(' + NUMBER.encode() + rb')"?[ \t]*(?:$|\r|[,; \t]+[^-+.\d\s,;])'
_LINE = re.compile(_NAME + _BETWEEN + _MOMENT + _BETWEEN + _LONG_VALUE, re.MULTILINE)
_LINES_LOOKED_AT = 200
_MOST_NAMES = 64
_CLOSE = 2.5
"""Largest distance of two values of a name [periods of the table] that is interpolated; a longer one means no change (assumed)."""


def reads_long_table(path: Path) -> bool:
    """Return whether most lines have a name, date, time and one number."""
    lines = [line for line in head_lines(path) if line.strip()][:_LINES_LOOKED_AT]
    return bool(lines) and 2 * sum(_LINE.match(line.encode()) is not None for line in lines) > len(lines)


def read_long_table(path: Path) -> RawTable:
    """Read the values of each name as a column, all at the moments of the most frequent name; ``time`` [s] begins at the first line.

    Between values that are close in time a name moves on a straight line. Where they are further apart it had not changed until then.
    """
    refuse_size(path, count_lines(path), 2)
    moments, values, lost = _events(path)
    if not values:
        return as_table(path, {}, {}, (), {})
    names = sorted(values, key=lambda name: -len(values[name]))
    first = min(min(stamps) for stamps in moments.values())
    times = {name: (np.array(moments[name], dtype="datetime64[ns]") - first) / np.timedelta64(1, "s") for name in names}
    at = np.unique(times[names[0]])
    columns: dict[str, FloatArray] = {"time": at}
    notes = [f"the file has one value per line; the rows are the {len(at)} moments of {names[0]}"]
    for name in list(values)[:_MOST_NAMES]:
        columns[name] = _at(at, times[name], np.array(values[name]))
        if name != names[0]:
            notes.append(f"{name}: {len(values[name])} values, put on these rows")
    if len(names) > _MOST_NAMES:
        notes.append(f"left out, names beyond the first {_MOST_NAMES}: {len(names) - _MOST_NAMES}")
    back = sum(int(np.count_nonzero(np.diff(times[name]) < 0.0)) for name in names)
    if back:
        notes.append(f"{counted(back, 'value', 'is', 'are')} earlier than the one before of the same name")
    if lost:
        notes.append(f"{counted(lost, 'line', 'holds', 'hold')} no number and {'was' if lost == 1 else 'were'} left out")
    return as_table(path, columns, {"time": "s"}, tuple(notes), {})


def _events(path: Path) -> tuple[dict[str, list[np.datetime64]], dict[str, list[float]], int]:
    """Return moments and values of each name, and the number of lines without a value."""
    moments: dict[str, list[np.datetime64]] = {}
    values: dict[str, list[float]] = {}
    lost = 0
    for piece in chunks(path):
        found = 0
        for name, date, clock, value in _LINE.findall(piece):
            try:
                moment = np.datetime64(f"{date.decode()}T{clock.decode()}", "ns")
            except ValueError:
                continue
            key = name.decode("utf-8", errors="replace")
            moments.setdefault(key, []).append(moment)
            values.setdefault(key, []).append(float(value))
            found += 1
        lost += sum(1 for line in piece.split(b"\n") if line.strip()) - found
    return moments, values, lost


def _at(at: FloatArray, times: FloatArray, values: FloatArray) -> FloatArray:
    """Return the values of a name at the moments of the table; NaN before its first value."""
    order = np.argsort(times, kind="stable")
    times, values = times[order], values[order]
    before = np.searchsorted(times, at, side="right") - 1
    after = np.minimum(before + 1, len(times) - 1)
    here = values[np.maximum(before, 0)]
    apart = times[after] - times[np.maximum(before, 0)]
    period = float(np.median(np.diff(at))) if len(at) > 1 else 0.0
    share = np.divide(at - times[np.maximum(before, 0)], apart, out=np.zeros_like(at), where=(apart > 0.0) & (apart <= _CLOSE * period))
    with np.errstate(invalid="ignore", over="ignore"):  # a value may be infinite
        found: FloatArray = np.where(before < 0, np.nan, here + share * (values[after] - here))
    return found


LONG_TABLE_READER = Reader(
    "values by name", (".csv", ".txt", ".log"), "table of numbers in text", reads_long_table, read_long_table, count_lines
)
