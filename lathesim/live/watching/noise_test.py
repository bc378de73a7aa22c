"""The test for a change of the noise: a CUSUM of its logarithm in each channel, against what was learnt from the first blocks.

Two things are no change. Where one block depends on the last, sums wander further: a sum with the reference value k and scores of the
long-run variance v leaves h as seldom as one of independent scores leaves h / v (a Brownian motion with the drift -k passes h with the
probability exp(-2 k h / v)). And the simulation is quantised too: with other values within what the lesson calls uncertain, as after a
warm-up, its steps coincide with those of the machine now more, now less. How much is known: machines with each value a standard deviation
off run beside it. Half of the smallest shift worth telling is counted beyond that.

Source: E. S. Page, Continuous inspection schemes, Biometrika 41 (1954); D. Siegmund, Sequential Analysis (1985), ch. 3.

Sums that tell a lasting change: Page's CUSUM, both sides, of many statistics at once.

s+ = max(0, s+ + z - k), s- = max(0, s- - z - k); an alarm where one exceeds h. With z standard normal, k = 0.5 and h = 8 a false alarm
comes every 9483 samples on average, and a shift of 1 standard deviation is told after 16.4.

Source: E. S. Page, Continuous inspection schemes, Biometrika 41 (1954).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from lathesim.live.watching.residual_stream import Residual
from lathesim.live.watching.thresholds import CHANGE, NOISE
from lathesim.live.watching.usual import Usual
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


def others_noise(usual: Usual, residuals: Sequence[Residual], others: Sequence[Sequence[tuple[FloatArray, FloatArray]]]) -> FloatArray:
    """Return the noise that the ``others`` leave in each learnt block, (2 uncertain values, blocks, 2 channels), as in a block's sums."""
    found = [
        [
            usual.sums(Residual(values, item.sensitivities, item.speed, item.simulated, item.others), quick, 0.0).left
            for values, quick in machines
        ]
        for item, machines in zip(residuals, others, strict=True)
    ]
    return np.asarray(np.array(found).reshape(len(found), -1, 2 * len(usual.mean)).transpose(1, 0, 2))


class NoiseTest:
    """CUSUM of the logarithm of the noise in each channel, against what was ``learnt`` from the first blocks (blocks, channels).

    ``others`` (2 uncertain values, blocks, channels) is the noise that :func:`others_noise` returns of the same blocks.
    """

    def __init__(self, learnt: FloatArray, others: FloatArray, block_time: float) -> None:
        self._block_time = block_time
        slow = np.arange(learnt.shape[1]) < learnt.shape[1] // 2
        self._least = np.where(slow, NOISE.least_left, 1.0)
        scores = np.log(learnt + self._least)
        self._mean = scores.mean(axis=0)
        self._deviation = np.maximum(scores.std(axis=0), NOISE.least_deviation) * (1.0 + 2.0 / np.sqrt(len(learnt)))
        shifts = (np.log(others + self._least) - scores).mean(axis=1)
        with_values = np.sqrt(0.5 * np.sum(shifts**2, axis=0)) / self._deviation  # above and below are two cases of one value
        k = NOISE.shift + with_values
        standard = (scores - self._mean) / self._deviation
        trial = Cusum(self._mean.shape, NOISE.shift, np.full(self._mean.shape, np.inf))
        largest = np.zeros(self._mean.shape)
        for row in scores:
            trial.take(self._score(row), 0.0)
            largest = np.maximum(largest, trial.sums.max(axis=0))
        least = NOISE.least * np.maximum(1.0, _long_run_variance(standard))
        self._cusum = Cusum(self._mean.shape, k, np.maximum(least, CHANGE.over_learnt * largest))
        self._kept: deque[tuple[float, FloatArray]] = deque(maxlen=300)

    def _score(self, logarithm: FloatArray) -> FloatArray:
        return np.asarray(np.clip((logarithm - self._mean) / self._deviation, -NOISE.largest, NOISE.largest))

    def take(self, left: FloatArray, time: float) -> tuple[int, float, float] | None:
        """Return channel, beginning [s] and size where the noise has changed."""
        score = self._score(np.log(left + self._least))
        self._kept.append((time, score))
        above = self._cusum.take(score, time - self._block_time)
        if not (above > 0.0).any():
            return None
        side, channel = (int(place) for place in np.unravel_index(np.argmax(above), above.shape))
        begun = float(self._cusum.begun[side, channel])
        known = [(when, float(row[channel])) for when, row in self._kept if np.isfinite(row[channel])]
        since = [(when, value) for when, value in known if when > begun + 0.5 * self._block_time]
        scores = np.array([value for _, value in since])
        sums = np.cumsum(scores[::-1])[::-1]
        best = int(np.argmax(sums**2 / np.arange(len(scores), 0, -1))) if len(scores) else 0
        if since and time - begun <= CHANGE.slow:
            begun = since[best][0] - self._block_time
        return channel, begun, float(abs(scores.mean())) if len(scores) else NOISE.shift


def _long_run_variance(scores: FloatArray) -> FloatArray:
    """Return n times the variance of a mean of n scores of each channel, (channels,): first-order dependence."""
    rest = scores - scores.mean(axis=0)
    square = np.maximum(np.sum(rest**2, axis=0), 1e-300)
    correlation = np.clip(np.sum(rest[1:] * rest[:-1], axis=0) / square, 0.0, 0.95)
    return np.asarray(square / len(scores) * (1.0 + correlation) / (1.0 - correlation))
