"""A curve thinned to what a plot can show: the smallest and largest value of each column, so that no peak is lost."""

from __future__ import annotations

import numpy as np

from lathesim.record import FloatArray


def envelope(time: FloatArray, values: FloatArray, columns: int) -> tuple[FloatArray, FloatArray]:
    """Return time and values with at most two points a column, in order of time; both (points,), a short curve as it is."""
    count = len(time)
    if count <= 2 * columns or columns < 1:
        return time, values
    size = count // columns
    whole = columns * size
    blocks = values[:whole].reshape(columns, size)
    low, high = np.argmin(blocks, axis=1), np.argmax(blocks, axis=1)
    begin = np.arange(columns) * size
    index = np.sort(np.column_stack([begin + low, begin + high]), axis=1).ravel()
    index = np.append(index, np.arange(whole, count)) if count - whole <= size else index
    return time[index], values[index]
