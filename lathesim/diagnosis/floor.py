"""What a recorded channel cannot resolve: rounding, and the noise that is new in every sample."""

from __future__ import annotations

import math

import numpy as np

from lathesim.engine.assembly import FloatArray

_FOURTH_DIFFERENCE = math.sqrt(70.0)
"""Standard deviation of the fourth difference of white noise of standard deviation one."""


def channel_floor(values: FloatArray, resolution: float = 0.0) -> float:
    """Give one standard deviation of what a channel cannot resolve [its unit].

    The larger of rounding, step / sqrt(12), and the white noise seen in the fourth differences (robust: a median), in which any smooth
    signal vanishes. Without a declared resolution the smallest step of the values is taken for it.
    """
    finite = values[np.isfinite(values)]
    if len(finite) < 10:
        return max(resolution / math.sqrt(12.0), 1e-300)
    step = resolution or smallest_step(finite)
    difference = np.diff(finite, 4)
    noise = 1.4826 * float(np.median(np.abs(difference))) / _FOURTH_DIFFERENCE
    scale = float(np.max(np.abs(finite)))
    return max(step / math.sqrt(12.0), noise, 1e-9 * scale, 1e-300)


def smallest_step(values: FloatArray) -> float:
    """Give the step between levels where a channel has few of them, else 0."""
    levels = np.unique(values)
    if len(levels) < 2 or len(levels) > 0.5 * len(values):
        return 0.0
    return float(np.min(np.diff(levels)))
