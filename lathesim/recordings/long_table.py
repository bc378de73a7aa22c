"""Text with one value per line, ``name, date, time, value``, as ``camonitor`` of EPICS prints it, read into a column for each name.

Source: EPICS R3.14 Channel Access Reference Manual, section on ``camonitor``. A monitored value is printed where it changes, each name at
its own moments. Left out: values that are no numbers, the state of an alarm.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from lathesim.record import FloatArray
from lathesim.recordings.finding import counted
from lathesim.recordings.number_rows import NUMBER, chunks, count_lines, head_lines
from lathesim.recordings.raw_table import RawTable, Reader, as_table, refuse_size

_BETWEEN = rb"[ \t]*[,;\t ][ \t]*"
_NAME = rb'^[ \t]*"?([A-Za-z_][^\s,;"]*)"?'
_MOMENT = rb'"?(\d{4}-\d\d-\d\d)"?(?:T|' + _BETWEEN + rb')"?(\d\d:\d\d:\d\d(?:\.\d{1,9})?)Z?"?'
# an alarm state may follow the number, but no other number
_VALUE = rb'"?(' + NUMBER.encode() + rb')"?[ \t]*(?:$|\r|[,; \t]+[^-+.\d\s,;])'
_LINE = re.compile(_NAME + _BETWEEN + _MOMENT + _BETWEEN + _VALUE, re.MULTILINE)
_LOOKED_AT = 200
_MOST_NAMES = 64
_CLOSE = 2.5
"""Largest distance of two values of a name [periods of the table] that is interpolated; a longer one means no change (assumed)."""


def reads_long_table(path: Path) -> bool:
    """Return whether most lines have a name, date, time and one number."""
    lines = [line for line in head_lines(path) if line.strip()][:_LOOKED_AT]
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
    found: FloatArray = np.where(before < 0, np.nan, here + share * (values[after] - here))
    return found


LONG_TABLE_READER = Reader(
    "values by name", (".csv", ".txt", ".log"), "table of numbers in text", reads_long_table, read_long_table, count_lines
)
