"""Warnings before a run: rapids into the stock, missing noses, axes that do not stand at the start of the program, a drag without a wire,
sensors on an unknown side of a spring."""

from __future__ import annotations

from collections.abc import Iterator

from lathesim.component import Output, State
from lathesim.engine.assembly import Place
from lathesim.engine.wiring import Plan
from lathesim.lessons.case import Case
from lathesim.lessons.program_path import program_of, program_warnings
from lathesim.lessons.raw_stock import raw_stock
from lathesim.lessons.sensor_sides import assumed_sides
from lathesim.units import in_unit

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
        and (at := plan.parameters.get(f"{name}.process_damping")) is not None
        and plan.parameter_values[at] > 0.0
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
            stands = plan.start_states[plan.states[state]]
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
