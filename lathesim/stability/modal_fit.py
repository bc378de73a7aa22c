"""Modes from a frequency response: a weighted fit of poles and residues, with intervals.

    H(w) = sum_i R_i / (s^2 + 2 zeta_i w_i s + w_i^2) + U + L/s^2,   s = j w + r

R_i is 1/m_i, so that k_i = w_i^2/R_i; U and L stand for the modes far above and below the band, and r is the rate of an exponential
window. A pole may lie outside the band: a mode close to the band bends the response inside, unlike a constant.
The poles are fitted, each time with the residues that are best for them; a further mode begins where the misfit is largest. Source:
N. M. M. Maia, J. M. M. Silva, Theoretical and Experimental Modal Analysis (1997), chapter 4. Left out: complex residues.

What is known of the noise of a response: weights by which misfits of a model become numbers of size 1, independent of each other.

The noise of the response channel is independent from line to line; its size is learned from how single hits differ. The noise of the force
is smooth in frequency, as only the short pulse is kept: it multiplies the response by 1 + sum_t g_t exp(-j w t)/|F| with one g for each
sample that is kept, t from the middle of the pulse. Both together are a covariance D + A A^T, whose inverse root is applied by the singular
vectors of A.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from lathesim.record import FloatArray
from lathesim.stability.stability_thresholds import SHORT, TAP
from lathesim.stability.tool_point import Complex, FrequencyResponse

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
    deviation = np.sqrt(0.5 * running_mean(np.minimum(scatter, 12.0 * running_median(scatter))) / count) / native
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
    quiet = by_force < TAP.by_force * np.median(scatter)
    if np.count_nonzero(quiet) < SHORT.quiet_lines:
        return running_mean(np.maximum(scatter - by_force, 0.05 * scatter))
    places = np.flatnonzero(quiet)
    return np.asarray(np.interp(np.arange(len(scatter)), places, running_mean(np.maximum(scatter[places] - by_force[places], 0.0))))


def _force_directions(response: FrequencyResponse, mean: Complex, deviation: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the directions of the noise of the force and the share to take from each."""
    assert response.forces is not None
    used = min(max(1, round(response.pulse_length * response.frequency[-1] / BAND)), _LARGEST_BASIS)
    # noise turns the response by its distance from the middle of the pulse: the filter's tail makes the part behind it the longer one
    lags = (np.arange(used) + 0.5) / used * response.pulse_length - response.pulse_lead
    size = response.force_noise * np.sqrt(response.pulse_length / used / count)
    columns = (mean / response.forces * size / deviation)[:, None] * np.exp(-2j * np.pi * np.outer(response.frequency, lags))
    _, sizes, right = np.linalg.svd(np.ascontiguousarray(columns.T).view(np.float64), full_matrices=False)
    kept = sizes > _WEAK
    return np.ascontiguousarray(right[kept]), sizes[kept] ** 2 / (1.0 + sizes[kept] ** 2)


def weights_of_residual(response: FrequencyResponse, residual: Complex) -> NoiseWeights:
    """Return weights where single hits are not known: the noise is as large as the misfit of a model is over the lines around."""
    omega = 2.0 * np.pi * response.frequency
    native = {"receptance": np.ones_like(omega), "mobility": omega, "accelerance": omega**2}[response.quantity]
    deviation = np.sqrt(0.5 * running_mean(np.abs(residual * native) ** 2)) / native
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
    return np.asarray(np.convolve(values, np.ones(around), "same") / np.convolve(np.ones(len(values)), np.ones(around), "same"))


def running_median(values: FloatArray) -> FloatArray:
    """Return the median over the lines around each."""
    from scipy.ndimage import median_filter

    return np.asarray(median_filter(values, size=min(_AROUND, len(values)), mode="nearest"))


