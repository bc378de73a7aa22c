"""What is usual on a machine, learnt from its first laps: uncertain values, what the model leaves out anyway, and the noise.

Residuals of different channels share much of their noise: a quantised encoder shakes voltage and current alike. They are whitened by the
Cholesky factor of their covariance, so that a channel is judged by what the channels before it leave open. A gain that moves the current
and not the voltage stands out by the small noise of the difference, however much both shake.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lathesim.live.watching.residual_stream import FREE, BlockSums, Residual, block_sums, directions
from lathesim.live.watching.thresholds import ERRORS
from lathesim.record import FloatArray

_PASSES = 3
_HELD = 1e-6
"""Share of its own information by which the mean of a direction is held at zero."""


@dataclass(frozen=True, eq=False)
class Usual:
    """What was learnt.

    ``still`` and ``scale`` belong to :func:`directions`; ``whitening`` (channels, channels) to the residuals; ``mean`` (channels,
    directions) is what the model leaves out anyway; ``variance`` (channels,) that of a whitened sample that tells something of its own;
    ``information`` (channels, directions) what the learning told; ``left_out`` (channels,) the sum of squares of what the mean does there;
    ``least`` (channels,) [SI] the own error of the model; ``theta`` the uncertain values.
    """

    still: FloatArray
    scale: FloatArray
    whitening: FloatArray
    mean: FloatArray
    variance: FloatArray
    information: FloatArray
    left_out: FloatArray
    least: FloatArray
    theta: FloatArray

    def sums(self, residual: Residual, quick: FloatArray, time: float) -> BlockSums:
        """Return the sums of a block of averaged residuals, what is usual taken off."""
        whole = self._sums(residual, quick, time)
        mixed = whole.mixed - np.einsum("cqg,cg->cq", whole.normal[:, :, : self.mean.shape[1]], self.mean)
        return BlockSums(time, whole.normal, mixed, whole.left)

    def _sums(self, residual: Residual, quick: FloatArray, time: float) -> BlockSums:
        shown = directions(residual, self.still, self.scale)
        values = self.whitening @ residual.values
        sensitivities = (self.whitening @ residual.sensitivities).transpose(1, 0, 2)
        return block_sums(values, np.concatenate([shown, sensitivities], axis=1), quick / self.least**2, time)


def learn(
    residuals: Sequence[Residual], quick: Sequence[FloatArray], times: FloatArray, lesson: FloatArray
) -> tuple[Usual, list[BlockSums]]:
    """Return what is usual in blocks of averaged residuals that end at ``times`` [s], and their sums with it taken off.

    ``lesson`` (parameters,) are the lesson's values from those that were simulated [standard deviations]: there the prior has its middle.
    """
    values = np.concatenate([item.values for item in residuals], axis=1)
    sensitivities = np.concatenate([item.sensitivities for item in residuals], axis=2)
    speed = np.concatenate([item.speed for item in residuals], axis=1)
    simulated = np.concatenate([item.simulated for item in residuals], axis=1)
    largest = np.maximum(np.abs(speed).max(axis=1), 1e-300)
    scale = np.concatenate([largest, np.maximum(np.sqrt(np.mean(simulated**2, axis=1)), 1e-300)])
    still = 1e-3 * largest
    shown = directions(Residual(values, sensitivities, speed, simulated, values[None, :0]), still, scale)
    sample_times = np.repeat(times, values.shape[1] // len(residuals))
    allowed = np.mean(sensitivities**2, axis=2).max(axis=0, initial=0.0)
    least = np.maximum(ERRORS.least_floor * np.sqrt(allowed), 1e-9 * scale[len(speed) :])
    noise = np.maximum(np.sqrt(np.mean(values**2, axis=1)), least)
    rest = values
    for _ in range(_PASSES):
        theta = _values_in_time(values, sensitivities, sample_times, 1.0 / noise**2, lesson)
        rest = _without_directions(values - np.einsum("pn,pcn->cn", theta, sensitivities), shown)
        noise = np.maximum(np.sqrt(np.mean(rest**2, axis=1)), least)
    whitening = np.linalg.inv(np.linalg.cholesky(rest @ rest.T / rest.shape[1] + np.diag(least**2)))
    channels, count = len(values), shown.shape[1]
    none = Usual(
        still, scale, whitening, np.zeros((channels, count)), np.ones(channels), np.zeros((channels, count)),
        np.zeros(channels), least, np.zeros(len(sensitivities)),
    )  # fmt: skip
    blocks = [none.sums(item, fast, float(time)) for item, fast, time in zip(residuals, quick, times, strict=True)]
    return _from_blocks(none, blocks, lesson)


def _values_in_time(values: FloatArray, sensitivities: FloatArray, times: FloatArray, weight: FloatArray, lesson: FloatArray) -> FloatArray:
    """Return uncertain values that move steadily, (parameters, samples): least squares, held by the lesson."""
    count, samples = len(sensitivities), values.shape[1]
    if not count:
        return np.zeros((0, samples))
    since = (times - times[-1]) / max(times[-1] - times[0], 1e-9)
    moving = np.concatenate([sensitivities, sensitivities * since])
    normal = np.einsum("c,pcn,qcn->pq", weight, moving, moving, optimize=True) + np.eye(2 * count)
    right = np.einsum("c,pcn,cn->p", weight, moving, values, optimize=True)
    found = np.linalg.solve(normal, right + np.concatenate([lesson, 0.0 * lesson]))
    return np.asarray(found[:count, None] + found[count:, None] * since)


def _without_directions(values: FloatArray, shown: FloatArray) -> FloatArray:
    rest = np.empty_like(values)
    for row, (value, regressors) in enumerate(zip(values, shown, strict=True)):
        fit, *_ = np.linalg.lstsq(regressors.T, value, rcond=1e-6)
        rest[row] = value - fit @ regressors
    return rest


def _from_blocks(none: Usual, blocks: list[BlockSums], lesson: FloatArray) -> tuple[Usual, list[BlockSums]]:
    """Return what is usual, with the means of the directions and the variance of what blocks tell, and the blocks without it."""
    channels, count = none.mean.shape
    normal, mixed = np.array([block.normal for block in blocks]), np.array([block.mixed for block in blocks])
    times = np.array([block.time for block in blocks])
    since = (times - times[-1]) / max(times[-1] - times[0], 1e-9)
    seen = np.einsum("bcgg->bcg", normal[:, :, :count, :count])
    told = seen > ERRORS.seen * seen.mean(axis=0)
    often = np.maximum(1, told.sum(axis=0))
    variance, mean, theta = np.ones(channels), none.mean, none.theta
    for _ in range(_PASSES):
        theta, mean = _values_and_means(normal, mixed, since, 1.0 / variance, lesson)
        explained = np.einsum("bcqp,bp->bcq", normal[:, :, :count, count:], theta)
        score = mixed[:, :, :count] - explained - np.einsum("bcgh,ch->bcg", normal[:, :, :count, :count], mean)
        square = np.where(told, score**2 / np.where(told, seen, 1.0), 0.0).sum(axis=0) / often
        variance = np.maximum(1.0, (square * (1.0 + 2.0 / np.sqrt(often))).max(axis=1))
    left_out = np.einsum("cg,cgh,ch->c", mean, normal[:, :, :count, :count].sum(axis=0), mean)
    usual = Usual(none.still, none.scale, none.whitening, mean, variance, seen.sum(axis=0), left_out, none.least, theta[-1])
    own = mixed - np.einsum("bcqg,cg->bcq", normal[:, :, :, :count], mean)
    return usual, [BlockSums(block.time, block.normal, row, block.left) for block, row in zip(blocks, own, strict=True)]


def _values_and_means(
    normal: FloatArray, mixed: FloatArray, since: FloatArray, weight: FloatArray, lesson: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return uncertain values of each block (blocks, parameters), which move steadily, and means of the directions, together."""
    channels, parameters = normal.shape[1], len(lesson)
    count = normal.shape[2] - parameters
    total = 2 * parameters + channels * count
    whole, right = np.zeros((total, total)), np.zeros(total)
    power = [np.ones_like(since), since]
    for first in range(2 * parameters and 2):
        at = slice(first * parameters, (first + 1) * parameters)
        right[at] = np.einsum("c,b,bcp->p", weight, power[first], mixed[:, :, count:])
        for second in range(2):
            other = slice(second * parameters, (second + 1) * parameters)
            whole[at, other] = np.einsum("c,b,bcpq->pq", weight, power[first] * power[second], normal[:, :, count:, count:])
        for channel in range(channels):
            other = slice(2 * parameters + channel * count, 2 * parameters + (channel + 1) * count)
            whole[at, other] = weight[channel] * np.einsum("b,bpg->pg", power[first], normal[:, channel, count:, :count])
            whole[other, at] = whole[at, other].T
    for channel in range(channels):
        at = slice(2 * parameters + channel * count, 2 * parameters + (channel + 1) * count)
        own = weight[channel] * normal[:, channel, :count, :count].sum(axis=0)
        whole[at, at] = own + np.diag(_HELD * np.diag(own) + 1e-9)
        right[at] = weight[channel] * mixed[:, channel, :count].sum(axis=0)
    whole[: 2 * parameters, : 2 * parameters] += np.eye(2 * parameters)
    right[:parameters] += lesson
    found = np.linalg.solve(whole, right)
    theta = found[:parameters] + since[:, None] * found[parameters : 2 * parameters]
    return theta, found[2 * parameters :].reshape(channels, count)


