"""The tests for a change of the residuals and of their noise.

That of the residuals is a generalised likelihood ratio over its time, its channel and its direction, with the uncertain values
free. That of the noise is a CUSUM of its logarithm in each channel.

Block by block r = S theta + d delta + noise. Up to a time tau delta is 0; from then on theta is another within what the lesson allows and
moves steadily at most, and delta is 0 or not. The statistic of a channel and a direction is the largest log-likelihood (times 2) with delta
over all tau, less the largest one without. A step of the load, or a machine that warms up, raises both and leaves their difference; what no
value of theta can do raises the difference alone. Each block counts by the information that it holds about the direction.

Source: A. S. Willsky, H. L. Jones, A generalized likelihood ratio approach to the detection and estimation of jumps in linear systems,
IEEE Trans. Automatic Control 21 (1976); nuisance parameters: M. Basseville, I. Nikiforov, Detection of Abrupt Changes (1993), ch. 7.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lathesim.live.watching.residual_stream import BlockSums, Residual
from lathesim.live.watching.thresholds import CHANGE, ERRORS, NOISE
from lathesim.live.watching.usual import Usual
from lathesim.record import FloatArray

KEPT = 300
"""Blocks that are looked at."""
_HOLD_MORE, _HOLD_MOST = 10.0, 1e9
"""By how much more values that go too far are held at a time, and at most."""


@dataclass(frozen=True)
class FoundChange:
    """What the test says: ``statistic`` of the likeliest ``channel`` and ``direction``, ``begun`` [s], the ``size`` of the change in noise
    deviations of a block, 2 log-likelihood that a step of the uncertain values brings with noise as loud as it is since then (``moved``,
    ``moved_at`` [s]), the values that may move as they are now (``theta``), from the nominal ones, with their standard ``deviations``, and
    the ``power`` of what they do, in that of the noise."""

    statistic: float
    channel: int
    direction: int
    begun: float
    size: float
    moved: float
    moved_at: float
    theta: FloatArray
    deviations: FloatArray
    power: float


@dataclass(frozen=True, eq=False)
class _Windows:
    """Estimates of the windows that begin at each tau: ``gain`` (windows,) 2 log-likelihood of theta, ``full`` (windows, channels,
    directions) what delta adds, ``drop`` the same with the doubt about sensitivities, ``delta``, and ``theta`` (windows, parameters) now,
    with their ``normal`` matrices, and the ``power`` (windows,) of what they do in the channel where that is most.
    """

    gain: FloatArray
    drop: FloatArray
    full: FloatArray
    delta: FloatArray
    theta: FloatArray
    normal: FloatArray
    power: FloatArray


class ChangeTest:
    """Keeps the newest blocks and tests them. ``take`` adds a block, ``test`` judges what is kept."""

    def __init__(self, usual: Usual, size: float, samples: int, nominal: FloatArray, free: NDArray[np.bool_]) -> None:
        self.usual = usual
        self._block_time, self._samples = size, samples
        channels, count = usual.mean.shape
        parameters = len(usual.theta)
        self._weight = 1.0 / usual.variance
        self._count = count
        room = 2 * KEPT
        self._times = np.zeros(room)
        self._a = np.zeros((room, channels, parameters, parameters))
        self._b = np.zeros((room, parameters))
        self._h = np.zeros((room, channels, count, parameters))
        self._m = np.zeros((room, channels, count))
        self._u = np.zeros((room, channels, count))
        self._left = np.zeros((room, channels))
        self._begin, self._end = 0, 0
        centre = np.where(free, 0.0, -nominal)  # the lesson's values, from the nominal ones; of followed sizes these
        self._centre = np.concatenate([centre, np.zeros(parameters)])
        self._bound = ~np.concatenate([free, free])
        self._prior = np.concatenate([np.ones(parameters), np.full(parameters, ERRORS.drift**-2)])
        self._grown = np.zeros(parameters)

    def __len__(self) -> int:
        return self._end - self._begin

    def take(self, block: BlockSums) -> None:
        """Add a block; the oldest goes where there is no room."""
        if self._end == len(self._times):
            for kept in (self._times, self._a, self._b, self._h, self._m, self._u, self._left):
                kept[: len(self)] = kept[self._begin : self._end].copy()
            self._begin, self._end = 0, len(self)
        at, count, weight = self._end, self._count, self._weight
        self._times[at] = block.time
        self._a[at] = weight[:, None, None] * block.normal[:, count:, count:]
        self._b[at] = weight @ block.mixed[:, count:]
        self._h[at] = weight[:, None, None] * block.normal[:, :count, count:]
        self._m[at] = weight[:, None] * np.einsum("cgg->cg", block.normal[:, :count, :count])
        self._u[at] = weight[:, None] * block.mixed[:, :count]
        self._left[at] = weight * block.left[: len(weight)]
        self._end += 1
        self._begin = max(self._begin, self._end - KEPT)

    def forget_before(self, time: float) -> None:
        """Forget the blocks that end at ``time`` or before."""
        while self._begin < self._end and self._times[self._begin] <= time + 0.5 * self._block_time:
            self._begin += 1

    def move(self, by: FloatArray) -> None:
        """Count the uncertain values from others, ``by`` (parameters,) standard deviations off: the simulation now has those."""
        part = slice(self._begin, self._end)
        self._u[part] -= self._h[part] @ by
        self._b[part] -= self._a[part].sum(axis=1) @ by
        bound = self._bound[: len(by)]
        self._centre[: len(by)] -= np.where(bound, by, 0.0)
        self._grown += np.where(bound, 0.0, by)

    def test(self) -> FoundChange | None:
        """Return what is likeliest now; None while there are too few blocks."""
        count = len(self)
        if count < CHANGE.least_blocks:
            return None
        part = slice(self._begin, self._end)
        starts = _starts(count)
        times = self._times[part]
        since = times - times[-1]
        a, b = _moments(self._a[part].sum(axis=1), since), _moments(self._b[part], since)
        after = self._windows(a, b, part, since, starts)
        _, _, before = self._within(*_before(a, b, starts, since - self._block_time))
        level = before + after.gain
        plain = int(np.argmax(level))
        ratio = level[:, None, None] + after.drop - level[plain]
        at, channel, direction = (int(place) for place in np.unravel_index(np.argmax(ratio), ratio.shape))
        statistic = float(ratio[at, channel, direction])
        at = int(np.argmax(level + after.full[:, channel, direction]))
        begun = float(times[starts[at]] - self._block_time)
        if statistic > 0.0:
            statistic *= self._without_the_largest(starts[at], after.theta[at], channel, direction)
            begun = self._since(part, starts, channel, direction, begun)
        size = abs(float(after.delta[at, channel, direction])) * np.sqrt(float(self._m[part][starts[at] :, channel, direction].mean()))
        return FoundChange(
            statistic, channel, direction, begun, float(size), float(level[plain] - level[0]) / self._louder(starts[plain]),
            float(times[starts[plain]] - self._block_time), after.theta[plain], _deviations(after.normal[plain], after.theta.shape[1]),
            float(after.power[plain]),
        )  # fmt: skip

    def _louder(self, start: int) -> float:
        """Return how many times as much noise there is since a block as was learnt, at least 1.

        With noise so much louder a likelihood ratio is so much less: chatter is no step of the values. Noise is what no constant value
        explains within a block, so that a step leaves it at 1; blocks and channels count by what they tell of the values.
        """
        part = slice(self._begin + int(start), self._end)
        told = np.einsum("bcpp->bc", self._a[part])
        return max(1.0, float(np.sum(told * self._left[part]) / max(float(told.sum()), 1e-300)))

    def _windows(self, a: FloatArray, b: FloatArray, part: slice, since: FloatArray, starts: FloatArray) -> _Windows:
        parameters = self._b.shape[1]
        normal, right = _shifted(_tails(a, starts), _tails(b, starts), np.zeros(len(starts)))
        normal, theta, gain = self._within(normal, right)
        h = _moments(self._h[part], since)[:2]
        h = _tails(h, starts)
        h = np.concatenate([h[0], h[1]], axis=3)
        m, u = _tails(self._m[part][None], starts)[0], _tails(self._u[part][None], starts)[0]
        solved = np.linalg.solve(normal[:, None], h.transpose(0, 1, 3, 2)) if parameters else h.transpose(0, 1, 3, 2)
        known = np.maximum(m - np.einsum("tcgp,tcpg->tcg", h, solved), 1e-9 * m + 1e-12)
        effect = np.einsum("tcgp,tp->tcg", h, theta)
        delta = (u - effect) / known
        learnt = self._weight[:, None] * self.usual.information
        left_out = self._weight[:, None] * self.usual.left_out[:, None] / np.maximum(learnt, 1e-12)
        # what is usual was learnt from so much, and varies
        certain = 1.0 + m / np.maximum(learnt, 1e-12) + ERRORS.linear**2 * left_out * known
        own = _tails(self._a[part][None], starts)[0]
        value = theta[:, :parameters]
        count = (self._samples * (len(since) - starts))[:, None]
        power = np.einsum("tp,tcpq,tq->tc", value, own, value, optimize=True) / count
        moved = value + self._grown  # since what is usual was learnt, of followed sizes, with which the simulation has gone on
        # sensitivities hold nearby only
        unsure = 1.0 + ERRORS.linear**2 * np.einsum("tp,tcpq,tq->tc", moved, own, moved, optimize=True) / count
        full = (u - effect) ** 2 / known / certain
        return _Windows(gain, full / unsure[:, :, None], full, delta, value, normal, power.max(axis=1))

    def _within(self, normal: FloatArray, right: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return normal matrices held by what the lesson allows, the estimates (windows, 2 parameters), and their 2 log-likelihoods.

        Where an uncertain value would go further than it may, all of them are held the more: a change that is large enough could else
        be explained by values that no machine has. Followed sizes are free.
        """
        parameters = self._b.shape[1]
        if not parameters:
            return normal, right, np.zeros(len(right))
        hold = np.ones(len(right))
        while True:
            prior = np.where(self._bound, hold[:, None], 1.0) * self._prior
            held = normal + prior[:, :, None] * np.eye(2 * parameters)
            pull = right + prior * self._centre
            found = np.linalg.solve(held, pull[:, :, None])[:, :, 0]
            far = (np.abs(found - self._centre) * self._bound)[:, :parameters].max(axis=1) > ERRORS.furthest
            if not far.any() or hold.max() > _HOLD_MOST:
                break
            hold = np.where(far, _HOLD_MORE * hold, hold)
        return held, found, np.einsum("tp,tp->t", pull, found) - prior @ self._centre**2

    def _without_the_largest(self, start: int, theta: FloatArray, channel: int, direction: int) -> float:
        """Return the share of the statistic that is left without the block that counts most; 1 where it is enough."""
        begin = self._begin + int(start)
        h, m = self._h[begin : self._end, channel, direction], self._m[begin : self._end, channel, direction]
        u = self._u[begin : self._end, channel, direction] - h @ theta
        whole = u.sum() ** 2 / max(m.sum(), 1e-12)
        if len(u) < CHANGE.least_blocks or whole <= 0.0:
            return 0.0
        without = (u.sum() - u) ** 2 / np.maximum(m.sum() - m, 1e-12)
        return 1.0 if without.min() > CHANGE.alone * whole else float(max(0.0, without.min() / whole))

    def _since(self, part: slice, starts: FloatArray, channel: int, direction: int, begun: float) -> float:
        """Return since when there is a change [s]: ``begun`` where it stepped, else where what grows steadily began."""
        times = self._times[part]
        since = times - times[-1]
        theta = np.linalg.solve(
            _pair(_moments(self._a[part].sum(axis=1), since).sum(axis=1)) + np.diag(self._prior),
            _moments(self._b[part], since)[:2].sum(axis=1).ravel() + self._prior * self._centre,
        )
        h = self._h[part][:, channel, direction]
        half = h.shape[1]
        u = self._u[part][:, channel, direction] - h @ theta[:half] - since * (h @ theta[half:])
        m = self._m[part][:, channel, direction]
        best, at = 0.0, 0
        for place in starts:
            rise = np.maximum(0.0, since - since[place] + self._block_time)
            told = float(np.sum(rise * u)) ** 2 / max(float(np.sum(rise**2 * m)), 1e-12)
            if told > best:
                best, at = told, int(place)
        plain = [float(u[place:].sum()) ** 2 / max(float(m[place:].sum()), 1e-12) for place in starts]
        return begun if best < max(plain) + CHANGE.longer else float(times[at] - self._block_time)


