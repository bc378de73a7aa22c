"""How an axis answers to a correction, measured on the simulated machine: the filter that follows, and the largest gain of its loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from lathesim.compensation.diagnosed_machine import Diagnosed
from lathesim.compensation.laps import LATE, Course, course_of
from lathesim.engine.assembly import FloatArray
from lathesim.lessons.lesson import lesson_from_text
from lathesim.lessons.simulate import prepare

ComplexArray = NDArray[np.complex128]

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
_PLACES = (0.25, 0.4)
"""Shares of a lap at which it is excited: after the start, and with time to die out."""
_CLEARLY = 0.9
"""Share of the predicted contraction of the axes below which that along the path and across it is taken."""


@dataclass(frozen=True)
class Filter:
    """The learning filter of a machine and the low-pass of all its axes.

    ``inverse`` has shape (frequencies, axes, axes) [V/m or m/m], ``low_pass`` shape (frequencies,), on the frequencies of a padded lap of
    ``length`` samples; ``cutoff`` [Hz], 0 where nothing is filtered; ``bound`` is the largest contraction predicted for a lap;
    ``answer`` the root of the sum of squares of an axis' answer to a pulse of one. With a ``frame``, shape (samples, axes, axes), errors
    and corrections are those along the path and across it, its columns being these two directions.
    """

    inverse: ComplexArray
    low_pass: FloatArray
    length: int
    cutoff: float
    bound: float
    answer: float
    frame: FloatArray | None = None

    def applied(self, before: FloatArray, errors: FloatArray) -> FloatArray:
        """Return the next corrections  Q [u + gain L e],  shape (axes, samples)."""
        padded = [np.fft.rfft(_padded(_into(self.frame, rows), self.length)) for rows in (before, errors)]
        following = self.low_pass * (padded[0] + GAIN * np.einsum("fij,jf->if", self.inverse, padded[1]))
        offset = (self.length - before.shape[1]) // 2
        rows = np.fft.irfft(following, self.length)[:, offset : offset + before.shape[1]]
        return rows if self.frame is None else np.einsum("kij,jk->ik", self.frame, rows)

    def left_out(self, errors: FloatArray) -> FloatArray:
        """Return the part of the first lap's errors that the low-pass never learns,  (1 - Q) e."""
        offset = (self.length - errors.shape[1]) // 2
        spectrum = (1.0 - self.low_pass) * np.fft.rfft(_padded(_into(self.frame, errors), self.length))
        return np.fft.irfft(spectrum, self.length)[:, offset : offset + errors.shape[1]]


def _into(frame: FloatArray | None, rows: FloatArray) -> FloatArray:
    """Return rows of axes, shape (axes, samples), in the directions of a frame."""
    return rows if frame is None else np.einsum("kij,ik->jk", frame, rows)


def _padded(rows: FloatArray, length: int) -> FloatArray:
    """Return rows with their ends held and faded, in the middle of ``length`` samples."""
    offset = (length - rows.shape[1]) // 2
    fade_in, fade_out = np.linspace(0.0, 1.0, offset), np.linspace(1.0, 0.0, length - rows.shape[1] - offset)
    return np.hstack([rows[:, :1] * fade_in, rows, rows[:, -1:] * fade_out])


def learning_filter(course: Course, *, filtered: bool = True) -> Filter:
    """Return the filter of a course: the inverse of the measured response of all axes, and the highest low-pass that is still robust.

    Each axis is excited by a pulse, and the errors of all of them are its column of the response P. A coupling across the path turns with
    the path, so axes that it couples answer differently at each place; along the path and across it they answer alike. The response is
    measured at two places of the lap in both ways, L = P^-1 is that of the first, and the way is taken in which the predicted contraction

        bound = max |Q (1 - gain P L)|_2  over frequencies and places

    is the smaller one. Source: D. A. Bristow, M. Tharayil, A. G. Alleyne, A survey of iterative learning control, IEEE Control Systems 26
    (2006), section on plant inversion.
    """
    samples = course.samples
    length = 1 << int(np.ceil(np.log2(samples + 4 * min(samples, round(1.0 / course.period)) + 64)))
    frequencies: FloatArray = np.asarray(np.fft.rfftfreq(length, course.period), dtype=np.float64)
    cutoff = _robust(frequencies, course.period) if filtered else 0.0
    low_pass: FloatArray = np.asarray(1.0 / (1.0 + (frequencies / cutoff) ** 4) ** 2 if filtered else np.ones(len(frequencies)))
    base = course.lap(np.zeros((len(course.loops), samples)), course.exact(late=True)).errors
    found = []
    for frame in (None, *([path_frame(course.references())] if len(course.loops) == 2 else [])):
        responses, answer = _responses(course, base, frame, length)
        inverse = _inverse(responses[0])
        bound = max(_contraction(low_pass, response, inverse) for response in responses)
        found.append(Filter(inverse, low_pass, length, cutoff, bound if filtered else float("nan"), answer, frame))
    along = found[-1]
    return along if filtered and along.bound < _CLEARLY * found[0].bound else found[0]


