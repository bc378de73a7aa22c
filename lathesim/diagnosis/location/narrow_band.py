"""What is left in a narrow band of frequencies: a squeal, a hum, a chatter, which no force of the catalogue makes.

Whitened by its noise model, a residual without such a thing has the same power at every frequency. A band stands out where its power is
many times the median of its surroundings and holds a large share of the whole. What a motion repeats makes peaks too: at its own rhythm,
so only what swings many times in a recording counts. Noise that is merely slow reaches down to zero, and is no swing.
Source: Randall, Vibration-based Condition Monitoring (2011), section 3.4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import FloatArray
from lathesim.identification.machine.roles import decides
from lathesim.identification.noise.noise_model import NoiseModel, spectrum
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment

_MEDIAN = math.log(2.0)
"""Median of the power of noise whose mean is one."""


_TOP = 0.1
"""Share of its frequency by which the top of a swing reaches to either side."""


def _is_low_pass(above: FloatArray, peak: int, method: Method = STANDARD) -> bool:
    """Return whether what stands above the noise around it (frequencies,) reaches down to zero: noise that is slow, and no swing."""
    top = above[math.floor((1.0 - _TOP) * peak) : math.ceil((1.0 + _TOP) * peak) + 1]
    return float(np.mean(above[: int(method.location.band_below * peak)])) > method.location.band_quiet * float(np.mean(top))


def _edges(above: FloatArray, peak: int, width: int, method: Method = STANDARD) -> tuple[int, int]:
    """Return the first and the last frequency of the band around a peak, averaged over ``width`` frequencies."""
    smooth = uniform_filter1d(above, width)
    outside = np.flatnonzero(smooth < method.location.band_edge * smooth[peak])
    below, beyond = outside[outside < peak], outside[outside > peak]
    return int(below[-1]) + 1 if len(below) else 0, int(beyond[0]) - 1 if len(beyond) else len(above) - 1


def _prominence(power: FloatArray, width: int, method: Method = STANDARD) -> FloatArray:
    """Return by how many times the power (frequencies,), averaged over ``width`` frequencies, is above the median around it."""
    around = median_filter(power, size=method.location.band_around * width + 1, mode="nearest") / _MEDIAN
    found: FloatArray = uniform_filter1d(power / np.maximum(around, 1e-300), width)
    return found


def _is_driven(experiment: Experiment, peak: int, width: int, method: Method = STANDARD) -> bool:
    """Return whether the machine is asked to move at a frequency: what is left there may be of the motion."""
    near = slice(max(0, peak - width), peak + width + 1)
    drives = (np.diff(np.nan_to_num(experiment.record[name])) for name in experiment.machine.drive)
    return any(
        bool(np.any(_prominence(np.abs(spectrum(drive)) ** 2, width, method)[near] > method.location.band_prominent)) for drive in drives
    )


@dataclass(frozen=True)
class NarrowBand:
    """A band that is left in a channel: its highest place [Hz], its root mean square [unit of the channel], its share of the whitened
    residual, and where it begins and ends [Hz]."""

    channel: str
    frequency: float
    size: float
    unit: str
    share: float
    low: float
    high: float

    @property
    def octave(self) -> str:
        """The name of the octave of its channel in which it is."""
        return in_octave(self.channel, self.frequency)

    @property
    def place(self) -> str:
        """Where it is, in words: at a frequency, or between two."""
        if self.high - self.low < 2.0 * _TOP * self.frequency:
            return f"at {self.frequency:.4g} Hz"
        return f"between {self.low:.3g} and {self.high:.3g} Hz"

    def __str__(self) -> str:
        return (
            f"{self.channel} swings {self.place} by {self.size:.3g} {self.unit} (rms): {self.share:.0%} of what is left "
            "there, weighed by its noise. Nothing in the machine explains it."
        )


def in_octave(channel: str, frequency: float) -> str:
    """Return the name of the octave of a channel in which a frequency [Hz] lies."""
    return f"{channel}, octave {math.floor(math.log2(frequency))}"


def band_strengths(channel: str, residual: FloatArray, model: NoiseModel, seconds: float, method: Method = STANDARD) -> dict[str, float]:
    """Return by how much the strongest band of a residual (samples,) over some ``seconds`` stands out in each octave, over what it must
    reach to be looked at; by the names of :func:`in_octave`.

    A loop that swings by itself does so at its own frequency: what swings elsewhere is held against what the loop does there.
    """
    power = np.abs(spectrum(residual, model.differences, model.window)) ** 2 / model.power
    lines = np.arange(int(method.location.band_least_cycles), int(method.location.band_highest * len(power)))
    stands_out = np.zeros(len(lines))
    for width, prominent in method.location.bands:
        if len(power) < 2 * method.location.band_around * width or not np.any(power):
            break
        stands_out = np.maximum(stands_out, _prominence(power, width, method)[lines] / prominent)
    octaves = np.floor(np.log2(lines / seconds))
    begins = [np.flatnonzero(octaves == octave) for octave in np.unique(octaves)]
    return {in_octave(channel, lines[inside[0]] / seconds): float(np.max(stands_out[inside])) for inside in begins}


def narrow_bands(experiment: Experiment, fitted: Fitted, method: Method = STANDARD) -> list[NarrowBand]:
    """Return the bands that stand out of what a fit leaves, one for each channel that does not belong to a controller."""
    found = []
    parts = {part.name: part.component for part in experiment.machine.assembly.parts}
    seconds = experiment.sensed.samples * experiment.machine.assembly.sample_period
    for row, (name, model) in enumerate(zip(experiment.machine.compare, fitted.noise, strict=True)):
        if decides(parts[name.partition(".")[0]]):
            continue
        power = np.abs(spectrum(fitted.residual[row], model.differences, model.window)) ** 2 / model.power
        for width, prominent in method.location.bands:
            if len(power) < 2 * method.location.band_around * width or not np.any(power):
                break
            around = median_filter(power, size=method.location.band_around * width + 1, mode="nearest") / _MEDIAN
            prominence = _prominence(power, width, method)
            prominence[: width // 2] = 0.0
            prominence[int(method.location.band_highest * len(prominence)) :] = 0.0
            peak = int(np.argmax(prominence))
            near = slice(max(0, peak - method.location.band_near * width), peak + method.location.band_near * width + 1)
            share = float(np.sum(power[near]) / np.sum(power))
            raw = np.abs(spectrum(fitted.residual[row])) ** 2
            is_most = float(np.sum(raw[near]) / np.sum(raw)) > method.location.band_share
            stands_out = share > method.location.band_share or (is_most and not _is_driven(experiment, peak, width, method=method))
            stands_out = stands_out and peak >= int(method.location.band_least_cycles) and prominence[peak] > prominent
            if stands_out and not _is_low_pass(power - around, peak, method=method):
                size = math.sqrt(2.0 * float(np.sum(raw[near])) / experiment.sensed.samples)
                if size < max(
                    method.location.band_of_floor * experiment.floors[name],
                    method.location.band_of_step * experiment.machine.resolution.get(name, 0.0),
                ):
                    # a staircase that is climbed steadily swings, by less than a step, once for each of them
                    break
                low, high = (edge / seconds for edge in _edges(power - around, peak, width, method=method))
                found.append(
                    NarrowBand(name, peak / seconds, size, experiment.sensed.plan.unit(experiment.sensed.channels[row]), share, low, high)
                )
                break
    return found
