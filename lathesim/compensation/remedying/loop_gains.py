"""How far the gain of a position loop may rise, with the effects that make it late and without them."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.compensation.learning.laps import LATE, course_of
from lathesim.compensation.learning.largest_gain import largest_gains
from lathesim.compensation.remedying.bench import Diagnosed
from lathesim.lessons.lesson import lesson_from_text
from lathesim.lessons.simulate import prepare


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
        if late is not None and (without is None or abs(late.factor - without.factor) > 1e-6 * without.factor):
            told.append(LoopGain(late.controller, late.gain, late.largest, without.largest if without is not None else None))
    return tuple(told)
