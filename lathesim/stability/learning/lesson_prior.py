"""What a lesson gives and calls uncertain of its tool point, as the belief before the first cut."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lathesim.errors import LessonError
from lathesim.lessons.lesson import Lesson
from lathesim.record import FloatArray
from lathesim.stability.learning.belief import Prior
from lathesim.stability.limits.lesson_cut import cut_of, with_modes
from lathesim.stability.limits.uncertain_cut import spreads_of
from lathesim.stability.tool_point.modes import Mode, ToolPoint

_LEAST = 1e-4
"""Relative standard deviation of what is not called uncertain."""


@dataclass(frozen=True)
class LessonPrior:
    """The prior with the cutting stiffness [Pa] by which limits become stiffness, and sentences worth telling."""

    prior: Prior
    told: tuple[str, ...] = ()


def lesson_prior(lesson: Lesson) -> LessonPrior:
    """Return the prior of a lesson's map; :class:`LessonError` where nothing is uncertain or the cut is none that cuts can teach."""
    cut = cut_of(lesson)
    spreads = spreads_of(lesson, cut)
    place = str(lesson.path)
    if not any(spread.deviation > 0.0 for spread in spreads):
        remedy = "Add for example  uncertain: {tool_point.damping: 30 %, tool_point.stiffness: 20 %}."
        raise LessonError("nothing of the tool point is uncertain, so cuts teach nothing.", place=place, remedy=remedy)
    if cut.milling is not None or cut.share < 1.0 or cut.process_damping > 0.0:
        word = "milling" if cut.milling is not None else "interrupted cuts" if cut.share < 1.0 else "process damping"
        raise LessonError(
            f"the map learns uninterrupted turning, and the lesson has {word}.", place=place, remedy="Leave it out for the map."
        )
    tool, told = with_modes(cut)
    lowest = [abs(min(0.0, float(np.min(_real(tool.factors[at], mode))))) for at, mode in enumerate(tool.modes)]
    first = int(np.argmax(lowest))
    mode, factor = tool.modes[first], tool.factors[first]
    if factor <= 0.0:
        raise LessonError(
            "the mode that limits the cut is pushed the wrong way.", place=place, remedy="Check the directions and the force angle."
        )
    sentences = [told] if told else []
    if len([value for value in lowest if value > 0.05 * lowest[first]]) > 1:
        sentences.append(f"The map learns the mode at {mode.frequency:.1f} Hz alone, which limits the cut most.")
    deviation = dict.fromkeys(("frequency", "damping", "stiffness", "cutting_stiffness"), 0.0)
    for spread in spreads:
        if spread.mode in (0, first + 1) and spread.name in deviation:
            deviation[spread.name] = math.hypot(deviation[spread.name], math.sqrt(math.log1p(spread.deviation**2)))
    mean = np.array([math.log(mode.frequency), math.log(max(mode.damping, 1e-4)), math.log(mode.stiffness / (cut.stiffness * factor))])
    spread_of_three = np.array(
        [deviation["frequency"], deviation["damping"], math.hypot(deviation["stiffness"], deviation["cutting_stiffness"])]
    )
    return LessonPrior(Prior(mean, np.maximum(spread_of_three, _LEAST)), tuple(sentences))


def _real(factor: float, mode: Mode) -> FloatArray:
    return np.asarray(ToolPoint((mode,), (factor,)).receptance(np.linspace(0.5, 2.0, 400) * mode.frequency).real)