_FIRST_DAMPING = (0.03, 0.008)
"""Damping ratios that a new mode begins with."""
_PLACES = 4
_TRIED = 2
"""How many places for a new mode are looked at, and how many of them are followed to the end."""
_SPARE = 1
_STEPS = 30
_ENOUGH = 1e-3
"""A fit ends when a step gains less than this of the sum of squares."""
_DAMPINGS = (1e-6, 0.9)
"""Least and largest damping ratio of a pole."""
_LARGEST_STEP = 0.5
"""First step of the logarithm of a frequency or damping at most (assumed)."""
_BELOW, _ABOVE = 0.2, 5.0
"""Factors on the lowest and highest frequency of the band that limit a pole (assumed: further out U and L fit as well)."""
_DETERMINED = 1.0
"""Largest standard deviation of the logarithm of a value that counts as determined by the data (assumed)."""
_CANCEL = 0.2
"""Share of the larger residue below which the sum of the residues of a pair counts as zero (assumed)."""


@dataclass(frozen=True, eq=False)
class ModalModel:
    """Modes of a fit: natural frequencies [rad/s], damping ratios, residues 1/m [1/kg], the terms U [m/N] and L, and the covariance.

    ``covariance`` belongs to the logarithms of frequency, damping and residue of each mode in turn, then U and L over their scale.
    """

    omega: FloatArray
    damping: FloatArray
    residue: FloatArray
    rest: FloatArray
    window_rate: float
    misfit: float = math.nan
    covariance: FloatArray | None = None

    def response(self, frequency: FloatArray, *, windowed: bool = True) -> Complex:
        """Return the receptance [m/N] at frequencies [Hz]."""
        s = laplace(frequency, self.window_rate if windowed else 0.0)
        return np.asarray(np.concatenate([self.residue, self.rest]) @ self.rows(s))

    def rows(self, s: Complex) -> Complex:
        """Return the response for a residue of 1 of each mode, then those of U and L, (modes + 2, lines)."""
        count = len(self.omega)
        found = np.empty((count + len(self.rest), len(s)), dtype=np.complex128)
        w, z = self.omega[:, None], self.damping[:, None]
        np.reciprocal(s * (s + 2.0 * z * w) + w * w, out=found[:count])
        if len(self.rest):
            found[count], found[count + 1] = 1.0, 1.0 / (s * s)
        return found

    def inside(self, frequency: FloatArray) -> Any:
        """Return which modes lie within the band of frequencies [Hz], (modes,)."""
        place = self.omega / (2.0 * math.pi)
        return (place >= frequency[0]) & (place <= frequency[-1])

    def phantoms(self, frequency: FloatArray) -> list[int]:
        """Return the indices of poles that are no modes: pairs that cancel, and poles in the band that the data do not determine."""
        assert self.covariance is not None
        count, spread = len(self.omega), np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        of_damping, of_residue = spread[count : 2 * count], spread[2 * count : 3 * count]
        unknown = (of_damping > _DETERMINED) | (of_residue > _DETERMINED)
        found = set(np.flatnonzero(unknown & self.inside(frequency)).tolist())
        for low, high in itertools.combinations(range(count), 2):
            width = max(self.damping[low] * self.omega[low], self.damping[high] * self.omega[high])
            sizes = np.abs(self.residue[[low, high]])
            if self.omega[high] - self.omega[low] < width and abs(self.residue[low] + self.residue[high]) < _CANCEL * sizes.max():
                found |= {low, high}
        return sorted(found)

    def without(self, out: list[int]) -> ModalModel:
        """Return the model without some of its modes."""
        kept = np.delete(np.arange(len(self.omega)), out)
        return replace(self, omega=self.omega[kept], damping=self.damping[kept], residue=self.residue[kept])


def laplace(frequency: FloatArray, rate: float) -> Complex:
    """Return s = j w + rate at frequencies [Hz]."""
    return np.asarray(2j * np.pi * np.asarray(frequency) + rate, dtype=np.complex128)


def fit_modes(frequency: FloatArray, values: Complex, weights: NoiseWeights, count: int, start: ModalModel) -> ModalModel:
    """Return the best model of ``count`` modes that goes on from ``start``, one of as many modes or fewer.

    Where modes are is looked for under looser weights, by which no peak outweighs all others; the full weights have the last word.
    """
    return _refined(begin_modes(frequency, values, weights, count, start), laplace(frequency, start.window_rate), values, weights)


