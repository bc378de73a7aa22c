"""What is kept of a block of residuals: sums from which every estimate follows, for any values of the uncertain parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.live.watching.residuals.residual_stream import Residual
from lathesim.record import FloatArray

_RIDGE = 1e-9
"""Share of its own sum by which a regressor is held, so that one that is not seen in a block does no harm."""


LIKE = 0.01
"""Seconds whose samples are averaged: the noise of quantised sensors is quick, and what a changed machine does is slow."""


@dataclass(frozen=True, eq=False)
class BlockSums:
    """Sums over a block that ends at ``time`` [s], for q regressors (directions, then sensitivities) and whitened residuals r.

    ``normal`` (channels, q, q) and ``mixed`` (channels, q) are those of least squares; ``left`` (2 channels,) is the mean square of the
    averaged r that no combination of the regressors explains within the block, and of what averaging took away.
    """

    time: float
    normal: FloatArray
    mixed: FloatArray
    left: FloatArray


def averaged(residual: Residual, samples: int) -> tuple[Residual, FloatArray]:
    """Return means of so many ``samples``, and the mean square of each channel about straight lines through as many, (channels,)."""
    if samples <= 2:
        return residual, np.zeros(len(residual.values))
    values, quick = _averaged(residual.values, samples)
    sensitivities, others = _means(residual.sensitivities, samples), residual.others[:0]
    return Residual(values, sensitivities, _means(residual.speed, samples), _means(residual.simulated, samples), others), quick


def averaged_others(residual: Residual, samples: int) -> list[tuple[FloatArray, FloatArray]]:
    """Return the same of the residuals of the other machines: means (channels, samples) and mean squares (channels,) of each."""
    if samples <= 2:
        return [(values, np.zeros(len(values))) for values in residual.others]
    return [_averaged(values, samples) for values in residual.others]


def _averaged(residual: FloatArray, samples: int) -> tuple[FloatArray, FloatArray]:
    values = _means(residual, samples)
    pieces = residual[:, : values.shape[1] * samples].reshape(-1, values.shape[1], samples)
    ramp = np.arange(samples) - 0.5 * (samples - 1)
    slope = pieces @ ramp / (ramp @ ramp)
    return values, np.asarray(np.mean((pieces - values[:, :, None] - slope[:, :, None] * ramp) ** 2, axis=(1, 2)))


def _means(values: FloatArray, samples: int) -> FloatArray:
    count = values.shape[-1] // samples
    return np.asarray(values[..., : count * samples].reshape(*values.shape[:-1], count, samples).mean(axis=-1))


def block_sums(values: FloatArray, regressors: FloatArray, quick: FloatArray, time: float) -> BlockSums:
    """Return the sums of a block: ``values`` (channels, samples), ``regressors`` (channels, q, samples), ``quick`` (channels,)."""
    normal = regressors @ regressors.transpose(0, 2, 1)
    mixed = np.einsum("cqn,cn->cq", regressors, values)
    held = normal + np.eye(normal.shape[1]) * (_RIDGE * np.einsum("cqq->cq", normal)[:, :, None] + 1e-12)
    explained = np.einsum("cq,cq->c", mixed, np.linalg.solve(held, mixed[:, :, None])[:, :, 0])
    left = np.maximum(np.sum(values * values, axis=1) - explained, 0.0) / values.shape[1]
    return BlockSums(time, normal, mixed, np.concatenate([left, quick]))
