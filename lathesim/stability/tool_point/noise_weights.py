"""What is known of the noise of a response: weights by which misfits of a model become numbers of size 1, independent of each other.

The noise of the response channel is independent from line to line; its size is learned from how single hits differ. The noise of the force
is smooth in frequency, as only the short pulse is kept: it multiplies the response by 1 + sum_t g_t exp(-j w t)/|F| with one g for each
sample that is kept, t from the middle of the pulse. Both together are a covariance D + A A^T, whose inverse root is applied by the singular
vectors of A.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.record import FloatArray
from lathesim.stability.tool_point.frequency_response import Complex, FrequencyResponse

BAND = 0.25
"""Highest frequency of a response over the sample rate."""
_AROUND = 41
"""Lines over which the size of the noise is averaged, assumed: noise changes slowly with frequency."""
_LARGEST_BASIS = 64
_WEAK = 0.2
"""Directions with less of the noise of the force than this share of that of the response are left out."""
_LOOSE = 0.02
_FLOOR, _LINEAR = 1e-9, 1e-5
"""Noise is at least these shares of the largest response and of the response itself, assumed: no instrument is more linear."""


@dataclass(frozen=True, eq=False)
class NoiseWeights:
    """Standard deviation of each line [m/N], real and imaginary part alike, and the directions (directions, 2 lines) that the noise of the
    force adds, with the share of the weight that is taken from each. Real and imaginary part of a line stand side by side."""

    deviation: FloatArray
    directions: FloatArray
    share: FloatArray

    def gram(self, rows: Complex) -> FloatArray:
        """Return the products of rows (rows, lines) under the inverse covariance, (rows, rows)."""
        real = (rows * (1.0 / self.deviation)).view(np.float64)
        whole = real @ real.T
        if not len(self.share):
            return np.asarray(whole)
        along = real @ self.directions.T
        return np.asarray(whole - (along * self.share) @ along.T)

    def misfit(self, values: Complex) -> float:
        """Return the sum of squares of a misfit (lines,) under the inverse covariance."""
        return float(self.gram(values[None, :])[0, 0])


def weights_of_mean(response: FrequencyResponse, hits: Complex, count: int, shape: Complex | None = None) -> NoiseWeights:
    """Return the weights of the mean of ``count`` hits; the scatter of ``hits`` (hits, lines) says how large the noise is.

    ``shape`` is the response that the noise of the force multiplies. A smooth model of it is better than the measured mean, whose own noise
    would draw the fit towards smaller responses.
    """
    forces = response.forces if response.forces is not None else np.ones(len(response.frequency))
    omega = 2.0 * np.pi * response.frequency
    native = {"receptance": np.ones_like(omega), "mobility": omega, "accelerance": omega**2}[response.quantity] * forces
    mean = hits.mean(axis=0)
    scatter = (np.abs((hits - mean) * native) ** 2).sum(axis=0) / max(1, len(hits) - 1)
    smooth = running_mean(np.minimum(scatter, 12.0 * running_median(scatter)))
    deviation = np.sqrt(0.5 * smooth / count) / native
    deviation = np.maximum(deviation, _least(mean))
    if not response.force_noise or not response.pulse_length or response.forces is None:
        return NoiseWeights(deviation, np.zeros((0, 0)), np.zeros(0))
    # the scatter holds the noise of the force too, where the response is strong: near a peak only the response channel's own counts
    own = _response_noise(scatter, np.abs(mean) * native, response)
    deviation = np.maximum(np.sqrt(0.5 * own / count) / native, _least(mean))
    directions, share = _force_directions(response, mean if shape is None else shape, deviation, count)
    return NoiseWeights(deviation, directions, share)


def _response_noise(scatter: FloatArray, strength: FloatArray, response: FrequencyResponse) -> FloatArray:
    """Return the noise of the response channel alone, by the scatter less what the noise of the force explains; smooth over frequency."""
    assert response.forces is not None
    by_force = (strength * response.force_noise / response.forces) ** 2 * response.pulse_length
    quiet = by_force < 0.3 * np.median(scatter)
    if np.count_nonzero(quiet) < 8:
        return running_mean(np.maximum(scatter - by_force, 0.05 * scatter))
    places = np.flatnonzero(quiet)
    smooth = running_mean(np.maximum(scatter[places] - by_force[places], 0.0))
    return np.asarray(np.interp(np.arange(len(scatter)), places, smooth))


def _force_directions(response: FrequencyResponse, mean: Complex, deviation: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the directions of the noise of the force and the share to take from each."""
    assert response.forces is not None
    used = min(max(1, round(response.pulse_length * response.frequency[-1] / BAND)), _LARGEST_BASIS)
    # noise turns the response by its distance from the middle of the pulse: the filter's tail makes the part behind it the longer one
    lags = (np.arange(used) + 0.5) / used * response.pulse_length - response.pulse_lead
    size = response.force_noise * np.sqrt(response.pulse_length / used / count)
    columns = (mean / response.forces * size / deviation)[:, None] * np.exp(-2j * np.pi * np.outer(response.frequency, lags))
    stacked = np.ascontiguousarray(columns.T).view(np.float64)
    _, sizes, right = np.linalg.svd(stacked, full_matrices=False)
    kept = sizes > _WEAK
    return np.ascontiguousarray(right[kept]), sizes[kept] ** 2 / (1.0 + sizes[kept] ** 2)


def weights_of_residual(response: FrequencyResponse, residual: Complex) -> NoiseWeights:
    """Return weights where single hits are not known: the noise is as large as the misfit of a model is over the lines around."""
    omega = 2.0 * np.pi * response.frequency
    native = {"receptance": np.ones_like(omega), "mobility": omega, "accelerance": omega**2}[response.quantity]
    scatter = np.abs(residual * native) ** 2
    deviation = np.sqrt(0.5 * running_mean(scatter)) / native
    deviation = np.maximum(deviation, _least(response.receptance_values))
    return NoiseWeights(deviation, np.zeros((0, 0)), np.zeros(0))


def _least(values: Complex) -> FloatArray:
    size = np.abs(values)
    return np.asarray(np.maximum(_FLOOR * size.max(), _LINEAR * size))


def loose_weights(weights: NoiseWeights, values: Complex) -> NoiseWeights:
    """Return weights for looking where modes are: a model may be a few per cent off, so that no peak outweighs all others."""
    return NoiseWeights(np.hypot(weights.deviation, _LOOSE * np.abs(values)), np.zeros((0, 0)), np.zeros(0))


def running_mean(values: FloatArray, around: int = _AROUND) -> FloatArray:
    """Return the mean over the lines around each."""
    around = min(around, len(values))
    total = np.convolve(values, np.ones(around), "same")
    return np.asarray(total / np.convolve(np.ones(len(values)), np.ones(around), "same"))


def running_median(values: FloatArray, around: int = _AROUND) -> FloatArray:
    """Return the median over the lines around each."""
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, size=min(around, len(values)), mode="nearest"))