def begin_modes(frequency: FloatArray, values: Complex, weights: NoiseWeights, count: int, start: ModalModel) -> ModalModel:
    """Return a model of ``count`` modes under the looser weights: where :func:`fit_modes` may begin."""
    if len(start.omega) >= count:
        return start
    return _grown(start, frequency, laplace(frequency, start.window_rate), values, loose_weights(weights, values), count)


def _grown(model: ModalModel, frequency: FloatArray, s: Complex, values: Complex, weights: NoiseWeights, count: int) -> ModalModel:
    """Return a model of ``count`` modes, grown by one at a time.

    Several at once end in pairs that cancel each other: the second of them is put where the first is still badly fitted.
    """
    for number in range(len(model.omega) + 1, count + 1):
        model = _with_one_more(model, frequency, s, values, weights, number)
    return model


def _with_one_more(model: ModalModel, frequency: FloatArray, s: Complex, values: Complex, weights: NoiseWeights, count: int) -> ModalModel:
    """Return a model of ``count`` modes: one more than that is put in, one after another, and what matters least is taken out."""
    asked = count + _SPARE
    while len(model.omega) < asked:
        begun = [
            _solved(_with_mode(model, 2.0 * math.pi * place, damping), s, values, weights)
            for place in _worst(frequency, values - model.response(frequency), weights)
            for damping in _FIRST_DAMPING
        ]
        begun.sort(key=lambda item: item.misfit)
        model = min((_refined(item, s, values, weights) for item in begun[:_TRIED]), key=lambda item: item.misfit)
    while len(model.omega) > count:
        fewer = [_solved(model.without([out]), s, values, weights) for out in range(len(model.omega))]
        fewer.sort(key=lambda item: item.misfit)
        model = min((_refined(item, s, values, weights) for item in fewer[:_TRIED]), key=lambda item: item.misfit)
    return model


def _worst(frequency: FloatArray, misfit: Complex, weights: NoiseWeights) -> list[float]:
    """Return the frequencies [Hz] at which a misfit is largest, apart from each other."""
    power = running_mean(np.abs(misfit / weights.deviation) ** 2, 5)
    found: list[float] = []
    for place in np.argsort(-power):
        if all(abs(frequency[place] - other) > TAP.apart * other for other in found):
            found.append(float(frequency[place]))
        if len(found) == _PLACES:
            break
    return found


def _with_mode(model: ModalModel, omega: float, damping: float) -> ModalModel:
    return ModalModel(
        np.append(model.omega, omega), np.append(model.damping, damping), np.append(model.residue, 0.0), model.rest, model.window_rate
    )


def _solved(model: ModalModel, s: Complex, values: Complex, weights: NoiseWeights) -> ModalModel:
    """Return a model with the residues and rests that fit best for its poles."""
    count = len(model.omega)
    gram = weights.gram(np.concatenate([model.rows(s), values[None, :]]))
    amounts = _solve(gram[:-1, :-1], gram[:-1, -1])
    return replace(model, residue=amounts[:count], rest=amounts[count:], misfit=float(gram[-1, -1] - amounts @ gram[:-1, -1]))


def _solve(matrix: FloatArray, right: FloatArray) -> FloatArray:
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    return np.asarray((np.linalg.lstsq(matrix / np.outer(scale, scale), (right.T / scale).T, rcond=1e-13)[0].T / scale).T)


def _refined(model: ModalModel, s: Complex, values: Complex, weights: NoiseWeights) -> ModalModel:
    """Return a model with poles and residues where the weighted misfit is smallest, and the covariance there."""
    from scipy.optimize import least_squares

    count = len(model.omega)
    model = _solved(model, s, values, weights)
    if count:
        poles = _Poles(model, s, values, weights)
        ends = [[_BELOW * abs(s[0].imag) + 1e-3, _ABOVE * abs(s[-1].imag)], _DAMPINGS]
        low, high = np.log(np.repeat(ends, count, axis=0).T / np.concatenate([model.omega, model.damping]))
        bounds = np.minimum(low, -1e-9), np.maximum(high, 1e-9)
        enough = max(_ENOUGH / max(model.misfit, 1e-300), 1e-3 * _ENOUGH / len(s))
        end = least_squares(
            poles.left, np.zeros(2 * count), poles.slopes, bounds, "dogbox", ftol=enough, x_scale=_LARGEST_STEP, max_nfev=_STEPS
        )  # fmt: skip
        model = poles.moved(end.x)
    matrix = weights.gram(_derivatives(model, s))
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    inverse = np.linalg.pinv(matrix / np.outer(scale, scale), rcond=1e-14) / np.outer(scale, scale)
    order = np.argsort(model.omega)
    arranged = np.concatenate([order, count + order, 2 * count + order])
    return replace(
        model,
        omega=model.omega[order],
        damping=model.damping[order],
        residue=model.residue[order],
        covariance=inverse[np.ix_(arranged, arranged)],
    )


