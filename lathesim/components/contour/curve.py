"""A smooth free path: cubic pieces between points, and the nearest point on them.

Columns of the table ``curve`` (one row a point, SI): x, z, and the derivatives x', z' over the number of the row; between two rows the
path is the cubic with these ends, p(u) = h00 p0 + h10 p0' + h01 p1 + h11 p1', u from 0 to 1. A closed path repeats its first point.
"""

from __future__ import annotations

import math
from typing import Any

CURVE_COLUMNS = ("x", "z", "x_slope", "z_slope")
EXAMPLE_CURVE = [
    [0.0, 0.0, 2e-3, 0.0],
    [2e-3, 1e-3, 2e-3, 2e-3],
    [3e-3, 3e-3, 0.0, 2e-3],
    [2e-3, 5e-3, -2e-3, 2e-3],
]
"""Three pieces of some millimetres, for the conformance test."""

_STEPS = 12
_LONGEST_STEP = 0.25
"""Pieces by which Newton's method may go at once: a longer step could end on another branch."""
_FEWEST = 1.0e-30


def point_of(curve: Any, at: float, column: int, order: int) -> float:
    """Return the coordinate (0 x, 1 z) of the point ``at`` (row number with its part), or its first or second derivative over it."""
    last = len(curve) - 2
    row = int(at)
    if row > last:
        row = last
    if row < 0:
        row = 0
    u = at - row
    p0 = curve[row][column]
    p1 = curve[row + 1][column]
    m0 = curve[row][column + 2]
    m1 = curve[row + 1][column + 2]
    c2 = 3.0 * (p1 - p0) - 2.0 * m0 - m1
    c3 = 2.0 * (p0 - p1) + m0 + m1
    if order == 0:
        return float(p0 + u * (m0 + u * (c2 + u * c3)))
    if order == 1:
        return float(m0 + u * (2.0 * c2 + 3.0 * u * c3))
    return float(2.0 * c2 + 6.0 * u * c3)


def nearest_on(curve: Any, x: float, z: float, start: float) -> float:
    """Return where on the curve (row number with its part) the distance to (x, z) is least, near ``start``.

    Newton's method on f(u) = (p(u) - q) . p'(u) = 0, with the Gauss-Newton slope where the distance is not convex and steps of at most a
    quarter of a piece, so that the answer stays on the branch it begins on. At the ends it stands at the end.
    """
    end = len(curve) - 1.0
    at = start
    for _ in range(_STEPS):
        dx = point_of(curve, at, 0, 0) - x
        dz = point_of(curve, at, 1, 0) - z
        tx = point_of(curve, at, 0, 1)
        tz = point_of(curve, at, 1, 1)
        along = dx * tx + dz * tz
        square = tx * tx + tz * tz
        slope = square + dx * point_of(curve, at, 0, 2) + dz * point_of(curve, at, 1, 2)
        if slope < 0.25 * square:
            slope = square
        if slope < _FEWEST:
            return at
        change = -along / slope
        if change > _LONGEST_STEP:
            change = _LONGEST_STEP
        if change < -_LONGEST_STEP:
            change = -_LONGEST_STEP
        at = at + change
        if at < 0.0:
            at = 0.0
        if at > end:
            at = end
        if abs(change) < 1.0e-13 * (1.0 + at):
            return at
    return at


def curvature_at(curve: Any, at: float) -> float:
    """Return the signed curvature [1/m] there, positive where the path bends to the left (from +Z towards +X seen along it)."""
    tx = point_of(curve, at, 0, 1)
    tz = point_of(curve, at, 1, 1)
    square = tx * tx + tz * tz
    if square < _FEWEST:
        return 0.0
    bend = tz * point_of(curve, at, 0, 2) - tx * point_of(curve, at, 1, 2)
    return bend / (square * math.sqrt(square))
