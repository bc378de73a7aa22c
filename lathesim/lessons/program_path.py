"""A part program on a machine: from the file to the path, within the machine's travel and from its start point."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from lathesim.analysis.failed_run import RawStock
from lathesim.engine.assembly import FloatArray
from lathesim.lessons.case import Case, Given
from lathesim.lessons.lesson import Lesson, Machine
from lathesim.lessons.part_values import si_value
from lathesim.path_columns import (
    CONSTANT_SURFACE_SPEED,
    DWELL,
    END_X,
    FEED,
    FEED_MODE,
    KIND,
    LENGTH,
    PER_MINUTE,
    RAPID,
    SPINDLE_MODE,
    SPINDLE_SPEED,
    START_X,
)
from lathesim.program.checks import Bar, checked, meets_stock
from lathesim.program.loading import load_program
from lathesim.program.moves import Program
from lathesim.program.path import Limits, lay_path
from lathesim.program.path import Path as ToolPath
from lathesim.program.tool_nose import Tool


def path_of_program(
    program: Path,
    dialect: str,
    limits: Limits | None = None,
    start: tuple[float, float] | None = None,
    tools: Mapping[int, Tool] | None = None,
) -> ToolPath:
    """Return the path of a part-program file; :class:`ProgramError` with ``file:line`` where it cannot be laid."""
    return lay_path(load_program(program, dialect, start=start, tools=tools), limits)


def program_of(case: Case) -> Program | None:
    """Return the interpreted part program of a case of a lesson, as its machine reads it; none where it has no program."""
    if case.program is None:
        return None
    lesson = case.lesson
    return load_program(case.program, lesson.settings.dialect, start=start_of(lesson.machine, lesson), tools=tools_of(lesson))


def tools_of(lesson: Lesson) -> dict[int, Tool]:
    """Return the tools of a lesson, their noses in metres."""
    found = {}
    for number, entry in lesson.settings.tools.items():
        place = lesson.source.place(("tools", number, "nose_radius"))
        found[number] = Tool(si_value(Given(entry.nose_radius, place, place), "m"), entry.orientation)
    return found


def program_warnings(case: Case, stock: RawStock | None = None) -> list[str]:
    """Return what may go wrong when the program of a case is cut, each as ``file:line: sentence``; with its raw ``stock`` rapids into it.

    What reading the program says beside it, as of a missing end, is told by ``lathesim program``.
    """
    program = program_of(case)
    if program is None:
        return []
    warnings = checked(program)
    if stock is not None:
        warnings += meets_stock(program, Bar(stock.stock_radius, stock.face, stock.stock_length, stock.free_end))
    told = [f"{program.name}:{warned.line}: {warned.sentence}" for warned in sorted(warnings, key=lambda warned: warned.line)]
    nose = program.assumed.get("nose_compensation")
    return [*told, f"{program.name}: nose compensation is read with {nose}. Give the tools of the lesson their noses."] if nose else told


def limits_of(machine: Machine) -> Limits:
    """Return the travel [m] and the largest feed [m/s] of a machine template."""
    units = {"x_low": "m", "x_high": "m", "z_low": "m", "z_high": "m", "feed": "m/s"}
    written = {name: getattr(machine.settings.travel, name) for name in units}
    return Limits(**{name: _value(machine, ("travel", name), text, units[name]) for name, text in written.items() if text is not None})


def start_of(machine: Machine, lesson: Lesson | None = None) -> tuple[float, float] | None:
    """Return the start point (x, z) [m] of a lesson or of its machine template, or none where both leave it to the dialect."""
    if lesson is not None and lesson.settings.start_point is not None:
        own = lesson.settings.start_point
        places = {axis: lesson.source.place(("start_point", axis)) for axis in ("x", "z")}
        x, z = (si_value(Given(getattr(own, axis), place, place), "m") for axis, place in places.items())
        return x, z
    point = machine.settings.start_point
    if point is None:
        return None
    return _value(machine, ("start_point", "x"), point.x, "m"), _value(machine, ("start_point", "z"), point.z, "m")


def _value(machine: Machine, location: tuple[str, str], text: str, unit: str) -> float:
    place = machine.source.place(location)
    return si_value(Given(text, place, place), unit)


def expected_time(table: FloatArray, rapid_speed: float) -> float:
    """Return about how long a path table takes [s], with every block at its programmed speed and rapids at ``rapid_speed`` [m/s].

    Left out: acceleration, and how process controllers and the spindle change the feed. It is for progress bars only.
    """
    total = 0.0
    for row in table:
        if row[KIND] == RAPID:
            speed = rapid_speed
        elif row[FEED_MODE] != PER_MINUTE:
            turns = abs(row[SPINDLE_SPEED]) / (2.0 * math.pi)
            if row[SPINDLE_MODE] == CONSTANT_SURFACE_SPEED:
                radius = max(row[START_X], row[END_X], 1e-3)
                turns /= radius
            speed = row[FEED] * turns
        else:
            speed = row[FEED]
        total += row[DWELL] + (row[LENGTH] / speed if speed > 0.0 else 0.0)
    return float(total)
