"""Plain operations on sampled signals: size, delay, steps."""

from __future__ import annotations

import numpy as np
from scipy.fft import irfft, rfft

from lathesim.engine.assembly import FloatArray


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
