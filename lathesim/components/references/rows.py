"""Which row of a path table comes next."""

from __future__ import annotations

from typing import Any

from lathesim.path_columns import ARC_MOVE, DWELL, DWELL_PAUSE, KIND, LENGTH


def takes_time(path: Any, row: int) -> bool:
    """Return whether a segment needs at least one sample: it has a length, or is a dwell."""
    kind = path[row][KIND]
    if kind == DWELL_PAUSE:
        return bool(path[row][DWELL] > 0.0)
    return bool(kind <= ARC_MOVE and path[row][LENGTH] > 0.0)


def next_row(path: Any, row: int) -> int:
    """Return the first row after ``row`` that takes time, or the number of rows if there is none."""
    rows = len(path)
    following = row + 1
    while following < rows and not takes_time(path, following):
        following += 1
    return following
