"""The tool point and the cut that a lesson gives under ``tool_point:``."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lathesim.errors import LessonError
from lathesim.lessons.case import Given
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import si_value
from lathesim.stability.tool_point import FrequencyResponse, Mode, ToolPoint, ends_too_low

if TYPE_CHECKING:
    from lathesim.lessons.schema import ResponseEntry
    from lathesim.stability.choose_modes import FoundModes


_FAR, _WELL_DAMPED = 3.0, 0.5
"""Frequency over the end of the band, and damping ratio, of the mode that represents a residual term (assumed so that it does not chatter
first)."""
_NO_REST = 1e-3
"""Share of the response at its chatter frequency below which a residual term is left out (assumed)."""
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

    ``tool`` is the modes, or a response measured in a ``direction`` [rad] from the normal, with the ``factor`` of the force on it.
    ``chosen`` is the speed [rpm] and width [m] of the lesson's own cut.
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
        tool = replace(tool, findings=(*tool.findings, *ends_too_low(tool, factor)))
    elif entry.assembly is not None:
        from lathesim.stability.assembly_file import load_assembly, tip_response

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
    from lathesim.stability.response_files import read_response

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


def natural_frequencies(cut: Cut) -> tuple[float, ...]:
    """Return the natural frequencies [Hz] of a cut's tool point; of a measured response those within its band."""
    return tuple(mode.frequency for mode in (cut.tool.modes if isinstance(cut.tool, ToolPoint) else _fitted(cut.tool)[0]))


def _fitted(response: FrequencyResponse) -> tuple[list[Mode], FoundModes]:
    """Return the modes of a response with a positive stiffness, and the whole fit. Raises :class:`LessonError` if there is no such mode."""
    from lathesim.stability.choose_modes import find_modes

    found = find_modes(replace(response, hits=None) if response.force_noise == 0.0 else response)
    inside = [item.mode for item in found.modes if item.stiffness.value > 0.0]
    if not inside:
        raise LessonError("no mode could be fitted to the response.", remedy="Use the method 'frequency', which takes it as it is.")
    return inside, found


def with_modes(cut: Cut) -> tuple[ToolPoint, str]:
    """Return the modes of a cut, and a sentence if they were fitted to a response.

    Modes outside the band of the response count too. Poles that the data determine become modes. One stiff, well damped mode far above
    represents the rest: it gives the same real part at the lowest point of the real part, where chatter begins.
    """
    if isinstance(cut.tool, ToolPoint):
        return cut.tool, ""
    inside, found = _fitted(cut.tool)
    known = [item.mode for item in found.outside if item.stiffness.value > 0.0 and item.is_known]
    modes, lines = [*inside, *known], cut.tool.frequency
    plain = ToolPoint(tuple(modes), tuple(1.0 for _ in modes))
    whole = found.model.response(lines, windowed=False)
    first = int(np.argmin(cut.factor * whole.real))
    rest = float((whole - plain.receptance(lines)).real[first])
    factors = [cut.factor for _ in modes]
    if abs(rest) > _NO_REST * abs(whole[first]):
        far = _FAR * cut.tool.highest
        modes.append(Mode(far, _WELL_DAMPED, 1.0 / abs(rest) / (1.0 - float(lines[first] / far) ** 2)))
        factors.append(math.copysign(cut.factor, cut.factor * rest))
    sentence = f"Modes fitted to the response: {', '.join(f'{mode.frequency:.1f} Hz' for mode in inside)}"
    if len(modes) > len(inside):
        ends = f"{cut.tool.frequency[0]:.3g} to {cut.tool.highest:.0f} Hz"
        sentence += f"; the residual term outside {ends} is kept" + "".join(f", as a mode near {mode.frequency:.0f} Hz" for mode in known)
    return ToolPoint(tuple(replace(mode, direction=cut.direction) for mode in modes), tuple(factors)), f"{sentence}."
