"""A part program on a machine: from the file to the path, within the machine's travel and from its start point."""

from __future__ import annotations

import math
from pathlib import Path

from lathesim.engine.assembly import FloatArray
from lathesim.lessons.case import Given
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
from lathesim.program.loading import load_program
from lathesim.program.path import Limits, lay_path
from lathesim.program.path import Path as ToolPath


def path_of_program(program: Path, dialect: str, limits: Limits | None = None, start: tuple[float, float] | None = None) -> ToolPath:
    """Give the path of a part-program file; :class:`ProgramError` with ``file:line`` where it cannot be laid."""
    return lay_path(load_program(program, dialect, start=start), limits)


def limits_of(machine: Machine) -> Limits:
    """Give the travel [m] and the largest feed [m/s] of a machine template."""
    units = {"x_low": "m", "x_high": "m", "z_low": "m", "z_high": "m", "feed": "m/s"}
    written = {name: getattr(machine.settings.travel, name) for name in units}
    return Limits(**{name: _value(machine, ("travel", name), text, units[name]) for name, text in written.items() if text is not None})


def start_of(machine: Machine, lesson: Lesson | None = None) -> tuple[float, float] | None:
    """Give the start point (x, z) [m] of a lesson or of its machine template, or none where both leave it to the dialect."""
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
    """Give about how long a path table takes [s], with every block at its programmed speed and rapids at ``rapid_speed`` [m/s].

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
