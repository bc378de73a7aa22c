"""What is kept of a block of residuals: sums from which every statistic follows, for any values of the uncertain parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.live.watching.residual_stream import Residual
from lathesim.record import FloatArray

STATES = ("moving backwards", "standing", "moving forwards")
"""What the first driven axis does: a change that depends on it is another than one that does not."""
_LEAST = 0.1
"""Share of a block that must be in a state for its mean to count."""


@dataclass(frozen=True, eq=False)
class BlockSums:
    """Sums over a block: ``time`` [s] of its end; ``count`` (states,), ``first`` (channels, states) of r, ``slope`` (channels, states,
    parameters) of its sensitivities; ``square`` (channels,) of r^2, ``mixed`` (channels, parameters), ``normal`` (channels, p, p)."""

    time: float
    count: FloatArray
    first: FloatArray
    slope: FloatArray
    square: FloatArray
    mixed: FloatArray
    normal: FloatArray


def block_sums(residual: Residual, time: float, still: float) -> BlockSums:
    """Return the sums of a block; slower than ``still`` [per sample] the axis stands."""
    state = np.where(residual.speed > still, 2, np.where(residual.speed < -still, 0, 1))
    member = np.array([state == number for number in range(len(STATES))], dtype=np.float64)
    r, s = residual.values, residual.sensitivities
    return BlockSums(
        time,
        member.sum(axis=1),
        r @ member.T,
        np.einsum("pcn,dn->cdp", s, member),
        np.sum(r * r, axis=1),
        np.einsum("pcn,cn->cp", s, r),
        np.einsum("pcn,qcn->cpq", s, s),
    )


def fitted(blocks: Sequence[BlockSums], weight: FloatArray, prior: float = 1.0) -> FloatArray:
    """Return the values of the uncertain parameters, in standard deviations from the lesson's: least squares held by the lesson.

    ``weight`` (channels,) is one over the variance of a channel's residual, per sample that tells something of its own.
    """
    count = blocks[0].mixed.shape[1]
    normal = prior * np.eye(count)
    right = np.zeros(count)
    for block in blocks:
        normal += np.einsum("c,cpq->pq", weight, block.normal)
        right += weight @ block.mixed
    return np.asarray(np.linalg.solve(normal, right))


def features(block: BlockSums, theta: FloatArray, noise: FloatArray) -> FloatArray:
    """Return the statistics of a block, (channels, states + 1): the mean residual in each state (NaN where it hardly was there), and the
    logarithm of the mean square with the floor ``noise`` (channels,) added."""
    with np.errstate(invalid="ignore", divide="ignore"):
        means = (block.first - block.slope @ theta) / block.count
    means[:, block.count < _LEAST * block.count.sum()] = np.nan
    square = block.square - 2.0 * block.mixed @ theta + np.einsum("cpq,p,q->c", block.normal, theta, theta)
    level = np.log(np.maximum(np.maximum(square, 0.0) / block.count.sum() + noise**2, 1e-300))
    return np.column_stack([means, level])
