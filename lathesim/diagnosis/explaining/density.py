"""The one measure: how much better an explanation predicts a recording than another one does.

The recording is cut into blocks. In each block b the error e of an explanation is white, after a filter that both explanations share, with
a level of its own that nobody knows. With the level integrated out (Jeffreys prior), the log predictive density of the block is, up to a
constant that both share,

    log p(b) = -n_b/2 log(sum over the block of e^2)

with n_b the number of independent samples. The gain of one explanation over another is the sum of the differences over blocks, in nats;
its standard error follows from their spread. A block in which something happened that neither explains counts little, as its level is high.

Sources: A. Vehtari, A. Gelman, J. Gabry, Practical Bayesian model evaluation, Statistics and Computing 27 (2017), section 2.2 (sums of
pointwise differences and their standard error); A. Gelman et al., Bayesian Data Analysis, 3rd ed., section 3.2 (level integrated out).
Left out: the correlation of blocks, and the uncertainty of the shared filter.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.fft import irfft, rfft

from lathesim.diagnosis.records.search import Gain
from lathesim.engine.assembly import FloatArray
from lathesim.identification.noise.noise_model import NoiseModel, taper
from lathesim.identification.records.fit import Fitted

BLOCKS = 24
"""Blocks that a recording is cut into: enough for a spread, each long against what a machine remembers."""
_LEAST_POWER = 1e-24
_WORSE = 10.0
"""Nats a sample below which an explanation is worse by any amount."""


def gain(better: Fitted, other: Fitted, *, full_band: bool) -> Gain:
    """Return the gain of a fit over another one of the same recording; errors are whitened by the noise of the first.

    ``full_band`` judges all frequencies, not only those of the motion.
    """
    blocks = block_gains(better, other, full_band=full_band)
    per_block = blocks.sum(axis=0)
    samples = np.array([_independent(noise, full_band=full_band) for noise in better.noise])
    share = float(-np.expm1(-2.0 * np.max(blocks.sum(axis=1) / samples).clip(min=-_WORSE)))
    return Gain(float(per_block.sum()), float(np.std(per_block, ddof=1) * math.sqrt(len(per_block))), share)


def _independent(noise: NoiseModel, *, full_band: bool) -> float:
    """Return how many independent samples a channel has."""
    bins = noise.bins(full_band=full_band)
    return noise.samples * noise.share * bins / len(noise.power)


def block_gains(better: Fitted, other: Fitted, *, full_band: bool) -> FloatArray:
    """Return the gain of a fit over another one in each channel and block, shape (channels, blocks) [nats]."""
    rows = zip(better.residual, other.residual, better.noise, strict=True)
    gains = np.array([_of_channel(ours, theirs, noise, full_band=full_band) for ours, theirs, noise in rows])
    # a constant has no differences: what the means say is spread over all blocks
    means = [_of_means(*of_channel) for of_channel in zip(better.residual, better.noise, other.residual, other.noise, strict=True)]
    return np.asarray(gains + np.array(means)[:, None] / BLOCKS)


def _of_channel(ours: FloatArray, theirs: FloatArray, noise: NoiseModel, *, full_band: bool) -> FloatArray:
    bins = noise.bins(full_band=full_band)
    white = [_white(row, noise, bins) for row in (ours, theirs)]
    window = taper(noise.samples) if noise.window is None else noise.window
    seen = [float(np.sum(part**2)) for part in np.array_split(window, BLOCKS)]
    powers = [[float(np.sum(part**2)) + _LEAST_POWER for part in np.array_split(values, BLOCKS)] for values in white]
    counted = _independent(noise, full_band=full_band) * np.array(seen) / sum(seen)
    return np.asarray(0.5 * counted * (np.log(powers[1]) - np.log(powers[0])))


def _white(residual: FloatArray, noise: NoiseModel, bins: int) -> FloatArray:
    """Return a residual (samples,) whitened and back in time; the frequencies from ``bins`` on are left out."""
    spectrum = rfft(noise.tapered(residual)) * noise.gain
    spectrum[bins:] = 0.0
    return np.asarray(irfft(spectrum, len(residual)))


def _of_means(ours: FloatArray, noise: NoiseModel, theirs: FloatArray, other: NoiseModel) -> float:
    """Return the gain by the mean of a channel [nats]; none where the noise of either drifts, as its mean may be any then."""
    if not (math.isfinite(noise.mean_spread) and math.isfinite(other.mean_spread)):
        return 0.0
    return _of_mean(ours, noise) - _of_mean(theirs, other)


def _of_mean(residual: FloatArray, noise: NoiseModel) -> float:
    """Return the log density of the mean of a residual [nats]."""
    return -math.log(noise.mean_spread) - 0.5 * (float(noise.mean_of(residual)) / noise.mean_spread) ** 2