SEGMENT = 20.0
"""Seconds of a segment: about a lap, over which what differs comes and goes."""

_HOLD_MORE, _HOLD_MOST = 2.0, 1e9
"""By how much more values that move too far are held at a time, and at most."""


@dataclass(frozen=True, eq=False)
class CoursePoint:
    """Estimates of a segment around ``time`` [s]: ``values`` (parameters,) [scales from the lesson's], their standard ``deviations``, and
    the ``excess`` (channels,) [SI]: root mean square of what the followed sizes do to each channel; NaN where that is not simulated."""

    time: float
    values: FloatArray
    deviations: FloatArray
    excess: FloatArray


class ValueCourse:
    """Adds up blocks and returns a :class:`CoursePoint` for each whole segment. ``usual`` is what the machine showed before it changed.

    A segment is solved once for all values that may move (least squares, held by what the lesson calls uncertain; followed sizes are free).
    A warm-up moves the uncertain values, and leaves the size of an effect alone as far as the segment tells them apart.

    ``centre`` (parameters,) are the uncertain values then; ``new`` (parameters,) [scales] is how large a followed effect is, with the
    lesson's size, that the machine did not have then.
    """

    def __init__(self, usual: Usual, free: NDArray[np.bool_], centre: FloatArray, new: FloatArray, block_time: float) -> None:
        self.usual, self._free, self._new, self._block_time = usual, free, new, block_time
        self._centre = np.where(free, 0.0, centre)
        self._weight = 1.0 / usual.variance
        self._prior = np.where(free, FREE, 1.0)
        self._begin()

    def _begin(self) -> None:
        parameters, channels, self._samples = len(self._free), len(self.usual.mean), 0
        self._times: list[float] = []
        self._normals: list[FloatArray] = []
        self._rights: list[FloatArray] = []
        self._square = np.zeros(channels)
        self._mixed, self._quadratic = np.zeros((parameters, channels)), np.zeros((parameters, parameters, channels))

    def take(
        self, residual: Residual, quick: FloatArray, nominal: FloatArray, difference: FloatArray | None, time: float
    ) -> CoursePoint | None:
        """Return the point of a segment with the block that ends at ``time`` [s] and completes it; None before.

        ``residual`` holds averaged samples around the ``nominal`` values; ``difference`` (channels, samples) is what the machine with the
        followed sizes does more than without them.
        """
        count = self.usual.mean.shape[1]
        block = self.usual.sums(residual, quick, time)
        normal = np.einsum("c,cpq->pq", self._weight, block.normal[:, count:, count:])
        self._normals.append(normal)
        self._rights.append(self._weight @ block.mixed[:, count:] + normal @ nominal)
        sensitivities = np.where(self._free[:, None, None], residual.sensitivities, 0.0)
        plain = np.full_like(residual.values, np.nan) if difference is None else difference
        plain = plain - np.einsum("p,pcn->cn", nominal, sensitivities)
        self._square += np.mean(plain**2, axis=1)
        self._mixed += np.mean(plain * sensitivities, axis=2)
        self._quadratic += np.einsum("pcn,qcn->pqc", sensitivities, sensitivities) / plain.shape[1]
        self._samples += plain.shape[1]
        self._times.append(time - 0.5 * self._block_time)
        return self._point() if len(self._times) * self._block_time >= SEGMENT - 0.5 * self._block_time else None

    def _point(self) -> CoursePoint:
        values, deviations = self._solved(np.array(self._normals), np.array(self._rights))
        square = self._square + 2.0 * values @ self._mixed + np.einsum("p,q,pqc->c", values, values, self._quadratic)
        excess = np.sqrt(np.maximum(0.0, square / len(self._times)))
        point = CoursePoint(float(np.mean(self._times)), values, deviations, excess)
        self._begin()
        return point

    def _solved(self, normals: FloatArray, rights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the values and their standard deviations from the blocks' normal matrices and right sides.

        The noise counts for more, and the values of the first laps hold the better, where blocks contradict one another (by the ratio of
        the scores' own covariance to the information: the trace of White's sandwich), and where followed sizes have changed: what they do
        is known to a tenth only. Beside followed sizes the uncertain values are held until they have moved by no more than the lesson calls
        usual, root mean square: sensitivities of quantised sensors are noise in part, which else takes from a size what it gives to them.
        """
        whole, right = normals.sum(axis=0), rights.sum(axis=0)
        plain = np.linalg.solve(whole + np.diag(self._prior), right + self._prior * self._centre)
        score = rights - normals @ plain
        ratio = float(np.trace(np.linalg.solve(whole + np.diag(self._prior), score.T @ score))) / max(1, len(plain))
        changed = np.where(self._free, plain + self._new, 0.0)
        noise = max(1.0, ratio, 1.0 + ERRORS.linear**2 * float(changed @ whole @ changed) / self._samples)
        hold = 1.0
        while True:
            prior = np.where(self._free, 1.0, hold) * self._prior
            held = whole / noise + np.diag(prior)
            values = np.linalg.solve(held, right / noise + prior * self._centre)
            moved = (values - self._centre)[~self._free]
            if not self._free.any() or not len(moved) or np.mean(moved**2) <= 1.0 or hold > _HOLD_MOST:
                return values, np.sqrt(np.diag(np.linalg.inv(held)))
            hold *= _HOLD_MORE


@dataclass(frozen=True, eq=False)
class Expected:
    """Values [scales from the lesson's] and their standard ``deviations``, both (parameters,)."""

    values: FloatArray
    deviations: FloatArray


def expected_values(times: FloatArray, values: FloatArray, at: float) -> Expected:
    """Return the values expected at a time ``at`` [s] from those noted at ``times`` (notes,) [s] before; ``values`` (notes, parameters).

    What is uncertain about a value of the machine is mostly how large it is, and not whether it stays. Its increments add up as those of a
    random walk, and their mean may go on or end.

    With n increments d over a segment, of the mean u and the variance v, that of one is s^2 = (p^2 + n v) / (n + 1): the drift p that is
    allowed to any value counts as one increment, one that was not seen yet. After m segments the variance is m s^2 + m^2 (u^2 + v / n), and
    s^2 / 2 for the error of the last note; without any increment p^2 stands for v / n. No value is less sure than the lesson's.
    """
    last = len(times) - 1
    rows = [int(np.searchsorted(times, times[last] - number * SEGMENT)) for number in range(int((times[last] - times[0]) / SEGMENT) + 1)]
    steps = np.diff(values[rows[::-1]], axis=0)
    count = len(steps)
    mean = steps.mean(axis=0) if count else np.zeros(values.shape[1])
    allowed = (ERRORS.drift * SEGMENT) ** 2
    spread = np.mean((steps - mean) ** 2, axis=0) if count else np.zeros(values.shape[1])
    one = (allowed + count * spread) / (count + 1)
    many = max(0.0, at - float(times[last])) / SEGMENT
    variance = (0.5 + many) * one + many**2 * (mean**2 + (spread / count if count else allowed))
    return Expected(values[last], np.minimum(1.0, np.sqrt(variance)))
