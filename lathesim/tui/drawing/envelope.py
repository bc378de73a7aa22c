"""A curve thinned to what a plot can show: the smallest and largest value of each column, so that no peak is lost."""

from __future__ import annotations

import numpy as np

from lathesim.record import FloatArray


def envelope(time: FloatArray, values: FloatArray, columns: int) -> tuple[FloatArray, FloatArray]:
    """Return time and values with at most two points a column, in order of time; both (points,), a short curve as it is."""
    count = len(time)
    if count <= 2 * columns or columns < 1:
        return time, values
    size = -(-count // columns)
    blocks = np.pad(values, (0, columns * size - count), mode="edge").reshape(columns, size)
    begin = np.arange(columns) * size
    index = np.concatenate([[0], begin + np.argmin(blocks, axis=1), begin + np.argmax(blocks, axis=1), [count - 1]])
    index = np.unique(np.minimum(index, count - 1))
    return time[index], values[index]
