"""What a lesson gives and calls uncertain of its tool point, as the belief before the first cut."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lathesim.errors import LessonError
from lathesim.json_text import parsed_json
from lathesim.lessons.lesson import Lesson
from lathesim.record import FloatArray
from lathesim.stability.learning.belief import Prior
from lathesim.stability.limits.lesson_cut import cut_of, with_modes
from lathesim.stability.limits.uncertain_cut import spreads_of
from lathesim.stability.tool_point.modes import Mode, ToolPoint

_OF_AN_OVERHANG = 0.02
_LEAST = 1e-4
"""Relative standard deviation of what is not called uncertain."""


@dataclass(frozen=True)
class LessonPrior:
    """The prior with the cutting stiffness [Pa] by which limits become stiffness, and sentences worth telling."""

    prior: Prior
    told: tuple[str, ...] = ()


def lesson_prior(lesson: Lesson, *, needs_uncertain: bool = True) -> LessonPrior:
    """Return the prior of a lesson's map; :class:`LessonError` where nothing is uncertain or the cut is none that cuts can teach."""
    cut = cut_of(lesson)
    spreads = spreads_of(lesson, cut)
    place = str(lesson.path)
    if needs_uncertain and not any(spread.deviation > 0.0 for spread in spreads):
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


def carried_over(known: LessonPrior, path: Path) -> LessonPrior:
    """Return a prior that begins where the cuts at another overhang ended; ``path`` is what ``lathesim cuts --json`` wrote there.

    What the cuts corrected there of frequency, damping and stiffness is corrected here as well, relative to what each lesson gives. How the
    parameters went together is left out, and 2 % are added for what an overhang changes beyond its model.
    """
    names = ("frequency", "damping", "stiffness_over_cutting_stiffness")
    try:
        told = parsed_json(path.read_text(encoding="utf-8"))
        rows = [told["parameters"][name] for name in names]
        given = np.array([float(told["given"][name]) for name in names])
        value, low, high = (np.array([float(row[word]) for row in rows]) for word in ("value", "low", "high"))
    except FileNotFoundError:
        raise LessonError("there is no such file.", place=str(path), remedy="Write it with 'lathesim cuts ... --json'.") from None
    except (ValueError, KeyError, TypeError):
        raise LessonError("the file holds no learned map.", place=str(path), remedy="Write it with 'lathesim cuts ... --json'.") from None
    deviation = np.hypot(np.log(high / low) / (2.0 * 1.959964), _OF_AN_OVERHANG)
    prior = Prior(known.prior.mean + np.log(value / given), np.asarray(deviation))
    return replace(known, prior=prior, told=(*known.told, f"The map begins where the cuts of {path.name} ended."))


def _real(factor: float, mode: Mode) -> FloatArray:
    return np.asarray(ToolPoint((mode,), (factor,)).receptance(np.linspace(0.5, 2.0, 400) * mode.frequency).real)