@dataclass(frozen=True, eq=False)
class _Poles:
    """The misfit of a model by the logarithms of its frequencies and dampings over those it begins with; residues and rests are the best
    for its poles. Source: L. Kaufman, BIT 15 (1975), 49 (variable projection, whose slopes leave out how the residues bend).

    All lines are brought down to as few numbers as there are poles by the products of misfit and slopes: a fit needs no more of them.
    """

    begun: ModalModel
    s: Complex
    values: Complex
    weights: NoiseWeights
    _last: dict[bytes, FloatArray] = field(default_factory=dict)

    def moved(self, logarithms: FloatArray) -> ModalModel:
        """Return the model with moved poles."""
        factors = np.exp(logarithms).reshape(2, -1)
        moved = replace(self.begun, omega=self.begun.omega * factors[0], damping=self.begun.damping * factors[1])
        return _solved(moved, self.s, self.values, self.weights)

    def left(self, logarithms: FloatArray) -> FloatArray:
        """Return numbers whose squares add up to the misfit, (2 poles + 1,)."""
        return self._numbers(logarithms)[:, -1]

    def slopes(self, logarithms: FloatArray) -> FloatArray:
        """Return the derivatives of :meth:`left`, (2 poles + 1, 2 poles), as far as no residue makes up for them."""
        return -self._numbers(logarithms)[:, :-1]

    def _numbers(self, logarithms: FloatArray) -> FloatArray:
        """Return numbers for slopes and misfit, (2 poles + 1, 2 poles + 1), with the products that all their lines have."""
        key = logarithms.tobytes()
        if key not in self._last:
            model = self.moved(logarithms)
            misfit = self.values - np.concatenate([model.residue, model.rest]) @ model.rows(self.s)
            gram = self.weights.gram(np.concatenate([_derivatives(model, self.s), misfit[None, :]]))
            poles = np.append(np.arange(2 * len(model.omega)), len(gram) - 1)
            amounts = np.arange(2 * len(model.omega), len(gram) - 1)
            both = gram[np.ix_(amounts, poles)]
            products = gram[np.ix_(poles, poles)] - _solve(gram[np.ix_(amounts, amounts)], both).T @ both
            size = np.sqrt(np.maximum(np.diag(products), 1e-300))
            sizes, vectors = np.linalg.eigh(products / np.outer(size, size))
            self._last.clear()
            self._last[key] = np.sqrt(np.maximum(sizes, 0.0))[:, None] * vectors.T * size
        return self._last[key]


def _derivatives(model: ModalModel, s: Complex) -> Complex:
    """Return the response's derivatives by the logarithms of frequency, damping and residue, and by the rests, (values, lines)."""
    responses = model.rows(s)
    count = len(model.omega)
    w, z, r = model.omega[:, None], model.damping[:, None], model.residue[:, None]
    amounts = np.concatenate([model.residue, np.ones(len(model.rest))])
    rows = np.empty((3 * count + len(model.rest), len(s)), dtype=np.complex128)
    by_frequency, by_damping = rows[:count], rows[count : 2 * count]
    np.multiply(responses[:count], responses[:count], out=by_damping)
    by_damping *= -2.0 * w * r
    np.multiply(by_damping, z * s + w, out=by_frequency)
    by_damping *= z * s
    np.multiply(responses, amounts[:, None], out=rows[2 * count :])
    return rows
