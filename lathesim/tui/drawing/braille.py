"""Dots to braille characters: each character holds two by four dots."""

from __future__ import annotations

from typing import Any

import numpy as np

Dots = np.ndarray[Any, np.dtype[np.bool_]]
Codes = np.ndarray[Any, np.dtype[np.uint8]]

_WEIGHTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], dtype=np.uint8)
BRAILLE = 0x2800
"""The first braille character, the one without dots."""


def braille_codes(dots: Dots) -> Codes:
    """Return for each character (rows, columns) the sum of its dots' weights, from dots of shape (4 rows, 2 columns); 0 has no dot."""
    rows, columns = dots.shape[0] // 4, dots.shape[1] // 2
    cells = dots.reshape(rows, 4, columns, 2).transpose(0, 2, 1, 3)
    codes: Codes = (cells * _WEIGHTS).sum(axis=(2, 3), dtype=np.uint8)
    return codes


def trace(dots: Dots, x: Any, y: Any, *, dash: tuple[int, int] = (1, 0)) -> None:
    """Set the dots along a polyline, x to the right and y upwards in dots from the lower left corner.

    ``dash`` is how many dots are set and how many are left out in turn; (1, 0) leaves out none.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    usable = np.isfinite(x) & np.isfinite(y)
    x, y = x[usable], y[usable]
    if not len(x):
        return
    height, width = dots.shape
    x, y = np.clip(x, -4.0, width + 4.0), np.clip(y, -4.0, height + 4.0)
    steps = np.maximum(np.ceil(np.maximum(np.abs(np.diff(x)), np.abs(np.diff(y)))).astype(int), 1)
    index = np.repeat(np.arange(len(steps)), steps)
    share = (np.arange(len(index)) - np.repeat(np.cumsum(steps) - steps, steps) + 1) / steps[index] if len(index) else np.empty(0)
    columns = np.floor(np.append(x[0], x[index] + share * np.diff(x)[index])).astype(int)
    rows = height - 1 - np.floor(np.append(y[0], y[index] + share * np.diff(y)[index])).astype(int)
    if dash[1]:
        moved = np.append(True, (np.diff(columns) != 0) | (np.diff(rows) != 0))
        drawn = (np.cumsum(moved) - 1) % sum(dash) < dash[0]
        columns, rows = columns[drawn], rows[drawn]
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    dots[rows[inside], columns[inside]] = True
