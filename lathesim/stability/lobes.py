"""The stability lobes of a lesson: the limit of the chip width over the spindle speed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from lathesim.errors import LessonError
from lathesim.lessons.case import Given
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import si_value
from lathesim.stability.cuts import turning
from lathesim.stability.frequency_limit import Limit, limit_at, smallest_limit
from lathesim.stability.modes import Mode, ToolPoint
from lathesim.stability.periodic_delay import kind_of, smallest_unstable

METHODS = ("frequency", "collocation")
_WIDEST = 50.0
"""Times the smallest limit up to which a limit is looked for by collocation, assumed: nobody cuts wider."""


@dataclass(frozen=True)
class Cut:
    """A tool point and the cut: Ks [N/m^2], process damping [N/m], diameter [m], share of a turn in the cut."""

    tool: ToolPoint
    stiffness: float
    process_damping: float
    diameter: float
    share: float


@dataclass(frozen=True)
class LobePoint:
    """The limit at a speed, and how stability is lost there: "Hopf" or "flip"."""

    limit: Limit
    kind: str


def cut_of(lesson: Lesson) -> Cut:
    """Return the tool point and cut that a lesson gives; :class:`LessonError` where it gives none, or one that cannot be."""
    entry = lesson.settings.tool_point
    if entry is None:
        remedy = "Add 'tool_point:' with modes and cutting_stiffness."
        raise LessonError("the lesson has no tool point.", place=str(lesson.path), remedy=remedy)

    def value(text: str, unit: str) -> float:
        place = lesson.source.place(("tool_point",), key=True)
        return si_value(Given(text, place, place), unit)

    modes = [
        Mode(value(mode.frequency, "Hz"), value(mode.damping, "1"), value(mode.stiffness, "N/m"), value(mode.direction, "rad"))
        for mode in entry.modes
    ]
    cut = Cut(
        ToolPoint.of(modes, value(entry.force_angle, "rad")),
        value(entry.cutting_stiffness, "Pa"),
        value(entry.process_damping, "N/m"),
        value(entry.diameter, "m"),
        value(entry.interrupted, "1"),
    )
    for word, found in (("cutting stiffness", cut.stiffness), ("diameter", cut.diameter)):
        if not found > 0.0:
            raise LessonError(f"the {word} is {found:g}.", place=lesson.source.place(("tool_point",)), remedy="Give a value above 0.")
    return cut


def lobes(cut: Cut, speeds: Sequence[float], method: str) -> list[LobePoint]:
    """Return the limit at each speed [rpm]. An interrupted cut needs the method "collocation"; :class:`LessonError` otherwise."""
    if method == "frequency" and cut.share < 1.0:
        raise LessonError("an interrupted cut has no limit in the frequency domain.", remedy="Use the method 'collocation'.")
    if method == "frequency":
        limits = [limit_at(cut.tool, cut.stiffness, speed, process_damping=cut.process_damping, diameter=cut.diameter) for speed in speeds]
        return [LobePoint(limit, "Hopf" if math.isfinite(limit.width) else "") for limit in limits]
    smallest = smallest_limit(cut.tool, cut.stiffness).width
    return [_by_collocation(cut, speed, smallest) for speed in speeds]


def _by_collocation(cut: Cut, speed: float, smallest: float) -> LobePoint:
    width, multiplier = smallest_unstable(
        lambda b: turning(cut.tool, cut.stiffness, b, speed, process_damping=cut.process_damping, diameter=cut.diameter, share=cut.share),
        0.5 * smallest,
        largest=_WIDEST * smallest,
    )
    return LobePoint(Limit(speed, width), kind_of(multiplier) if math.isfinite(width) else "")
