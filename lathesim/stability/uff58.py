"""Universal files of dataset 58 (a function at a node): ASCII and binary, single and double, real and complex, even and uneven.

Own reading, because files of real instruments carry what libraries stumble over: a line end before the closing -1, a byte count in the
header that is half the true one, D exponents, headers that are not ASCII. Source: Universal File Format, dataset 58 and 58b, SDRC/UC-SDRL,
records 1 to 12. Left out: floating-point formats other than IEEE 754.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import RecordingError
from lathesim.record import FloatArray
from lathesim.whole_file import write_bytes

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+|[-+]\d{3})?")
_BARE_EXPONENT = re.compile(r"(\d)([-+]\d{3})$")
_HEADER = 11
"""Lines between the first line of a dataset and its data."""
_FORM, _KINDS, _COMPLEX, _DOUBLE = 5, (2, 4, 5, 6), (5, 6), (4, 6)
"""Numbers of the line of the form; kinds of values that may follow, those that are complex, and those of double precision."""
TIME, RESPONSE, COHERENCE, SPECTRUM = 1, 4, 6, 12
"""Function types."""


@dataclass(frozen=True, eq=False)
class Function58:
    """One function: abscissa and ordinate (lines,), its type, and what its axes say (specific data type, label, unit)."""

    x: FloatArray
    y: Any
    function_type: int
    title: str = ""
    numerator: tuple[int, str, str] = (0, "", "")
    denominator: tuple[int, str, str] = (0, "", "")


def read_uff58(path: Path) -> list[Function58]:
    """Return the functions of a universal file, others than dataset 58 left out; :class:`RecordingError` where it cannot be read."""
    raw = path.read_bytes()
    found: list[Function58] = []
    place = 0
    while True:
        mark = re.compile(rb"[ \t]*-1[ \t]*\r?\n").search(raw, place)
        if mark is None:
            break
        line, after = _line(raw, mark.end())
        text = line.decode("latin-1")
        number = text[:6].strip()
        if number == "58":
            function, place = _dataset(raw, text, after, str(path), len(found) + 1)
            found.append(function)
        elif number.isdigit():
            end = re.compile(rb"\n[ \t]*-1[ \t]*\r?(\n|$)").search(raw, after - 1)
            place = len(raw) if end is None else end.end()
        else:
            place = mark.end()
    if not found:
        raise RecordingError("the file holds no dataset 58.", place=str(path), remedy="Export the frequency response as UFF 58.")
    return found


def _line(raw: bytes, place: int) -> tuple[bytes, int]:
    end = raw.find(b"\n", place)
    end = len(raw) if end < 0 else end
    return raw[place:end].rstrip(b"\r"), end + 1


def _dataset(raw: bytes, first: str, place: int, path: str, number: int) -> tuple[Function58, int]:
    """Return a dataset that begins behind its first line at ``place``, and where the next may begin."""
    where = f"{path}: dataset {number}"
    sort = first[6:7].lower()
    binary = sort == "b"
    lines = []
    for _ in range(_HEADER):
        line, place = _line(raw, place)
        lines.append(line.decode("utf-8", errors="replace"))
    function = [int(item) for item in re.findall(r"-?\d+", lines[5][:5])]
    form = _numbers(lines[6])
    if not function or len(form) < _FORM:
        raise RecordingError("the header cannot be read.", place=where, remedy="Export the file again.")
    kind, count, even, start, step = int(form[0]), int(form[1]), int(form[2]) == 1, form[3], form[4]
    if kind not in _KINDS or count < 1:
        raise RecordingError(f"data type {kind} with {count} lines is not one of dataset 58.", place=where)
    columns = (2 if kind in _COMPLEX else 1) + (0 if even else 1)
    if binary:
        values, place = _binary(raw, place, first, count * columns, kind in _DOUBLE, where)
    else:
        values, place = _ascii(raw, place, count * columns, where)
    table = values.reshape(count, columns)
    x = start + step * np.arange(count) if even else table[:, 0].copy()
    y = table[:, -2] + 1j * table[:, -1] if kind in _COMPLEX else table[:, -1].copy()
    axes = [_axis(lines[row]) for row in (8, 9)]
    return Function58(np.asarray(x, dtype=np.float64), y, function[0], lines[0].strip(), axes[0], axes[1]), place


def _axis(line: str) -> tuple[int, str, str]:
    """Return the specific data type, label and unit of an axis."""
    kind = re.match(r"\s*(\d+)", line[:10])
    words = (line[26:46].strip(), line[47:67].strip())
    return (int(kind[1]) if kind else 0, *("" if word.upper() == "NONE" else word for word in words))  # type: ignore[return-value]


def _numbers(text: str) -> list[float]:
    return [float(_BARE_EXPONENT.sub(r"\1e\2", item.replace("D", "E").replace("d", "e"))) for item in _NUMBER.findall(text)]


def _ascii(raw: bytes, place: int, wanted: int, where: str) -> tuple[FloatArray, int]:
    end = re.compile(rb"(?:^|\n)[ \t]*-1[ \t]*\r?(\n|$)").search(raw, place - 1)
    text = raw[place : len(raw) if end is None else end.start()].decode("latin-1")
    words = text.replace("D", "E").replace("d", "e").split()
    try:
        values = np.array(words, dtype=np.float64)
    except ValueError:
        values = np.array(_numbers(text))
    if len(values) != wanted:
        values = np.array(_numbers(text))
    if len(values) < wanted:
        raise RecordingError(f"the data end after {len(values)} of {wanted} numbers.", place=where, remedy="Export the file again.")
    return values[:wanted], len(raw) if end is None else end.end()


def _binary(raw: bytes, place: int, first: str, wanted: int, double: bool, where: str) -> tuple[FloatArray, int]:
    fields = _numbers(first[7:])
    order, floating = (int(fields[0]), int(fields[1])) if len(fields) > 1 else (1, 2)
    if floating != 2:
        raise RecordingError(f"its numbers are in floating-point format {floating}.", place=where, remedy="Export IEEE 754 numbers.")
    kind = np.dtype(("<" if order != 2 else ">") + ("f8" if double else "f4"))
    size = wanted * kind.itemsize
    if len(raw) - place < size:
        have = (len(raw) - place) // kind.itemsize
        raise RecordingError(f"the data end after {have} of {wanted} numbers.", place=where, remedy="Export the file again.")
    values = np.frombuffer(raw, kind, wanted, place).astype(np.float64)
    closing = re.compile(rb"\s*-1[ \t]*\r?(\n|$)").match(raw, place + size)
    return values, place + size if closing is None else closing.end()


def write_uff58(functions: Sequence[Function58], path: Path, *, binary: bool = False) -> None:
    """Write functions as a universal file, doubles throughout; what is read back is equal (to 13 digits in ASCII).

    Raises :class:`RecordingError` where the abscissa has more digits than the ASCII form holds.
    """
    write_bytes(path, b"".join(part for function in functions for part in _written(function, binary, str(path))))


def _written(function: Function58, binary: bool, path: str) -> Iterator[bytes]:
    x = np.asarray(function.x, dtype=np.float64)
    y = np.asarray(function.y)
    start, step = float(f"{x[0]:.5e}"), float(f"{x[1] - x[0]:.5e}") if len(x) > 1 else 1.0
    even = np.array_equal(start + step * np.arange(len(x)), x)
    if not even and not binary and not np.array_equal(np.array([float(f"{value:.5e}") for value in x]), x):
        fact = "its frequencies have more than the six digits that the ASCII form holds."
        raise RecordingError(fact, place=path, remedy="Write it as CSV or as binary UFF 58.")
    table = np.stack(([] if even else [x]) + ([y.real, y.imag] if np.iscomplexobj(y) else [y]), axis=1).astype("<f8")
    size = table.size * 8
    lead = f"b{1:6d}{2:6d}{_HEADER:12d}{size:12d}{0:6d}{0:6d}{0:12d}{0:12d}" if binary else " " * 74
    kind = 6 if np.iscomplexobj(y) else 4
    head = [
        f"{-1:6d}",
        f"{58:6d}{lead}",
        *(f"{text[:80]:<80}" for text in (function.title or "NONE", "NONE", "NONE", "NONE", "NONE")),
        f"{function.function_type:5d}{0:10d}{0:5d}{0:10d} {'NONE':>10}{1:10d}{1:4d} {'NONE':>10}{1:10d}{1:4d}",
        f"{kind:10d}{len(x):10d}{int(even):10d}{start if even else 0.0:13.5e}{step if even else 0.0:13.5e}{0.0:13.5e}",
        _axis_line((18, "Frequency", "Hz")),
        _axis_line(function.numerator),
        _axis_line(function.denominator),
        _axis_line((0, "", "")),
    ]
    yield ("\n".join(head) + "\n").encode("utf-8", errors="replace")
    yield table.tobytes() + b"\n" if binary else _data_text(table, even).encode("ascii")
    yield f"{-1:6d}\n".encode("ascii")


def _axis_line(axis: tuple[int, str, str]) -> str:
    return f"{axis[0]:10d}{0:5d}{0:5d}{0:5d} {(axis[1] or 'NONE')[:20]:<20} {(axis[2] or 'NONE')[:20]:<20}"


def _data_text(table: FloatArray, even: bool) -> str:
    if even:
        flat = table.ravel()
        rows = [flat[at : at + 4] for at in range(0, len(flat), 4)]
        return "".join("".join(f"{value:20.12e}" for value in row) + "\n" for row in rows)
    widths = ["{:13.5e}"] + ["{:20.12e}"] * (table.shape[1] - 1)
    texts = ["".join(form.format(value) for form, value in zip(widths, row, strict=True)) for row in table.tolist()]
    together = 2 if table.shape[1] == 2 else 1
    return "".join("".join(texts[at : at + together]) + "\n" for at in range(0, len(texts), together))
