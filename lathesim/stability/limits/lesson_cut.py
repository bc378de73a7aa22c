"""The tool point and the cut that a lesson gives under ``tool_point:``."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from lathesim.errors import LessonError
from lathesim.lessons.case import Given
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import si_value
from lathesim.stability.tool_point.frequency_response import FrequencyResponse
from lathesim.stability.tool_point.modes import Mode, ToolPoint

if TYPE_CHECKING:
    from lathesim.lessons.schema import ResponseEntry

RPM = 60.0 / (2.0 * math.pi)
"""Revolutions a minute of a radian per second."""


@dataclass(frozen=True)
class Milling:
    """Milling with straight teeth: teeth, force per chip area along and across [Pa], angles of entry and leave [rad]."""

    teeth: int
    tangential: float
    normal: float
    entry: float
    leave: float


@dataclass(frozen=True, eq=False)
class Cut:
    """A tool point and the cut: Ks [N/m^2], process damping [N/m], diameter [m], share of a turn in the cut.

    ``tool`` is the modes, or the response as it was measured in a ``direction`` [rad] from the normal, with the ``factor`` of the force on
    it. ``chosen`` is the speed [rpm] and width [m] of the lesson's own cut.
    """

    tool: ToolPoint | FrequencyResponse
    stiffness: float
    process_damping: float = 0.0
    diameter: float = 0.036
    share: float = 1.0
    milling: Milling | None = None
    factor: float = 1.0
    direction: float = 0.0
    chosen: tuple[float, float] | None = None


def cut_of(lesson: Lesson) -> Cut:
    """Return the tool point and cut that a lesson gives; :class:`LessonError` where it gives none, or one that cannot be."""
    entry = lesson.settings.tool_point
    if entry is None:
        remedy = "Add 'tool_point:' with modes and cutting_stiffness."
        raise LessonError("the lesson has no tool point.", place=str(lesson.path), remedy=remedy)
    place = lesson.source.place(("tool_point",), key=True)

    def value(text: str, unit: str) -> float:
        return si_value(Given(text, place, place), unit)

    angle = value(entry.force_angle, "rad")
    tool: ToolPoint | FrequencyResponse
    factor, direction = 1.0, 0.0
    if entry.response is not None:
        tool = _measured(entry.response, lesson.path.parent)
        direction = value(entry.response.direction, "rad")
        factor = math.cos(angle - direction) * math.cos(direction)
    elif entry.assembly is not None:
        from lathesim.stability.assembly.assembly_file import load_assembly
        from lathesim.stability.assembly.tip_response import tip_response

        tool, factor = tip_response(load_assembly(lesson.path.parent / entry.assembly)), math.cos(angle)
    else:
        modes = []
        for number, mode in enumerate(entry.modes):
            at = lesson.source.place(("tool_point", "modes", number))
            try:
                modes.append(
                    Mode(value(mode.frequency, "Hz"), value(mode.damping, "1"), value(mode.stiffness, "N/m"), value(mode.direction, "rad"))
                )
            except LessonError as error:
                raise error if error.place else LessonError(error.fact, place=at, remedy=error.remedy) from None
        tool = ToolPoint.of(modes, angle)
    milling = None
    if entry.milling is not None:
        mill = entry.milling
        milling = Milling(
            mill.teeth, value(mill.tangential, "Pa"), value(mill.normal, "Pa"), value(mill.entry, "rad"), value(mill.leave, "rad")
        )
    chosen = None
    if entry.speed is not None and entry.width is not None:
        chosen = (value(entry.speed, "rad/s") * RPM, value(entry.width, "m"))
    cut = Cut(
        tool,
        value(entry.cutting_stiffness, "Pa") if entry.cutting_stiffness is not None else 0.0,
        value(entry.process_damping, "N/m"),
        value(entry.diameter, "m"),
        value(entry.interrupted, "1"),
        milling,
        factor,
        direction,
        chosen,
    )
    _check(cut, place)
    return cut


def _measured(entry: ResponseEntry, folder: Path) -> FrequencyResponse:
    from lathesim.stability.tool_point.read_response import read_response

    return read_response(folder / entry.file, entry.quantity, entry.unit)


def _check(cut: Cut, place: str) -> None:
    words = [("diameter", cut.diameter)]
    if cut.milling is None:
        words.append(("cutting stiffness", cut.stiffness))
    for word, found in words:
        if not found > 0.0:
            raise LessonError(f"the {word} is {found:g}.", place=place, remedy="Give a value above 0.")
    if cut.process_damping < 0.0:
        raise LessonError(f"the process damping is {cut.process_damping:g} N/m.", place=place, remedy="Give 0 or more.")
    if not 0.0 < cut.share <= 1.0:
        raise LessonError(f"the share of a turn in the cut is {cut.share:g}.", place=place, remedy="Give one above 0 and at most 1.")
    if cut.milling is not None and (cut.process_damping > 0.0 or cut.share < 1.0):
        word = "process damping" if cut.process_damping > 0.0 else "slotted bar"
        raise LessonError(f"milling takes no {word}.", place=place, remedy="Take the key out.")
    if cut.milling is not None and not 0.0 <= cut.milling.entry < cut.milling.leave <= 2.0 * math.pi + 1e-9:
        raise LessonError("a tooth leaves the cut before it enters.", place=place, remedy="Give entry below leave, from 0 to 360 deg.")


def with_modes(cut: Cut) -> tuple[ToolPoint, str]:
    """Return the modes of a cut, and a sentence where they were fitted to a response for it."""
    if isinstance(cut.tool, ToolPoint):
        return cut.tool, ""
    from lathesim.stability.tool_point.choose_modes import find_modes

    found = find_modes(replace(cut.tool, hits=None) if cut.tool.force_noise == 0.0 else cut.tool)
    modes = [replace(item.mode, direction=cut.direction) for item in found.modes if item.stiffness.value > 0.0]
    if not modes:
        raise LessonError("no mode could be fitted to the response.", remedy="Use the method 'frequency', which takes it as it is.")
    told = ", ".join(f"{mode.frequency:.1f} Hz" for mode in modes)
    return ToolPoint(tuple(modes), tuple(cut.factor for _ in modes)), f"Modes fitted to the response: {told}."
