"""Which controllers close a loop around an axis: by the roles that the parts declare and the wires between them, never by their names."""

from __future__ import annotations

from lathesim.component import Component, Input, Output
from lathesim.engine.assembly import Place
from lathesim.engine.wiring import Plan


def is_controller(component: type[Component]) -> bool:
    """Return whether a part drives something by what it measures: it has the roles ``measured`` and ``drive``, on two inputs."""
    ports = component.ports
    return "measured" in ports and "drive" in ports and ports["measured"] != ports["drive"]


def loops_around(plan: Plan, part: str) -> tuple[str, ...]:
    """Return the controllers that measure an axis, in the order of the machine.

    ``part`` is the axis, a controller of it, or a part that reads it. Cross couplings are no loops of one axis and are left out.
    """
    axes = _axes_behind(plan, part)
    controllers = [name for name, other in plan.parts.items() if is_controller(other.component)]
    return tuple(name for name in controllers if axes & _axes_behind(plan, name))


def loops_leading(plan: Plan, part: str) -> tuple[str, ...]:
    """Return the controllers around a part first, then those whose axes lead it by the wires, as a spindle leads a feed per revolution."""
    around = loops_around(plan, part)
    waiting, passed = [part, *around], dict[str, None]()
    while waiting:
        name = waiting.pop()
        if name not in passed:
            passed[name] = None
            waiting += [source for item in plan.parts[name].component.declared(Input) if (source := _source(plan, f"{name}.{item}"))]
    return around + tuple(
        name for name in plan.parts if name in passed and name not in around and is_controller(plan.parts[name].component)
    )


def commands_of_loops(plan: Plan) -> tuple[str, ...]:
    """Return the recorded outputs ``part.name`` with which controllers drive."""
    readings = [f"{name}.{part.component.ports.get('reading', '')}" for name, part in plan.parts.items() if is_controller(part.component)]
    return tuple(name for name in readings if name in plan.channels)


def _axes_behind(plan: Plan, part: str) -> frozenset[str]:
    """Return the parts that move and whose motion reaches ``part``; a controller is reached by what it measures."""
    waiting, passed, axes = [part], set(), set()
    while waiting:
        name = waiting.pop()
        if name in passed:
            continue
        passed.add(name)
        component = plan.parts[name].component
        if any(
            isinstance(component.declarations[component.ports[role]], Output)
            for role in ("displacement", "flow")
            if role in component.ports
        ):
            axes.add(name)
        elif not is_controller(component):
            waiting += [source for item in component.declared(Input) if (source := _source(plan, f"{name}.{item}"))]
        elif name == part and (source := _source(plan, f"{name}.{component.ports['measured']}")):
            waiting.append(source)
    return frozenset(axes)


def _source(plan: Plan, target: str) -> str:
    kind, name = plan.feeds[target]
    return Place.of(name).part if kind == "output" else ""
