"""The one measure: how much better an explanation predicts a recording than another one does.

The recording is cut into blocks. In each block b the error e of an explanation is white, after a filter that both explanations share, with
a level of its own that nobody knows. With the level integrated out (Jeffreys prior), the log predictive density of the block is, up to a
constant that both share,

    log p(b) = -n_b/2 log(sum over the block of e^2)

with n_b the number of independent samples. The gain of one explanation over another is the sum of the differences over blocks, in nats.
A block in which something happened that neither explains counts little, as its level is high.

With d what one explanation adds to the prediction, the other one leaves e + d, and its power is sum(e^2) + sum(d^2) + 2 sum(e d). Only the
last term is chance; what it adds to the gain of a block,

    c(b) = n_b/2 log(sum (e + d)^2 / (sum e^2 + sum d^2)),        error^2 = sum over blocks of c(b)^2

is about n_b sum(e d) / sum(e^2). That gains differ from block to block, as where something acts only when a tool enters the cut, makes no
gain less sure.

Sources: A. Vehtari, A. Gelman, J. Gabry, Practical Bayesian model evaluation, Statistics and Computing 27 (2017), section 2.2 (sums of
pointwise differences); H. White, Maximum likelihood estimation of misspecified models, Econometrica 50 (1982) (errors from sums of blocks);
A. Gelman et al., Bayesian Data Analysis, 3rd ed., section 3.2 (level integrated out). Left out: the correlation of blocks, and the
uncertainty of the shared filter.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.fft import irfft, rfft

from lathesim.diagnosis.records.found import Gain
from lathesim.engine.assembly import FloatArray
from lathesim.identification.noise import NoiseModel, taper
from lathesim.identification.records import Fitted

BLOCKS = 24
"""Blocks that a recording is cut into: enough for a spread, each long against what a machine remembers."""
_BELIEVED = 0.5
"""Share of the power of a sensor's own noise below which no level is believed: where a machine stands still, readings agree by chance."""
_WORSE = 10.0
"""Nats a sample below which an explanation is worse by any amount."""


def gain(better: Fitted, other: Fitted, *, full_band: bool) -> Gain:
    """Return the gain of a fit over another one of the same recording; errors are whitened by the noise of the first.

    ``full_band`` judges all frequencies, not only those of the motion.
    """
    rows = zip(better.residual, other.residual, better.noise, strict=True)
    gains, chances = np.swapaxes([_of_channel(ours, theirs, noise, full_band=full_band) for ours, theirs, noise in rows], 0, 1)
    # a constant has no differences: its mean is judged by itself
    means = np.array([_of_means(*one) for one in zip(better.residual, better.noise, other.residual, other.noise, strict=True)])
    samples = np.array([_independent(noise, full_band=full_band) for noise in better.noise])
    of_channels = gains.sum(axis=1) + means[:, 0]
    share = float(-np.expm1(-2.0 * np.max(of_channels / samples).clip(min=-_WORSE)))
    return Gain(float(of_channels.sum()), math.hypot(*chances.sum(axis=0), *means[:, 1]), share)


def _independent(noise: NoiseModel, *, full_band: bool) -> float:
    """Return how many independent samples a channel has."""
    return noise.samples * noise.share * noise.bins(full_band=full_band) / len(noise.power)


def _of_channel(ours: FloatArray, theirs: FloatArray, noise: NoiseModel, *, full_band: bool) -> FloatArray:
    """Return the gain of each block, and by how much chance may have changed it, shape (2, blocks) [nats]."""
    bins = noise.bins(full_band=full_band)
    ours, theirs = (_white(row, noise, bins) for row in (ours, theirs))
    window = taper(noise.samples) if noise.window is None else noise.window
    seen, left, before, added = (
        np.array([float(np.sum(part**2)) for part in np.array_split(values, BLOCKS)]) + np.finfo(float).tiny
        for values in (window, ours, theirs, theirs - ours)
    )
    without_chance = left + added
    if noise.floor is not None:
        # what lies below the floor counts nowhere: it would pass for chance where only one of the two powers is raised to it
        least = _BELIEVED * 2.0 * float(np.sum((noise.floor * noise.gain**2)[:bins])) / noise.samples * seen / seen.sum()
        left, before, without_chance = (np.maximum(power, least) for power in (left, before, without_chance))
    counted = 0.5 * _independent(noise, full_band=full_band) * seen / seen.sum()
    return np.array([counted * np.log(before / left), counted * np.log(before / without_chance)])


def _white(residual: FloatArray, noise: NoiseModel, bins: int) -> FloatArray:
    """Return a residual (samples,) whitened and back in time; the frequencies from ``bins`` on are left out."""
    spectrum = rfft(noise.tapered(residual)) * noise.gain
    spectrum[bins:] = 0.0
    return np.asarray(irfft(spectrum, len(residual)))


def _of_means(ours: FloatArray, noise: NoiseModel, theirs: FloatArray, other: NoiseModel) -> tuple[float, float]:
    """Return the gain by the mean of a channel and its chance [nats]; none where the noise of either drifts: its mean may be any then."""
    if not (math.isfinite(noise.mean_spread) and math.isfinite(other.mean_spread)):
        return 0.0, 0.0
    mean, before = float(noise.mean_of(ours)) / noise.mean_spread, float(other.mean_of(theirs)) / other.mean_spread
    gained = math.log(other.mean_spread / noise.mean_spread) + 0.5 * (before**2 - mean**2)
    return gained, mean * (before - mean)
