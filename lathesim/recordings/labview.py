"""LabVIEW measurement files (``.lvm``): text with a header, then segments, each with its own header of tagged lines.

Source: National Instruments, Specification for the LabVIEW Measurement File (.lvm). Tags count by name; the numbers of samples that a
header tells are not relied on, as programs append rows to a segment.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lathesim.errors import RecordingError
from lathesim.record import FloatArray
from lathesim.recordings.number_rows import RowFormat, RowParser, chunks, count_lines, head_lines
from lathesim.recordings.raw_table import MOST_VALUES, RawTable, Reader, as_table, plain_unit, refuse_size, unique_names

_END = "***End_of_Header***"
_DELIMITERS = {"tab": "\t", "comma": ",", "semicolon": ";", "space": " "}


@dataclass
class _Segment:
    """Tagged lines of one segment, the names of its cells, and its rows."""

    tags: dict[str, list[str]] = field(default_factory=dict)
    names: list[str] = field(default_factory=list)
    blocks: list[FloatArray] = field(default_factory=list)

    def numbers(self, tag: str, otherwise: float) -> list[float]:
        """Return the numbers of a tag, one a channel."""
        return [_number(text, otherwise) for text in self.tags.get(tag, [])]


def reads_lvm(path: Path) -> bool:
    """Return whether a file begins as LabVIEW measurement files do."""
    return any(line.startswith("LabVIEW Measurement") for line in head_lines(path)[:2])


def read_lvm(path: Path) -> RawTable:
    """Read every segment. The time is ``X_Value``, made of start and period where the file has no column of it.

    Segments of the same channels follow one another; where their times start anew, they are set behind one another and this is noted.
    """
    header = _header(path)
    delimiter = _DELIMITERS.get(header.get("Separator", "Tab").lower(), "\t")
    segments = _segments(path, delimiter, header.get("Decimal_Separator", ".") == ",")
    if not segments:
        return as_table(path, {}, {}, (), {})
    given = header.get("X_Columns", "One").lower()
    if given == "multi":
        return _own_times(path, segments)
    first = segments[0]
    same = [segment for segment in segments if segment.names == first.names]
    notes = [] if len(same) == len(segments) else [f"{len(segments) - len(same)} segments of other channels were left out"]
    parts = [_timed(segment, given == "one") for segment in same]
    width = min(part.shape[1] for part in parts)
    times, moved = _behind_one_another([part[:, 0] for part in parts])
    if moved:
        notes.append(f"{len(same)} segments whose times start anew were set behind one another")
    body = np.concatenate([part[:, 1:width] for part in parts])
    names = unique_names(["X_Value", *[name for name in first.names if name not in ("X_Value", "Comment")][: width - 1]])
    columns = dict(zip(names, [times, *body.T], strict=False))
    units = dict(zip(names, ["s", *(plain_unit(text) for text in first.tags.get("Y_Unit_Label", []))], strict=False))
    notes += [
        f"{name}: {missing} of {len(times)} cells hold no number" for name, v in columns.items() if (missing := int(np.isnan(v).sum()))
    ]
    return as_table(path, columns, units, tuple(notes), {})


def _header(path: Path) -> dict[str, str]:
    found = {}
    for line in head_lines(path):
        if line.startswith(_END):
            break
        tag, _, value = line.replace(",", "\t", 1).partition("\t") if "\t" not in line else line.partition("\t")
        found[tag.strip()] = value.strip() if value.strip(", ") else ","
    return found


def _segments(path: Path, delimiter: str, decimal: bool) -> list[_Segment]:
    """Go through the lines: tags until the end of a segment's header, a line of names, rows until the next tag."""
    refuse_size(path, count_lines(path), 1)
    segments: list[_Segment] = []
    parser: RowParser | None = None
    tags: dict[str, list[str]] | None = None
    expect_names = opened = False
    held = 0
    for piece in chunks(path):
        lines = piece.split(b"\n")
        texts = [number for number, line in enumerate(lines) if line[:1].isalpha() or line[:1] == b"*"]
        begin = 0
        for number in [*texts, len(lines)]:
            rows = b"\n".join(lines[begin:number])
            if opened and rows.strip():
                segment = segments[-1]
                if parser is None:
                    parser = _parser(rows, delimiter, decimal)
                segment.blocks.append(parser.parse(rows + b"\n")[0])
                held += segment.blocks[-1].size
                if held > MOST_VALUES:
                    fact = f"the file has more than {MOST_VALUES:,} values, the most that are read.".replace(",", " ")
                    raise RecordingError(fact, place=str(path), remedy="Keep fewer channels, or a part of the time.")
            begin = number + 1
            if number == len(lines):
                break
            line = lines[number].decode("latin-1")
            cells = [cell.strip() for cell in line.split(delimiter)]
            if line.startswith(_END):
                expect_names = tags is not None and "Channels" in tags
                if expect_names and tags is not None:
                    segments.append(_Segment(tags))
                tags, opened = {}, False
            elif expect_names:
                segments[-1].names = cells
                expect_names, opened, parser = False, True, None
            elif tags is not None:
                opened = False
                tags[cells[0]] = cells[1:]
    return [segment for segment in segments if segment.blocks]


def _parser(rows: bytes, delimiter: str, decimal: bool) -> RowParser:
    width = next(line for line in rows.split(b"\n") if line.strip()).count(delimiter.encode()) + 1
    return RowParser(RowFormat(delimiter, decimal, width), range(width))


def _timed(segment: _Segment, has_times: bool) -> FloatArray:
    """Return the rows of a segment (rows, 1 + channels) with the time first."""
    rows = np.concatenate(segment.blocks)
    count = len([name for name in segment.names if name not in ("X_Value", "Comment")])
    if has_times:
        return rows[:, : count + 1]
    period, start = (segment.numbers("Delta_X", 1.0) or [1.0])[0], (segment.numbers("X0", 0.0) or [0.0])[0]
    first = 1 if rows.shape[1] > count and np.isnan(rows[:, 0]).all() else 0
    return np.column_stack([start + period * np.arange(len(rows)), rows[:, first : first + count]])


def _behind_one_another(times: list[FloatArray]) -> tuple[FloatArray, bool]:
    """Return the times of all segments; one that does not begin after the end of the one before is moved to one period behind it."""
    moved, placed = False, [times[0]]
    for segment in times[1:]:
        before = placed[-1]
        if segment[0] <= before[-1]:
            period = float(np.median(np.diff(before))) if len(before) > 1 else 0.0
            segment, moved = segment - segment[0] + before[-1] + period, True
        placed.append(segment)
    return np.concatenate(placed), moved


def _own_times(path: Path, segments: list[_Segment]) -> RawTable:
    """Return the columns of a file in which each channel has its own times, ``X_Value`` before each."""
    first = segments[0]
    rows = np.concatenate([np.concatenate(segment.blocks) for segment in segments if segment.names == first.names])
    names = [name for name in first.names if name != "Comment"]
    named = unique_names(names)
    columns = {name: values for name, values in zip(named, rows.T, strict=False) if name}
    labels = iter(first.tags.get("Y_Unit_Label", []))
    units = {name: "s" if given == "X_Value" else plain_unit(next(labels, "")) for name, given in zip(named, names, strict=True)}
    return as_table(path, columns, units, ("each channel has its own times",), {})


def _number(text: str, otherwise: float) -> float:
    try:
        return float(text.replace(",", "."))
    except ValueError:
        return otherwise


LABVIEW_READER = Reader("LabVIEW measurement", (".lvm",), "LabVIEW measurement", reads_lvm, read_lvm, count_lines)
