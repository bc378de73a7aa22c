"""What a recorded channel cannot resolve: rounding, and the noise that is new in every sample."""

from __future__ import annotations

import math

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.identification.signal.rounding import ROUNDING

_FEWEST_SAMPLES = 10
"""Samples below which no resolution is read off."""
_SINGLE_GAP = 1.5
"""Times the smallest gap below which a gap is a single step."""
FEWEST_LEVELS = 20
OFF_GRID = 0.02
"""How far, in spacings, a value may lie beside the grid: the recording's last digit."""
_FOURTH_DIFFERENCE = math.sqrt(70.0)
"""Standard deviation of the fourth difference of white noise of standard deviation one."""


def channel_floor(values: FloatArray, resolution: float = 0.0) -> float:
    """Return one standard deviation of what a channel cannot resolve [its unit].

    The larger of rounding, step / sqrt(12), and the white noise seen in the fourth differences (robust: a median), in which any smooth
    signal vanishes. Without a declared resolution the step between the levels of the values is taken for it, or the grid on which all
    of them lie.
    """
    finite = values[np.isfinite(values)]
    # tiny floor: for a channel of zeros the fourth power is still a finite number
    if len(finite) < _FEWEST_SAMPLES:
        return max(resolution / math.sqrt(12.0), 1e-40)
    step = resolution or smallest_step(finite) or grid_spacing(finite)
    difference = np.diff(finite, 4)
    noise = 1.4826 * float(np.median(np.abs(difference))) / _FOURTH_DIFFERENCE
    scale = float(np.max(np.abs(finite)))
    return max(step / math.sqrt(12.0), noise, 1e-9 * scale, 1e-40)


def _levels(values: FloatArray) -> FloatArray:
    """Return the different values, those once that differ by how a computer rounds."""
    levels = np.unique(values)
    return levels[np.r_[True, np.diff(levels) > ROUNDING * float(np.max(np.abs(levels)))]] if len(levels) else levels


def smallest_step(values: FloatArray) -> float:
    """Return the step between levels where a channel has few of them, else 0."""
    levels = _levels(values)
    if len(levels) < 2 or len(levels) > 0.5 * len(values):
        return 0.0
    return float(np.min(np.diff(levels)))


def grid_spacing(values: FloatArray) -> float:
    """Return the spacing of a grid on which all values (samples,) lie; 0 where there is none, or too few levels to tell."""
    finite = values[np.isfinite(values)]
    levels = _levels(finite)
    if len(levels) < FEWEST_LEVELS:
        return 0.0
    gaps = np.diff(levels)
    smallest = float(np.min(gaps))
    spacing = float(np.median(gaps[gaps < _SINGLE_GAP * smallest]))
    for reach in (100.0, np.inf):
        # the last digit makes the first spacing a little wrong, and over many counts that adds up
        near = levels - levels[0] if np.isinf(reach) else (gaps[gaps < reach * spacing])
        counts = np.round(near / spacing)
        spacing = float(near @ counts / (counts @ counts))
    off = np.abs((levels - levels[0]) / spacing - np.round((levels - levels[0]) / spacing))
    return spacing if float(np.max(off)) < OFF_GRID else 0.0
