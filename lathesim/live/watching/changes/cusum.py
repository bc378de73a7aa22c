"""Sums that tell a lasting change: Page's CUSUM, both sides, of many statistics at once.

s+ = max(0, s+ + z - k), s- = max(0, s- - z - k); an alarm where one exceeds h. With z standard normal, k = 0.5 and h = 8 a false alarm
comes every 9483 samples on average, and a shift of 1 standard deviation is told after 16.4.

Source: E. S. Page, Continuous inspection schemes, Biometrika 41 (1954).
"""

from __future__ import annotations

import numpy as np

from lathesim.record import FloatArray


class Cusum:
    """Sums for statistics of one ``shape``. ``begun`` holds the time at which each sum left zero: the estimate of when it changed."""

    def __init__(self, shape: tuple[int, ...], k: float | FloatArray, h: FloatArray) -> None:
        self.k, self.h = k, h
        self.sums = np.zeros((2, *shape))
        self.begun = np.full((2, *shape), np.nan)

    def take(self, z: FloatArray, before: float) -> FloatArray:
        """Return how far each sum is above its limit, (2, ...), after the statistics ``z`` of a block that began at ``before`` [s].

        A statistic that is NaN says nothing and leaves its sums.
        """
        known = np.isfinite(z)
        value = np.where(known, z, 0.0)
        new = np.maximum(0.0, self.sums + np.array([value, -value]) - np.where(known, self.k, 0.0))
        self.begun = np.where((self.sums <= 0.0) & (new > 0.0), before, np.where(new > 0.0, self.begun, np.nan))
        self.sums = new
        return np.asarray(new - self.h)

    def reset(self) -> None:
        """Begin anew at zero."""
        self.sums[:] = 0.0
        self.begun[:] = np.nan


def mean_run_length(shift: float, k: float, h: float, points: int = 200) -> float:
    """Return the mean number of samples to an alarm of the one-sided sum at a shift: Page's integral equation by Gauss' rule."""
    from scipy.stats import norm

    nodes, weights = np.polynomial.legendre.leggauss(points)
    y, w = 0.5 * h * (nodes + 1.0), 0.5 * h * weights
    kernel = w * norm.pdf(y[None, :] - y[:, None] + k - shift)
    at_zero = norm.cdf(k - shift - y)
    matrix = np.eye(points + 1)
    matrix[:points, :points] -= kernel
    matrix[:points, points] -= at_zero
    matrix[points, :points] = -w * norm.pdf(y + k - shift)
    matrix[points, points] -= norm.cdf(k - shift)
    return float(np.linalg.solve(matrix, np.ones(points + 1))[points])
