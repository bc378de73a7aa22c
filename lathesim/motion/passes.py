"""The two passes of the quickest timing in machine code: backward for what can still be stopped, forward as quick as that allows.

The unknown is b = (ds/dt)^2 at the nodes of a grid. Between two nodes b is a straight line, so the path acceleration there is the constant
(b1 - b0) / (2 ds). A limit of an axis is then |c b0 + d b1| <= 1 at each end of a segment.

Source: H. Pham, Q.-C. Pham, A new approach to time-optimal path parameterization based on reachability analysis, IEEE Trans. Robotics
34 (2018): controllable sets backward, greedy forward.
"""

from __future__ import annotations

import numba
import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

_MOST_STEPS = 60


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _span_of_end(c: FloatArray, d: FloatArray, x: float, top: float) -> tuple[float, float, int, int]:
    """Return the interval of b1 that the limits leave at b0 = x, and the two rows that bound it (-1 and -2: 0 and ``top``)."""
    low, high = 0.0, top
    low_row, high_row = -1, -2
    for row in range(len(c)):
        slope = d[row]
        if slope == 0.0:
            continue
        first = (-1.0 - c[row] * x) / slope
        last = (1.0 - c[row] * x) / slope
        if slope < 0.0:
            first, last = last, first
        if first > low:
            low, low_row = first, row
        if last < high:
            high, high_row = last, row
    return low, high, low_row, high_row


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _bound_line(c: FloatArray, d: FloatArray, row: int, lower: bool, top: float) -> tuple[float, float]:
    """Return a bound of b1 as the line p + q b0."""
    if row == -1:
        return 0.0, 0.0
    if row == -2:
        return top, 0.0
    sign = -1.0 if lower else 1.0
    if d[row] < 0.0:
        sign = -sign
    return sign / d[row], -c[row] / d[row]


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _largest_begin(c: FloatArray, d: FloatArray, cap: float, top: float) -> float:
    """Return the largest b0 <= cap from which some b1 in [0, top] can be reached: Newton's steps from above on a convex function."""
    x = cap
    for row in range(len(c)):
        if d[row] == 0.0 and abs(c[row]) * x > 1.0:
            x = 1.0 / abs(c[row])
    for _ in range(_MOST_STEPS):
        low, high, low_row, high_row = _span_of_end(c, d, x, top)
        if low <= high:
            return x
        p_low, q_low = _bound_line(c, d, low_row, True, top)
        p_high, q_high = _bound_line(c, d, high_row, False, top)
        slope = q_low - q_high
        if slope <= 0.0:
            return 0.0
        new = (p_high - p_low) / slope
        if new >= x:
            return x
        x = max(0.0, new)
    return x


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _rows(left: FloatArray, left2: FloatArray, right: FloatArray, right2: FloatArray, ds: float, c: FloatArray, d: FloatArray) -> None:
    """Write the limits of a segment as rows |c b0 + d b1| <= 1, from slopes and curvatures already divided by the limits."""
    axes = len(left)
    for axis in range(axes):
        share = left[axis] / (2.0 * ds)
        c[axis] = left2[axis] - share
        d[axis] = share
        share = right[axis] / (2.0 * ds)
        c[axes + axis] = -share
        d[axes + axis] = share + right2[axis]


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def quickest(ds: FloatArray, left: FloatArray, left2: FloatArray, right: FloatArray, right2: FloatArray, cap: FloatArray) -> FloatArray:
    """Return b at the nodes, (segments + 1,).

    ``ds`` (segments,); ``left``, ``left2``, ``right``, ``right2`` (segments, axes) are q' and q'' at both ends of each segment over the
    largest acceleration; ``cap`` (segments + 1,) is the largest b the velocities allow, 0 where the axes stand.
    """
    segments, axes = left.shape
    c = np.empty(2 * axes)
    d = np.empty(2 * axes)
    b = cap.copy()
    for at in range(segments - 1, -1, -1):
        _rows(left[at], left2[at], right[at], right2[at], ds[at], c, d)
        b[at] = _largest_begin(c, d, cap[at], b[at + 1])
    for at in range(segments):
        _rows(left[at], left2[at], right[at], right2[at], ds[at], c, d)
        low, high, _, _ = _span_of_end(c, d, b[at], b[at + 1])
        b[at + 1] = max(0.0, min(b[at + 1], max(low, high)))
    return b
