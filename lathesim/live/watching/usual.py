"""What is usual on a machine, learnt from its first laps: uncertain values, what the model leaves out anyway, and the noise.

Residuals of different channels share much of their noise: a quantised encoder shakes voltage and current alike. They are whitened by the
Cholesky factor of their covariance, so that a channel is judged by what the channels before it leave open. A gain that moves the current
and not the voltage stands out by the small noise of the difference, however much both shake.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.live.watching.residual_stream import BlockSums, Residual, block_sums, directions
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
        count = self.mean.shape[1]
        mixed = whole.mixed - np.einsum("cqg,cg->cq", whole.normal[:, :, :count], self.mean)
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
    size = values.shape[1] // len(residuals)
    sample_times = np.repeat(times, size)
    allowed = np.mean(sensitivities**2, axis=2).max(axis=0, initial=0.0)
    least = np.maximum(ERRORS.least_floor * np.sqrt(allowed), 1e-9 * scale[len(speed) :])
    noise = np.maximum(np.sqrt(np.mean(values**2, axis=1)), least)
    rest = values
    for _ in range(_PASSES):
        theta = _values_in_time(values, sensitivities, sample_times, 1.0 / noise**2, lesson)
        rest = _without_directions(values - np.einsum("pn,pcn->cn", theta, sensitivities), shown)
        noise = np.maximum(np.sqrt(np.mean(rest**2, axis=1)), least)
    covariance = rest @ rest.T / rest.shape[1] + np.diag(least**2)
    whitening = np.linalg.inv(np.linalg.cholesky(covariance))
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
