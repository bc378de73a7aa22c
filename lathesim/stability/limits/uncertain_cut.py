"""Cuts drawn within what a lesson calls uncertain, and the band of limits that they give."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.errors import LessonError, nearest
from lathesim.lessons.case import Given
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import si_value
from lathesim.record import FloatArray
from lathesim.stability.limits.frequency_limit import limit_at
from lathesim.stability.limits.lesson_cut import Cut
from lathesim.stability.limits.measured_limit import widths_of_lines
from lathesim.stability.tool_point.frequency_response import FrequencyResponse
from lathesim.stability.tool_point.modes import ToolPoint
from lathesim.units import split_quantity

PREFIX = "tool_point."
DRAWS = 100
_DRAWS_WITH_DAMPING = 40
OF_THE_CUT = ("cutting_stiffness", "process_damping")
OF_A_MODE = ("frequency", "damping", "stiffness")
_UNITS = {"cutting_stiffness": "Pa", "process_damping": "N/m", "frequency": "Hz", "damping": "1", "stiffness": "N/m"}


@dataclass(frozen=True)
class Spread:
    """Relative standard deviation of a quantity of the cut, or of a mode counted from 1; 0 stands for all modes."""

    name: str
    mode: int
    deviation: float


def spreads_of(lesson: Lesson, cut: Cut) -> tuple[Spread, ...]:
    """Return what the lesson calls uncertain of its tool point; names as ``tool_point.cutting_stiffness`` or ``tool_point.damping_2``."""
    found = []
    for name, text in lesson.settings.uncertain.items():
        if not name.startswith(PREFIX):
            continue
        place = lesson.source.place(("uncertain", name))
        item = name.removeprefix(PREFIX)
        word, _, number = item.rpartition("_")
        mode = int(number) if number.isdigit() and word in OF_A_MODE else 0
        item = word if mode else item
        if item not in (*OF_THE_CUT, *OF_A_MODE):
            known = (*OF_THE_CUT, *OF_A_MODE)
            raise LessonError(f"the tool point has no '{item}'.", place=place, remedy=nearest(item, known) or f"It has {', '.join(known)}.")
        found.append(Spread(item, mode, _deviation(cut, item, mode, text, place)))
    return tuple(found)


def _deviation(cut: Cut, item: str, mode: int, text: str, place: str) -> float:
    if split_quantity(text)[1] == "%":
        share = si_value(Given(text, place, place), "1")
    else:
        modes = cut.tool.modes if isinstance(cut.tool, ToolPoint) else ()
        if item in OF_A_MODE and not (modes and mode <= len(modes)):
            raise LessonError(f"there is no mode {mode} whose {item} it could be.", place=place, remedy="Give the deviation in percent.")
        middle = (
            getattr(modes[max(mode, 1) - 1], item) if item in OF_A_MODE else {OF_THE_CUT[0]: cut.stiffness}.get(item, cut.process_damping)
        )
        share = si_value(Given(text, place, place), _UNITS[item]) / middle if middle else 0.0
    if not 0.0 <= share < 3.0:
        raise LessonError(f"an uncertainty of {100.0 * share:g} % makes no sense.", place=place, remedy="Give one from 0 to 300 %.")
    return share


def drawn(cut: Cut, spreads: Sequence[Spread], chance: np.random.Generator) -> Cut:
    """Return a cut with its uncertain quantities drawn log-normally around what is given."""
    factors = {
        (spread.name, spread.mode): math.exp(math.sqrt(math.log1p(spread.deviation**2)) * chance.standard_normal()) for spread in spreads
    }
    return with_factors(cut, factors)


def with_factors(cut: Cut, factors: Mapping[tuple[str, int], float]) -> Cut:
    """Return a cut with quantities multiplied: (name, mode counted from 1, or 0 for all) -> factor."""

    def factor(name: str, mode: int = 0) -> float:
        return factors.get((name, 0), 1.0) * (factors.get((name, mode), 1.0) if mode else 1.0)

    tool = cut.tool
    if isinstance(tool, ToolPoint):
        modes = [
            replace(
                mode,
                frequency=mode.frequency * factor("frequency", number),
                damping=min(mode.damping * factor("damping", number), 0.99),
                stiffness=mode.stiffness * factor("stiffness", number),
            )
            for number, mode in enumerate(tool.modes, 1)
        ]
        tool = ToolPoint(tuple(modes), tool.factors)
    else:
        values = tool.receptance_values / factor("stiffness")
        tool = replace(tool, frequency=tool.frequency * factor("frequency"), receptance_values=values)
    return replace(
        cut,
        tool=tool,
        stiffness=cut.stiffness * factor("cutting_stiffness"),
        process_damping=cut.process_damping * factor("process_damping"),
    )


def band(cut: Cut, spreads: Sequence[Spread], speeds: Sequence[float], seed: int = 1) -> FloatArray:
    """Return the 2.5, 50 and 97.5 % quantiles of the limit [m] at each rising speed [rpm], (3, speeds)."""
    chance = np.random.Generator(np.random.Philox(seed))
    asked = np.asarray(speeds, dtype=np.float64)
    rows = []
    for _ in range(_DRAWS_WITH_DAMPING if cut.process_damping > 0.0 else DRAWS):
        trial = drawn(cut, spreads, chance)
        if isinstance(trial.tool, FrequencyResponse):
            rows.append(widths_of_lines(trial.tool.frequency, trial.factor * trial.tool.receptance_values, trial.stiffness, asked))
        elif trial.process_damping > 0.0:
            limits = [
                limit_at(trial.tool, trial.stiffness, speed, process_damping=trial.process_damping, diameter=trial.diameter)
                for speed in speeds
            ]
            rows.append(np.array([limit.width for limit in limits]))
        else:
            lines = frequency_lines(trial.tool)
            rows.append(widths_of_lines(lines, trial.tool.receptance(lines), trial.stiffness, asked))
    return np.quantile(np.stack(rows), [0.025, 0.5, 0.975], axis=0, method="lower")


def frequency_lines(tool: ToolPoint) -> FloatArray:
    """Return frequencies [Hz] close together where the modes are, for limits from lines."""
    highest = 3.0 * max(mode.frequency for mode in tool.modes)
    parts = [np.linspace(highest / 1500.0, highest, 1500)]
    for mode in tool.modes:
        reach = np.sinh(np.linspace(-5.0, 5.0, 400)) / math.sinh(5.0)
        parts.append(mode.frequency * (1.0 + np.clip(reach * max(30.0 * mode.damping, 0.05), -0.95, 2.0)))
    return np.unique(np.concatenate(parts))
