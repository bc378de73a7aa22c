"""What LinuxCNC's ``halsampler`` prints: one line a sample, values between blanks, bits as TRUE and FALSE, no names."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lathesim.record import FloatArray
from lathesim.recordings.formats.delimited_text import told
from lathesim.recordings.formats.number_rows import RowFormat, read_rows
from lathesim.recordings.formats.text_chunks import count_lines, head_lines
from lathesim.recordings.formats.text_layout import is_number
from lathesim.recordings.raw_table import RawTable, as_table
from lathesim.recordings.reader import Reader


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


READER = Reader(
    "LinuxCNC halsampler", (".hal", ".halsampler", ".sampler", ".txt"), "samples of halsampler", reads_samples, read_samples, count_lines
)
