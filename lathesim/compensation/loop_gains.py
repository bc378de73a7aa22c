"""The largest gain of a position loop, with the effects that make it late and without them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np

from lathesim.compensation.diagnosed_machine import Diagnosed
from lathesim.compensation.laps import LATE, Course, course_of
from lathesim.engine.assembly import FloatArray
from lathesim.lessons.lesson import lesson_from_text
from lathesim.lessons.simulate import prepare

_ALIKE = 1e-6
"""Share of a factor within which another one is the same: rounding."""

_PULSE = 0.1
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
    pulse[_AT] = _PULSE
    given = {name: [zero, *(pulse if place == row else zero for row in range(count))] for place, name in enumerate(course.tables)}
    records = course.batch.run(list(values), np.tile(list(values.values()), (count + 1, 1)), np.copy, given)
    found = []
    for row, loop in enumerate(course.loops):
        controller = next(part for part in course.machinery.parts if part.name == loop.controller)
        channel = course.batch.plan.channels.index(f"{loop.controller}.{controller.component.ports['reading']}")
        answer = (np.asarray(records[0])[channel] - np.asarray(records[row + 1])[channel])[_AT:] / _PULSE
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
    gain = 1.0 / (period * behind) if behind > _SETTLED_RAMP else np.inf
    return LargestGain(controller, min(factors), gain)


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
