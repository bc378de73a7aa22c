"""How an axis answers to a correction: its frequency response, measured on the simulated machine, and the filter that follows from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.compensation.learning.laps import Course
from lathesim.engine.assembly import FloatArray

GAIN = 0.7
"""Share of an error that a lap takes away at most: less is slower, more is less robust."""
_GAIN_OFF, _LATE = 0.2, 0.5
"""How far a real machine may be off its model: share of its gain, and samples of delay (assumed)."""
_STILL_GOOD = 0.8
"""Largest contraction that a lap may have on such a machine."""
_OF_A_SAMPLE = 0.1
"""Cut-off frequency over the sampling frequency that is never exceeded."""
_PULSE = {"voltage": 0.2, "reference": 1e-4}
"""Size of the pulse that an axis is excited by [V, m]."""
_WAIT = 0.25


@dataclass(frozen=True)
class Filter:
    """The learning filter of each axis and the low-pass of all.

    ``inverse`` has shape (axes, frequencies) [V/m or m/m], ``low_pass`` shape (frequencies,), on the frequencies of a padded lap of
    ``length`` samples; ``cutoff`` [Hz], 0 where nothing is filtered; ``bound`` is the largest contraction predicted for a lap;
    ``answer`` the root of the sum of squares of an axis' answer to a pulse of one.
    """

    inverse: FloatArray
    low_pass: FloatArray
    length: int
    cutoff: float
    bound: float
    answer: float

    def applied(self, before: FloatArray, errors: FloatArray) -> FloatArray:
        """Return the next corrections  Q [u + gain L e],  shape (axes, samples)."""
        padded = [np.fft.rfft(_padded(rows, self.length)) for rows in (before, errors)]
        following = self.low_pass * (padded[0] + GAIN * self.inverse * padded[1])
        offset = (self.length - before.shape[1]) // 2
        return np.fft.irfft(following, self.length)[:, offset : offset + before.shape[1]]

    def left_out(self, errors: FloatArray) -> FloatArray:
        """Return the part of the first lap's errors that the low-pass never learns,  (1 - Q) e."""
        offset = (self.length - errors.shape[1]) // 2
        spectrum = (1.0 - self.low_pass) * np.fft.rfft(_padded(errors, self.length))
        return np.fft.irfft(spectrum, self.length)[:, offset : offset + errors.shape[1]]


def _padded(rows: FloatArray, length: int) -> FloatArray:
    """Return rows with their ends held and faded, in the middle of ``length`` samples."""
    offset = (length - rows.shape[1]) // 2
    after = length - rows.shape[1] - offset
    fade_in, fade_out = np.linspace(0.0, 1.0, offset), np.linspace(1.0, 0.0, after)
    return np.hstack([rows[:, :1] * fade_in, rows, rows[:, -1:] * fade_out])


def learning_filter(course: Course, *, filtered: bool = True) -> Filter:
    """Return the filter of a course: the inverse of each axis' measured response, and the highest low-pass that is still robust."""
    samples = course.samples
    length = 1 << int(np.ceil(np.log2(samples + 4 * min(samples, round(1.0 / course.period)) + 64)))
    exact = course.exact()
    base = course.lap(np.zeros((len(course.loops), samples)), exact).errors
    at = min(samples // 2, max(1, round(_WAIT * samples)))
    responses, answers = [], []
    for axis in range(len(course.loops)):
        pulse = np.zeros((len(course.loops), samples))
        pulse[axis, at] = _PULSE[course.what]
        answer = (base - course.lap(pulse, exact).errors)[axis, at:] / _PULSE[course.what]
        answers.append(float(np.sqrt(np.sum(answer * answer))))
        responses.append(np.fft.rfft(answer * _faded(len(answer)), length))
    response = np.array(responses)
    small = 1e-6 * np.max(np.abs(response), axis=1, keepdims=True)
    inverse = np.conj(response) / (np.abs(response) ** 2 + small**2)
    frequencies: FloatArray = np.asarray(np.fft.rfftfreq(length, course.period), dtype=np.float64)
    cutoff = _robust(frequencies, course.period) if filtered else 0.0
    low_pass: FloatArray = np.asarray(1.0 / (1.0 + (frequencies / cutoff) ** 4) ** 2 if filtered else np.ones(len(frequencies)))
    bound = float(np.max(np.abs(low_pass * (1.0 - GAIN * inverse * response)))) if filtered else float("nan")
    return Filter(inverse, low_pass, length, cutoff, bound, max(answers))


def _faded(count: int) -> FloatArray:
    """Return a window that is one at first and falls to zero over its last fifth, so that a pulse's answer that has not died out ends."""
    window = np.ones(count)
    last = max(1, count // 5)
    window[-last:] = 0.5 * (1.0 + np.cos(np.linspace(0.0, np.pi, last)))
    return window


def _robust(frequencies: FloatArray, period: float) -> float:
    """Return the highest cut-off with which a machine that is off its model still gets better in every lap."""
    late = np.exp(-2j * np.pi * frequencies * _LATE * period)
    worst = np.max([np.abs(1.0 - GAIN * (1.0 + off) * late) for off in (-_GAIN_OFF, _GAIN_OFF)], axis=0)
    good = frequencies[worst <= _STILL_GOOD]
    return float(min(good[-1] if len(good) else 0.0, _OF_A_SAMPLE / period))