def _responses(course: Course, base: FloatArray, frame: FloatArray | None, length: int) -> tuple[list[ComplexArray], float]:
    """Return the response at each place, shape (frequencies, axes, axes), and the largest answer of an axis to its own pulse."""
    samples, count = course.samples, len(course.loops)
    exact = course.exact(late=True)
    lasts = samples - max(1, round(_PLACES[-1] * samples))
    starts = [min(samples // 2, max(1, round(place * samples))) for place in _PLACES]
    pulses = np.zeros((len(starts), count, count, samples))
    for own, at in zip(pulses, starts, strict=True):
        own[:, :, at] = _PULSE[course.what] * (np.eye(count) if frame is None else frame[at].T)
    laps = iter(course.laps(list(pulses.reshape(-1, count, samples)), exact))
    responses, answers = [], []
    for at in starts:
        columns = []
        for axis in range(count):
            answer = _into(frame, base - next(laps).errors)[:, at : at + lasts] / _PULSE[course.what]
            answers.append(float(np.sqrt(np.sum(answer[axis] ** 2))))
            columns.append(np.fft.rfft(answer * _faded(answer.shape[1]), length).T)
        responses.append(np.stack(columns, axis=2))
    return responses, max(answers)


def _inverse(response: ComplexArray) -> ComplexArray:
    """Return the inverse at each frequency, bounded where the response is small:  P^H (P P^H + small^2)^-1."""
    turned = np.conj(np.swapaxes(response, 1, 2))
    small = 1e-6 * np.max(np.linalg.norm(response, axis=1), axis=0)
    return np.asarray(turned @ np.linalg.inv(response @ turned + np.diag(small**2)))


def _contraction(low_pass: FloatArray, response: ComplexArray, inverse: ComplexArray) -> float:
    return float(np.max(low_pass * np.linalg.norm(np.eye(response.shape[1]) - GAIN * response @ inverse, ord=2, axis=(1, 2))))


def path_frame(references: FloatArray) -> FloatArray:
    """Return the directions along a path and left of it at each sample, shape (samples, 2, 2); where it stands, those of before."""
    steps = np.gradient(references, axis=1)
    sizes = np.hypot(*steps)
    moving = np.flatnonzero(sizes > 0.0)
    if not len(moving):
        return np.tile(np.eye(2), (references.shape[1], 1, 1))
    held = np.maximum(np.searchsorted(moving, np.arange(len(sizes)), side="right") - 1, 0)
    along = (steps / np.where(sizes > 0.0, sizes, 1.0))[:, moving[held]]
    return np.stack([along.T, np.stack([-along[1], along[0]], axis=1)], axis=2)


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


_ALIKE = 1e-6
"""Share of a factor within which another one is the same: rounding."""

_LOOP_PULSE = 0.1
"""Size of the pulse that a loop is excited by [V]: far above a level of the finest converter, far below what limits one."""
_AT = 8
"""Sample of the pulse."""
_DIED_OUT = 1e-4
"""Share of its largest value to which an answer has fallen at its end: a larger one is cut off, and its spectrum is another."""
_GRID = 1 << 14
_SETTLED_RAMP = 1e-6


@dataclass(frozen=True)
class LargestGain:
    """The position loop of ``controller``: ``factor`` by which its gain may rise before it is unstable, as the only loop that changes.

    ``gain`` [1/s] is that of the loop opened at the command, lim (z - 1) L(z)/T_s for z to 1; infinite for a loop with an integral.
    Where no inner loop closes, it is the velocity gain: speed over following error.
    """

    controller: str
    factor: float
    gain: float

    @property
    def largest(self) -> float:
        """The largest gain of the opened loop [1/s]."""
        return self.factor * self.gain


def largest_gains(course: Course, *, late: bool = True) -> tuple[LargestGain | None, ...]:
    """Return the largest gain of each loop of a course of voltages, with the effects that make a loop late or without (``late`` false).

    A pulse d is added to the command. With u the controller's answer to it, the loop is opened in the frequency domain:

        T = -u/d,   L = T/(1 - T),   factor = 1/|L| where L is real and negative,   1/gain = T_s sum n t_n

    It is exact for a linear sampled loop, whatever the controller. None stands for a loop whose answer does not die out within the lap, and
    for one that no gain makes unstable.

    Source: G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic Systems, 3rd ed. 1998, section 7.4 (gain margin).
    """
    values = course.exact(late=late)
    count = len(course.loops)
    zero = np.zeros((course.samples, 1))
    pulse = zero.copy()
    pulse[_AT] = _LOOP_PULSE
    given = {name: [zero, *(pulse if place == row else zero for row in range(count))] for place, name in enumerate(course.tables)}
    records = course.batch.run(list(values), np.tile(list(values.values()), (count + 1, 1)), np.copy, given)
    found = []
    for row, loop in enumerate(course.loops):
        channel = course.batch.plan.channels.index(f"{loop.controller}.{course.machinery.ports(loop.controller)['reading']}")
        answer = (np.asarray(records[0])[channel] - np.asarray(records[row + 1])[channel])[_AT:] / _LOOP_PULSE
        found.append(_margin(loop.controller, answer[np.isfinite(answer)], course.period))
    return tuple(found)


def _margin(controller: str, answer: FloatArray, period: float) -> LargestGain | None:
    from scipy.optimize import brentq

    last = max(1, len(answer) // 20)
    if len(answer) < 2 * _AT or np.max(np.abs(answer[-last:])) > _DIED_OUT * np.max(np.abs(answer)):
        return None
    samples = np.arange(len(answer))

    def opened(angle: float) -> complex:
        closed = complex(answer @ np.exp(-1j * angle * samples))
        return closed / (1.0 - closed)

    length = max(_GRID, 1 << int(np.ceil(np.log2(len(answer)))))
    closed = np.fft.rfft(answer, length)[1:]
    angles = np.linspace(0.0, np.pi, length // 2 + 1)[1:]
    side = np.imag(closed / (1.0 - closed))
    crossings = [
        cast(float, brentq(lambda angle: opened(angle).imag, angles[place], angles[place + 1], xtol=1e-13))
        for place in np.flatnonzero(side[:-2] * side[1:-1] < 0.0)
    ]
    reals = [opened(angle).real for angle in (*crossings, np.pi)]
    factors = [-1.0 / real for real in reals if -1.0 < real < 0.0]
    if not factors:
        return None
    behind = float(samples @ answer)
    return LargestGain(controller, min(factors), 1.0 / (period * behind) if behind > _SETTLED_RAMP else np.inf)


@dataclass(frozen=True)
class LoopGain:
    """The gain of the loop of ``controller``, opened at its command [1/s]: as it is, the largest, and that without the effects."""

    controller: str
    gain: float
    largest: float
    largest_without: float | None


def loop_gains(diagnosed: Diagnosed) -> tuple[LoopGain, ...]:
    """Return the gains of the loops whose largest gain a diagnosed effect changes; none where no effect makes a loop late."""
    if not any(entry["effect"] in {effect.__name__ for effect in LATE} for entry in diagnosed.effects):
        return ()
    lesson = lesson_from_text(diagnosed.text((), {}, diagnosed.folder), diagnosed.folder / "lesson.yaml")
    course = course_of(prepare(lesson, diagnosed.registry), "voltage")
    told = []
    for late, without in zip(largest_gains(course), largest_gains(course, late=False), strict=True):
        if late is not None and (without is None or abs(late.factor - without.factor) > _ALIKE * without.factor):
            told.append(LoopGain(late.controller, late.gain, late.largest, without.largest if without is not None else None))
    return tuple(told)
