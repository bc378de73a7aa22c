"""Sampled signals: rounding, resolution, size, delay, steps."""

from __future__ import annotations

import math

import numpy as np
from scipy.fft import irfft, rfft
from scipy.interpolate import CubicSpline

from lathesim.engine.assembly import FloatArray

ROUNDING = 1e-12
"""Share of a size that a chain of computations loses to rounding: some thousand times the machine's accuracy, 2.2e-16."""
SLOPE_ROUNDING = 1e-9
"""Share of the largest slope below which another one is rounding: slopes are differences of sizes that differ by a thousandth."""
SETTLING = 0.02
"""Share of a recording at its beginning that is left out of residuals: controllers start with memories that nobody recorded. At its end as
much may follow from what was not recorded."""
LARGER_PART = 0.5
"""Share above which something is the larger part of it."""
BEYOND = 1e100
"""Where a run whose numbers grow beyond all bounds is cut off before it is differenced and squared [SI]."""


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
    return max(step / math.sqrt(12.0), noise, 1e-9 * float(np.max(np.abs(finite))), 1e-40)


def _levels(values: FloatArray) -> FloatArray:
    """Return the different values, those once that differ by how a computer rounds."""
    levels = np.unique(values)
    return levels[np.r_[True, np.diff(levels) > ROUNDING * float(np.max(np.abs(levels)))]] if len(levels) else levels


def smallest_step(values: FloatArray) -> float:
    """Return the step between levels where a channel has few of them, else 0."""
    levels = _levels(values)
    return 0.0 if len(levels) < 2 or len(levels) > 0.5 * len(values) else float(np.min(np.diff(levels)))


def grid_spacing(values: FloatArray) -> float:
    """Return the spacing of a grid on which all values (samples,) lie; 0 where there is none, or too few levels to tell."""
    levels = _levels(values[np.isfinite(values)])
    if len(levels) < FEWEST_LEVELS:
        return 0.0
    gaps = np.diff(levels)
    spacing = float(np.median(gaps[gaps < _SINGLE_GAP * float(np.min(gaps))]))
    for reach in (100.0, np.inf):
        # the last digit makes the first spacing a little wrong, and over many counts that adds up
        near = levels - levels[0] if np.isinf(reach) else (gaps[gaps < reach * spacing])
        counts = np.round(near / spacing)
        spacing = float(near @ counts / (counts @ counts))
    off = np.abs((levels - levels[0]) / spacing - np.round((levels - levels[0]) / spacing))
    return spacing if float(np.max(off)) < OFF_GRID else 0.0


def root_mean_square(values: FloatArray) -> float:
    """Return the root mean square of what is finite; infinite where nothing is."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if len(finite) else float("inf")


_APART = 0.02
"""Share of a recording by which two instants lie apart."""


def behind(signal: FloatArray, other: FloatArray, most: int) -> int:
    """Return the samples, up to ``most`` either way, by which a signal (samples,) is behind another one: where their differences correlate
    best. Source: Knapp, Carter, The generalized correlation method for estimation of time delay, IEEE Trans. ASSP 24 (1976)."""
    first, second = (np.diff(np.nan_to_num(values)) for values in (signal, other))
    most = min(most, len(first) // 4)
    shifts = np.r_[0 : most + 1, -most:0]
    correlated = irfft(rfft(first, 2 * len(first)) * np.conj(rfft(second, 2 * len(first))))[shifts]
    # over what overlaps of both: the first one without its beginning and the second without its end, or the other way round
    powers = [np.r_[0.0, np.cumsum(values**2)] for values in (first, second)]
    ahead, after = np.maximum(shifts, 0), np.maximum(-shifts, 0)
    there = [(power[-1 - other] - power[own]) for power, own, other in zip(powers, (ahead, after), (after, ahead), strict=True)]
    return int(shifts[np.argmax(correlated / np.sqrt(np.maximum(there[0] * there[1], 1e-300)))])


def late(values: FloatArray, samples: int) -> FloatArray:
    """Return values (samples,) so many samples later, the ends held."""
    return values[np.clip(np.arange(len(values)) - samples, 0, len(values) - 1)]


def read_ahead(signal: FloatArray, samples: FloatArray | float) -> FloatArray:
    """Return a signal (samples,) so many samples later, along the cubic spline through what is known of it; at its ends it stays. One that
    grew beyond all bounds is returned as it is."""
    known, number = np.isfinite(signal), np.arange(len(signal), dtype=float)
    if np.any(np.abs(signal[known]) > BEYOND) or np.sum(known) < 2:
        return signal
    return np.where(known, CubicSpline(number[known], signal[known])(np.clip(number + samples, 0.0, number[-1])), np.nan)


def strongest_jumps(signal: FloatArray, period: float) -> list[tuple[float, float]]:
    """Return instant [s] and size of the strongest steps of a signal (samples,): the largest of the likelihood ratio over all instants.

    S(k) = (mean after k - mean before k)^2 k (n - k) / n. Source: Basseville, Nikiforov, Detection of Abrupt Changes, 1993, sec. 2.6.
    """
    samples = len(signal)
    count = np.arange(1, samples, dtype=float)
    total = np.cumsum(signal)
    before = total[:-1] / count
    after = (total[-1] - total[:-1]) / (samples - count)
    ratio = (after - before) ** 2 * count * (samples - count) / samples
    # a slow wander of the whole shows the step best in a short window on both sides
    width = max(2, samples // 100)
    near = np.convolve(signal, np.r_[np.ones(width), -np.ones(width)] / width, mode="same")
    found: list[tuple[float, float]] = []
    for strength, sizes in ((ratio, after - before), (near**2, near)):
        left = strength.copy()
        for _ in range(2):
            place = int(np.argmax(left))
            # between two samples: at one of them, rounding would say on which side it is
            found.append((float((place + 0.5) * period), float(sizes[place])))
            left[max(0, place - int(_APART * samples)) : place + int(_APART * samples) + 1] = 0.0
    return found
