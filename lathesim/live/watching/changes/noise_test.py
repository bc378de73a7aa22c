"""The test for a change of the noise: a CUSUM of its logarithm in each channel, against what was learnt from the first blocks.

Two things are no change. Where one block depends on the last, sums wander further: a sum with the reference value k and scores of the
long-run variance v leaves h as seldom as one of independent scores leaves h / v (a Brownian motion with the drift -k passes h with the
probability exp(-2 k h / v)). And the simulation is quantised too: with other values within what the lesson calls uncertain, as after a
warm-up, its steps coincide with those of the machine now more, now less. How much is known: machines with each value a standard deviation
off run beside it. Half of the smallest shift worth telling is counted beyond that.

Source: E. S. Page, Continuous inspection schemes, Biometrika 41 (1954); D. Siegmund, Sequential Analysis (1985), ch. 3.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from lathesim.live.watching.changes.cusum import Cusum
from lathesim.live.watching.residuals.residual_stream import Residual
from lathesim.live.watching.residuals.usual import Usual
from lathesim.live.watching.thresholds import CHANGE, NOISE
from lathesim.record import FloatArray


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
