"""A part program on a machine: from the file to the path, the raw stock, and warnings before a run."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path

from lathesim import path_columns as at
from lathesim.analysis.failed_run import RawStock
from lathesim.component import Input, Output, Parameter, State
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.wiring import Plan
from lathesim.lessons.case import Case
from lathesim.lessons.lesson import Lesson, MachineTemplate
from lathesim.lessons.part_values import si_in
from lathesim.lessons.sensor_sides import assumed_sides
from lathesim.program.moves import Program, Tool
from lathesim.program.path import Limits, lay_path
from lathesim.program.path import Path as ToolPath
from lathesim.program.program_checks import Bar, checked, meets_stock
from lathesim.program.program_file import load_program
from lathesim.units import in_unit


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
        found[number] = Tool(si_in(lesson.source, ("tools", number, "nose_radius"), entry.nose_radius, "m"), entry.orientation)
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


def limits_of(machine: MachineTemplate) -> Limits:
    """Return the travel [m] and the largest feed [m/s] of a machine template."""
    units = {"x_low": "m", "x_high": "m", "z_low": "m", "z_high": "m", "feed": "m/s"}
    written = {name: getattr(machine.settings.travel, name) for name in units}
    found = {name: si_in(machine.source, ("travel", name), text, units[name]) for name, text in written.items() if text is not None}
    return Limits(**found)


def start_of(machine: MachineTemplate, lesson: Lesson | None = None) -> tuple[float, float] | None:
    """Return the start point (x, z) [m] of a lesson or of its machine template, or none where both leave it to the dialect."""
    given = lesson if lesson is not None and lesson.settings.start_point is not None else machine
    point = given.settings.start_point
    if point is None:
        return None
    return si_in(given.source, ("start_point", "x"), point.x, "m"), si_in(given.source, ("start_point", "z"), point.z, "m")


def expected_time(table: FloatArray, rapid_speed: float) -> float:
    """Return about how long a path table takes [s], with every block at its programmed speed and rapids at ``rapid_speed`` [m/s].

    Left out: acceleration, and how process controllers and the spindle change the feed. It is for progress bars only.
    """
    total = 0.0
    for row in table:
        if row[at.KIND] == at.RAPID:
            speed = rapid_speed
        elif row[at.FEED_MODE] != at.PER_MINUTE:
            turns = abs(row[at.SPINDLE_SPEED]) / (2.0 * math.pi)
            if row[at.SPINDLE_MODE] == at.CONSTANT_SURFACE_SPEED:
                turns /= max(row[at.START_X], row[at.END_X], 1e-3)
            speed = row[at.FEED] * turns
        else:
            speed = row[at.FEED]
        total += row[at.DWELL] + (row[at.LENGTH] / speed if speed > 0.0 else 0.0)
    return float(total)


_MEASURES = ("stock_radius", "stock_length", "face")
_FURTHER = ("free_end", "edge_length")
_PLACES = ("x_position", "z_position")


def raw_stock(plan: Plan) -> RawStock | None:
    """Return the first part that has the measures of a stock and sees where the tool is; none where there is no such part."""
    for name, part in plan.parts.items():
        declared = part.component.declarations
        is_stock = all(isinstance(declared.get(item), Parameter) for item in _MEASURES)
        if is_stock and all(isinstance(declared.get(item), Input) for item in _PLACES):
            fed = {item: plan.feeds.get(f"{name}.{item}", ("parameter", f"{name}.{item}")) for item in (*_MEASURES, *_PLACES)}
            if all(fed[item][0] == "parameter" for item in _MEASURES) and all(fed[item][0] == "output" for item in _PLACES):
                values = {item: plan.values[fed[item][1]] for item in _MEASURES}
                known = [item for item in _FURTHER if f"{name}.{item}" in plan.parameters]
                values |= {item: plan.values[f"{name}.{item}"] for item in known}
                return RawStock(name, **values, x=fed["x_position"][1], z=fed["z_position"][1])
    return None


_SAME_PLACE = 1e-6
"""The largest distance of one place from another that counts as none [m], assumed: below what an encoder of a lathe tells."""


def run_warnings(case: Case, plan: Plan) -> tuple[str, ...]:
    """Return the warnings of a case, each once; those of program and axes only on a machine with a stock."""
    stock = raw_stock(plan)
    always = [*unread_drags(plan), *springs_with_assumed_sides(case, plan)]
    if stock is None:
        return tuple(always)
    return tuple(dict.fromkeys([*always, *program_warnings(case, stock), *starts_elsewhere(case, plan)]))


def unread_drags(plan: Plan) -> list[str]:
    """Return a sentence for each part with process damping whose output ``drag`` is not wired."""
    read = {source for kind, source in plan.feeds.values() if kind == "output"}
    return [
        f"{name}: its process damping acts on nothing. Wire the drag of a mode to {name}.drag."
        for name, part in plan.parts.items()
        if "drag" in part.component.declared(Output)
        and plan.values.get(f"{name}.process_damping", 0.0) > 0.0
        and f"{name}.drag" not in read
    ]


def springs_with_assumed_sides(case: Case, plan: Plan) -> list[str]:
    """Return a sentence for each part behind which a spring was put whose sensors do not say on which side of it they sit."""
    hosts = [Place.of(entry.entry.at).part for entry in case.insert if getattr(plan.parts[entry.part_name].component, "beyond", "")]
    return [sentence for host in dict.fromkeys(hosts) if (sentence := assumed_sides(plan.assembly, host))]


def starts_elsewhere(case: Case, plan: Plan) -> list[str]:
    """Return a sentence for each axis that does not stand where the program starts: it would step there at full voltage.

    An axis is the part that gives the tool's place to the stock. One whose only length among its states is its place is asked;
    machines without a stock, and axes with several lengths among their states, are left out.
    """
    program, stock = program_of(case), raw_stock(plan)
    if program is None or stock is None or not program.moves:
        return []
    first = program.moves[0]
    told = []
    for letter, channel, start in (("X", stock.x, first.start_x), ("Z", stock.z, first.start_z)):
        for state in _place_states(plan, channel):
            stands = plan.values[state]
            if abs(stands - start) > _SAME_PLACE:
                radius = " (radius)" if letter == "X" else ""
                told.append(
                    f"{program.name}: the program starts at {letter}{in_unit(start, 'mm', 'g')}{radius}, "
                    f"and the axis stands at {in_unit(stands, 'mm', 'g')}. "
                    f"Set {state}: {in_unit(start, 'mm', 'g')} in the lesson, or give start_point."
                )
    return told


def _place_states(plan: Plan, channel: str) -> Iterator[str]:
    """Yield the state of length of the part that gives a channel, where it has just one."""
    part = Place.of(channel).part
    lengths = [name for name, item in plan.parts[part].component.declarations.items() if isinstance(item, State) and item.unit == "m"]
    if len(lengths) == 1:
        yield f"{part}.{lengths[0]}"