def _deviations(normal: FloatArray, parameters: int) -> FloatArray:
    """Return the standard deviations of the values now, (parameters,)."""
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(normal))[:parameters])) if parameters else np.zeros(0)


def _starts(count: int) -> FloatArray:
    """Return where windows begin: at each of the newest blocks, at fewer of the older ones."""
    newest = np.arange(max(0, count - 40), count)
    return np.unique(np.concatenate([[0], np.arange(max(0, count - 40) % 5, max(0, count - 40), 5), newest]))


def _moments(sums: FloatArray, since: FloatArray) -> FloatArray:
    """Return sums with time to the powers 0, 1 and 2, (3, blocks, ...)."""
    power = np.array([since**0, since, since**2])
    return np.asarray(power.reshape(power.shape + (1,) * (sums.ndim - 1)) * sums[None])


def _tails(moments: FloatArray, starts: FloatArray) -> FloatArray:
    """Return the sums from each start to the end, (moments, starts, ...)."""
    return np.asarray(np.cumsum(moments[:, ::-1], axis=1)[:, ::-1][:, starts])


def _before(a: FloatArray, b: FloatArray, starts: FloatArray, since: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return normal matrices and right sides of what lies before each start, with time counted from there."""
    whole_a, whole_b = a.sum(axis=1, keepdims=True), b.sum(axis=1, keepdims=True)
    return _shifted(whole_a - _tails(a, starts), whole_b - _tails(b, starts), since[starts])


def _shifted(a: FloatArray, b: FloatArray, shift: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return normal matrix and right side of (theta, its slope) with time counted from ``shift``."""
    by = shift[:, None, None]
    first = a[1] - by * a[0]
    second = a[2] - 2.0 * by * a[1] + by**2 * a[0]
    normal = np.concatenate([np.concatenate([a[0], first], axis=2), np.concatenate([first, second], axis=2)], axis=1)
    return normal, np.concatenate([b[0], b[1] - shift[:, None] * b[0]], axis=1)


def _pair(a: FloatArray) -> FloatArray:
    return np.block([[a[0], a[1]], [a[1], a[2]]])


class Cusum:
    """Page's CUSUM, both sides, of statistics of one ``shape``: sums that tell a lasting change.

    s+ = max(0, s+ + z - k), s- = max(0, s- - z - k); an alarm where one exceeds h. With z standard normal, k = 0.5 and h = 8 a false alarm
    comes every 9483 samples on average, and a shift of 1 standard deviation is told after 16.4. ``begun`` holds the time at which each sum
    left zero: the estimate of when it changed. Source: E. S. Page, Continuous inspection schemes, Biometrika 41 (1954).
    """

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

    ``others`` (2 uncertain values, blocks, channels) is the noise that :func:`others_noise` returns of the same blocks. Two things are no
    change. Where one block depends on the last, sums wander further: a sum with the reference value k and scores of the long-run variance v
    leaves h as seldom as one of independent scores leaves h / v (a Brownian motion with the drift -k passes h with the probability
    exp(-2 k h / v)). And the simulation is quantised too: with other values within what the lesson calls uncertain, as after a warm-up, its
    steps coincide with those of the machine now more, now less. How much is known: machines with each value a standard deviation off run
    beside it. Half of the smallest shift worth telling is counted beyond that. Source: D. Siegmund, Sequential Analysis (1985), ch. 3.
    """

    def __init__(self, learnt: FloatArray, others: FloatArray, block_time: float) -> None:
        self._block_time = block_time
        self._least = np.where(np.arange(learnt.shape[1]) < learnt.shape[1] // 2, NOISE.least_left, 1.0)
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
        self._kept: deque[tuple[float, FloatArray]] = deque(maxlen=KEPT)

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
        best = int(np.argmax(np.cumsum(scores[::-1])[::-1] ** 2 / np.arange(len(scores), 0, -1))) if len(scores) else 0
        if since and time - begun <= CHANGE.slow:
            begun = since[best][0] - self._block_time
        return channel, begun, float(abs(scores.mean())) if len(scores) else NOISE.shift


def _long_run_variance(scores: FloatArray) -> FloatArray:
    """Return n times the variance of a mean of n scores of each channel, (channels,): first-order dependence."""
    rest = scores - scores.mean(axis=0)
    square = np.maximum(np.sum(rest**2, axis=0), 1e-300)
    correlation = np.clip(np.sum(rest[1:] * rest[:-1], axis=0) / square, 0.0, 0.95)
    return np.asarray(square / len(scores) * (1.0 + correlation) / (1.0 - correlation))
