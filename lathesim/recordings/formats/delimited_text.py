"""Text tables: CSV with comma, semicolon, tab or white space, decimal point or comma, with or without names and units on top."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from lathesim.record import FloatArray
from lathesim.recordings.formats.number_rows import NumberRows, read_rows
from lathesim.recordings.formats.text_chunks import count_lines, head_lines
from lathesim.recordings.formats.text_layout import TextLayout, find_layout
from lathesim.recordings.raw_table import RawTable, as_table
from lathesim.recordings.reader import Reader


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
    if not layout.named:
        notes.append("the file names no columns; they are column_1, column_2 and so on")
    return notes


READER = Reader(
    "delimited text", (".csv", ".txt", ".tsv", ".dat", ".asc", ".log"), "table of numbers in text", reads_text, read_text, count_lines
)
