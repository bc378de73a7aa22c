"""The noise of a residual, so that a coloured residual is not mistaken for evidence.

A residual of a replay has two sources: what the sensor adds, which is white or drifts slowly, and forces nobody modelled, which reach the
channel through the machine's own dynamics. Its power at a frequency f is therefore a sum of known shapes with unknown sizes a >= 0,

    P(f) = floor^2 + sum_i a_i T_i(f),    T in {1} and {|G_s(f)|^2, |G_s(f)|^2 / (1 + (f/f0)^2)}

where G_s is the response of the channel to an impulse of the machine's state s. The sizes follow from the residual by maximum likelihood
(Whittle: -2 log L = sum over frequencies of log P + |E|^2 / P; multiplicative updates of Fevotte, Bertin, Durrieu, Nonnegative matrix
factorization with the Itakura-Saito divergence, Neural Computation 21 (2009), eq. 3.6). Source of the frame: R. Pintelon, J. Schoukens,
System Identification: A Frequency Domain Approach, 2nd ed. (2012), chapter 9; L. Ljung, System Identification, 2nd ed., section 4.3.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import rfft, rfftfreq
from scipy.signal.windows import tukey

from lathesim.engine.assembly import FloatArray

_SHARE_IN_BAND = 0.99
_FEWEST = 12
"""Frequencies of the motion that count at least: the real and the imaginary part of each, one number for each of 24 blocks of a recording.
A slow stroke has its power in fewer, and a friction that stops it shows in the others."""
_OF_COUNTS = sum(math.comb(4, k) ** 2 for k in range(5)) / sum(math.comb(5, k) ** 2 for k in range(6))
"""Power of the noise of counts that were differenced, over that which the fourth differences of them make of it: the sum of the squares of
the binomial coefficients of four over that of five."""
_FLAT = 1.5
"""Ratio of the powers at the lowest two frequencies below which a noise is white there."""


@functools.lru_cache(maxsize=16)
def taper(samples: int) -> FloatArray:
    """Return the window, shape (samples,), with mean square 1."""
    window = tukey(samples, 0.1)
    return np.asarray(window / np.sqrt(np.mean(window * window)))


@functools.lru_cache(maxsize=16)
def effective_share(samples: int) -> float:
    """Return the share of the frequencies that counts as independent: the taper makes neighbours alike."""
    return _share_of(taper(samples))


def _share_of(window: FloatArray) -> float:
    """Return the share of the frequencies that a window leaves independent:  (sum w^2)^2 / (n sum w^4)."""
    square = window**2
    return float(np.sum(square) ** 2 / (len(window) * np.sum(square**2)))


def window_of(weights: FloatArray) -> FloatArray:
    """Return the window that sees each sample with its weight (samples,), 0 to 1; with mean square 1."""
    window = taper(len(weights)) * weights
    return np.asarray(window / np.sqrt(np.mean(window * window)))


def spectrum(values: FloatArray, differences: int = 0, window: FloatArray | None = None) -> FloatArray:
    """Return the tapered transform of the n-th differences of ``values`` (..., samples), scaled so that white noise has power sigma^2."""
    samples = values.shape[-1]
    seen = taper(samples) if window is None else window
    values = _differenced(values, differences)
    workers = 2 if values.ndim > 1 and len(values) > 1 else 1
    return np.asarray(rfft(values * (seen / np.sqrt(samples)), axis=-1, workers=workers))


def _differenced(values: FloatArray, times: int) -> FloatArray:
    for _ in range(times):
        values = np.diff(values, axis=-1, prepend=values[..., :1])
    return values


@dataclass(frozen=True)
class NoiseShapes:
    """The shapes T for one channel, shape (shapes, frequencies), the first one the sensor's; and the floor [unit of the channel].

    All are of the channel differenced ``differences`` times, as often as makes what forces do to it nearest to white: a drifting position
    would leak through the taper into every frequency. ``band`` is the number of frequencies that hold 99 % of the power of the motion so
    differenced; a channel that no state moves has no such limit. A ``window`` takes the place of the taper where some samples do not count.
    With ``within_band`` no frequency beyond that counts, whoever asks for all.
    """

    shapes: FloatArray
    floor: float
    samples: int
    differences: int = 0
    band: int = 1 << 62
    window: FloatArray | None = None
    within_band: bool = False


@dataclass(frozen=True)
class NoiseModel:
    """Power at each frequency [unit of the channel, squared], for a number of samples."""

    power: FloatArray
    samples: int
    differences: int = 0
    band: int = 1 << 62
    sizes: FloatArray | None = None
    window: FloatArray | None = None
    within_band: bool = False
    floor: FloatArray | None = None
    """The part of the power that the sensor makes by itself, (frequencies,)."""

    def bins(self, *, full_band: bool) -> int:
        """Return how many frequencies count: those of the motion, or all where ``full_band`` asks for them."""
        return len(self.power) if full_band and not self.within_band else min(self.band, len(self.power))

    @property
    def share(self) -> float:
        """The share of the frequencies that counts as independent."""
        return effective_share(self.samples) if self.window is None else _share_of(self.window)

    def whiten(self, values: FloatArray, *, full_band: bool = False) -> FloatArray:
        """Return ``values`` (..., samples) as independent numbers of variance one, real parts and then imaginary ones.

        Frequencies above the band of the motion are left out, or kept when ``full_band``.
        """
        bins = len(self.power) if full_band else self.bins(full_band=False)
        scaled = spectrum(values, self.differences, self.window)[..., :bins] * self.gain[:bins]
        parts = np.concatenate([scaled.real, scaled.imag], axis=-1)
        if math.isfinite(self.mean_spread):
            # a constant has no differences; the place of its imaginary part is free
            parts[..., scaled.shape[-1]] = self.mean_of(values) / self.mean_spread
        return parts

    def tapered(self, values: FloatArray) -> FloatArray:
        """Return ``values`` (..., samples) as :meth:`whiten` transforms them; times :attr:`gain` their transform is white."""
        window = taper(self.samples) if self.window is None else self.window
        return np.asarray(_differenced(values, self.differences) * (window / np.sqrt(self.samples)))

    @functools.cached_property
    def gain(self) -> FloatArray:
        """What makes a transform white, (frequencies,); nothing where a frequency does not count."""
        gain = np.sqrt(2.0 * self.share / self.power)
        gain[self.bins(full_band=True) :] = 0.0
        return np.asarray(gain)

    def mean_of(self, values: FloatArray) -> FloatArray:
        """Return the mean of ``values`` (..., samples) as the window weighs them."""
        window = taper(self.samples) if self.window is None else self.window
        return np.asarray(values @ window / np.sum(window))

    @functools.cached_property
    def mean_spread(self) -> float:
        """One standard deviation of the mean of this noise [unit of the channel], sigma^2 / n for white noise.

        Infinite where the noise rises towards low frequencies: how much of it lies below the lowest one that is seen cannot be told.
        """
        first, second = (self.power[place] / float(_differencing(place / self.samples)) ** self.differences for place in (1, 2))
        if not self.differences or first > _FLAT * second:
            return math.inf
        window = taper(self.samples) if self.window is None else self.window
        return float(np.sqrt(first * np.sum(window**2)) / np.sum(window))

    def log_likelihood(self, residual: FloatArray, *, full_band: bool = True) -> float:
        """Return the log-likelihood of a residual (samples,), of all frequencies or of those of the motion, up to a constant [nats]."""
        kept = slice(0, self.bins(full_band=full_band))
        power = self.power[kept]
        ratio = np.abs(spectrum(residual, self.differences, self.window)[kept]) ** 2 / power
        of_spectrum = float(-self.share * np.sum(np.log(power) + ratio))
        if not math.isfinite(self.mean_spread):
            return of_spectrum
        return of_spectrum - float(np.log(self.mean_spread) + 0.5 * (self.mean_of(residual) / self.mean_spread) ** 2)


WHITE, RATE, DIFFERENCED = "white", "rate", "differenced"
"""How the noise of a sensor is: white; that of a speed, held against a place that was differenced; that of counts that were."""


def output_error(motion: FloatArray, floor: float, differences: int, window: FloatArray | None) -> NoiseShapes:
    """Return the shape of an error that counts alike at every frequency of a motion (samples,), differenced so many times.

    No forces are thought of, so that what is missing cannot pass for their noise. A noise model that is fitted beside a machine that lacks
    something weighs least where the lack is largest; a fixed one does not. Source: L. Ljung, System Identification, 2nd ed., section 8.5.
    """
    samples = len(motion)
    return NoiseShapes(np.ones((1, samples // 2 + 1)), floor, samples, 0, _band(motion, differences), window, within_band=True)


def noise_shapes(
    impulse_responses: FloatArray, motion: FloatArray, floor: float, period: float, times: int, *, coloured: bool, sensor: str = WHITE
) -> NoiseShapes:
    """Return the shapes for a channel; ``impulses`` (states, samples) is its response to an impulse of each state, ``motion`` (samples,)
    itself. It is differenced so many ``times``.

    Without ``coloured`` the sensor's noise and the forces on the machine are white: the equation error at every frequency counts alike, as
    in least squares of the inverse dynamics. With it the forces may be slow: nobody measures what hangs on a table. A sensor's noise stays
    white; were it slow, a zero that drifts would be noise. A rate has the noise of a position that was differenced as well, and one that
    was made of counts hardly any other.
    """
    samples = impulse_responses.shape[-1]
    frequency = rfftfreq(samples, period)
    differencing = _differencing(frequency * period)
    differencing[0] = differencing[1] if len(frequency) > 1 else 1.0
    gains = _gains(impulse_responses, frequency, period)
    # above these frequencies a slow load falls off [Hz]
    corners = (3.0, 30.0) if coloured else ()
    own = {
        WHITE: [np.ones_like(frequency)],
        RATE: [np.ones_like(frequency), differencing],
        DIFFERENCED: [_OF_COUNTS * differencing, np.ones_like(frequency)],
    }[sensor]
    forces = list(gains)
    forces += [gain / (1.0 + (frequency / corner) ** 2) for gain in forces for corner in corners]
    return NoiseShapes(np.array(own + forces) * differencing**times, floor, samples, times, _band(motion, times))


def _differencing(frequency: FloatArray | float) -> FloatArray:
    """Return what taking differences makes of the power at some frequencies, in cycles a sample."""
    return np.asarray(np.abs(1.0 - np.exp(-2j * np.pi * np.asarray(frequency))) ** 2)


def _band(motion: FloatArray, differences: int) -> int:
    """Return the number of frequencies that hold 99 % of the power of the differenced motion, or the fewest that count."""
    if not differences:
        return 1 << 62
    power = np.abs(spectrum(np.nan_to_num(motion), differences)) ** 2
    power[0] = 0.0
    total = float(power.sum())
    return max(int(np.searchsorted(np.cumsum(power), _SHARE_IN_BAND * total)) + 1, _FEWEST) if total > 0.0 else 1 << 62


def _gains(impulse_responses: FloatArray, frequency: FloatArray, period: float) -> list[FloatArray]:
    """Return |G|^2 of each response to an impulse (states, samples) that there is."""
    return [gain for gain in (_impulse_gain(impulse, frequency, period) for impulse in impulse_responses) if gain.max(initial=0.0) > 0.0]


def differences(impulse_responses: FloatArray, period: float) -> int:
    """Return how often a channel is to be differenced so that its response to impulses (states, samples) spans the fewest decades.

    Asked of a machine without effects, and kept for all: likelihoods of a channel that was differenced once and of one that was twice are
    those of other numbers.
    """
    frequency = rfftfreq(impulse_responses.shape[-1], period)
    gains = _gains(impulse_responses, frequency, period)
    if not gains:
        return 0
    differencing = _differencing(frequency * period)
    differencing[0] = differencing[1] if len(frequency) > 1 else 1.0
    return int(np.argmin([max(_decades(gain * differencing**times) for gain in gains) for times in range(3)]))


def _decades(gain: FloatArray) -> float:
    """Return by how much a response varies over the frequencies at which there is one, none where there is none."""
    answers = gain > 0.0
    return float(np.std(np.log(gain[answers]))) if answers.any() else 0.0


def _impulse_gain(impulse: FloatArray, frequency: FloatArray, period: float) -> FloatArray:
    """Return |G|^2 of a response to an impulse. Its second differences are transformed and summed again: those of a response that never
    dies out, or grows on as the place of a machine without friction does, have died out at the end of the recording."""
    bends = rfft(np.diff(impulse, n=2, prepend=(0.0, 0.0)))
    summing = np.abs(1.0 - np.exp(-2j * np.pi * frequency * period))
    summing[0] = summing[1] if len(summing) > 1 else 1.0
    gain = np.abs(bends) ** 2 / summing**4
    gain[0] = gain[1] if len(gain) > 1 else gain[0]
    return np.asarray(gain)


def fit_noise_model(residual: FloatArray, shapes: NoiseShapes) -> NoiseModel:
    """Return the noise model of a residual (samples,)."""
    counted = slice(0, shapes.band if shapes.within_band else None)
    seen = np.abs(spectrum(residual, shapes.differences, shapes.window)[counted]) ** 2
    basis = shapes.shapes[:, counted]
    least = max(shapes.floor**2, 1e-300) * basis[0]
    sizes = np.mean(seen) / np.maximum(np.mean(basis, axis=1), 1e-300) / len(basis)
    for _ in range(25):
        power = least + sizes @ basis
        sizes = sizes * (basis @ (seen / power**2)) / np.maximum(basis @ (1.0 / power), 1e-300)
    return _of_sizes(sizes, shapes, shapes.band)


def _of_sizes(sizes: FloatArray, shapes: NoiseShapes, band: int) -> NoiseModel:
    floor = max(shapes.floor**2, 1e-300) * shapes.shapes[0]
    power = floor + sizes @ shapes.shapes
    return NoiseModel(power, shapes.samples, shapes.differences, band, sizes, shapes.window, shapes.within_band, floor)


def white_noise(residual: FloatArray, shapes: NoiseShapes) -> float:
    """Return the power of what a sensor adds to its floor: the median over the frequencies, as lines and slow errors are in few of them.
    The power of white noise has an exponential distribution, whose median is log 2 of its mean."""
    seen = np.abs(spectrum(residual, shapes.differences, shapes.window)) ** 2 / shapes.shapes[0]
    return max(float(np.median(seen)) / math.log(2.0) - shapes.floor**2, 0.0)


def carried_over(model: NoiseModel, shapes: NoiseShapes) -> NoiseModel:
    """Return the noise of a machine with other values: the sensor's noise and the forces stay, what the machine makes of them changes."""
    assert model.sizes is not None
    if model.differences != shapes.differences or len(model.sizes) != len(shapes.shapes):
        return model
    return _of_sizes(model.sizes, shapes, model.band)


def whitened(models: Sequence[NoiseModel], values: FloatArray, *, full_band: bool) -> FloatArray:
    """Return values (n, channels, samples) as independent numbers of variance one, each channel whitened by its model, (n, numbers)."""
    return np.concatenate([model.whiten(values[:, channel], full_band=full_band) for channel, model in enumerate(models)], axis=1)


def whitened_power(residual: FloatArray, models: Sequence[NoiseModel], *, full_band: bool) -> float:
    """Return the squared sum of a residual (channels, samples), each channel whitened by its model."""
    power = 0.0
    for row, model in zip(residual, models, strict=True):
        white = model.whiten(row, full_band=full_band)
        power += float(white @ white)
    return power
