"""The position loops of a lesson's machine: its axes, with their controllers, sensors and converters, found by their wires."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lathesim.component import Parameter
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Assembly, Part, Place
from lathesim.errors import LessonError
from lathesim.lessons.sensor_sides import SeenBeyond


@dataclass(frozen=True)
class Loop:
    """A position loop: the part that controls an axis, what feeds its reference and its reading, and the parts on the way to the axis.

    ``reference`` and ``reading`` are outputs ``part.name``; ``axis`` is the part that moves, ``sensor`` the one whose reading closes the
    loop, ``converter`` the one that holds the command, empty where there is none. ``beyond`` is a sensor of the same axis that closes no
    loop: a scale at the table; where the one that closes it is at the load, it is that one.
    """

    controller: str
    reference: str
    reading: str
    axis: str
    sensor: str
    converter: str
    beyond: str
    parts: frozenset[str]
    """Parts that belong to it: those named, and whatever the command passes on its way to the axis."""

    @property
    def table(self) -> str:
        """The output that shows where the table is: that of the scale, else of the axis."""
        return self.beyond or f"{self.axis}.position"


def loops_of(assembly: Assembly) -> tuple[Loop, ...]:
    """Return the position loops of a machine: every part that compares a position asked for with a measured one and drives an axis.

    Where there is none, they are the axes that follow what a part asks of them by themselves, as those with steppers do. Such a loop is
    never behind, has no sensor, and its ``controller`` is the input of the axis.
    """
    found = []
    for part in assembly.parts:
        ports = part.component.ports
        if issubclass(part.component, Effect) or not {"measured", "drive", "reading"} <= set(ports):
            continue
        declared = part.component.declarations
        if declared[ports["drive"]].unit != "m" or declared[ports["measured"]].unit != "m":
            continue
        loop = _loop(assembly, part)
        if loop is not None:
            found.append(loop)
    return tuple(found) or _led_axes(assembly)


def one_or_more(assembly: Assembly, place: str) -> tuple[Loop, ...]:
    """Return the position loops, or refuse (:class:`LessonError`) a machine that has none."""
    found = loops_of(assembly)
    if not found:
        raise LessonError(
            "no part of the machine controls the position of an axis.", place=place, remedy="Use a machine with a position controller."
        )
    return found


def _loop(assembly: Assembly, controller: Part) -> Loop | None:
    parts, ports = assembly.by_name, controller.component.ports
    asked, reading = (_fed(assembly, f"{controller.name}.{ports[role]}") for role in ("drive", "measured"))
    sensor = Place.of(reading).part
    axis = Place.of(_fed(assembly, f"{sensor}.measured")).part
    if axis not in parts or "effort" not in parts[axis].component.ports:
        return None
    at_load = sensor in parts and parts[sensor].side == "load"
    beyond = reading if at_load else _scale(assembly, axis, without=sensor)
    converter = _after(assembly, controller.name)
    own = {controller.name, axis, sensor, converter, Place.of(beyond).part} - {""}
    own |= _on_the_way(assembly.sources, controller.name, axis)
    return Loop(controller.name, asked, reading, axis, sensor, converter, beyond, frozenset(own))


def _led_axes(assembly: Assembly) -> tuple[Loop, ...]:
    found = []
    for part in assembly.parts:
        ports = part.component.ports
        if {"reference", "displacement", "effort"} <= set(ports) and part.component.declarations[ports["reference"]].unit == "m":
            place, scale = f"{part.name}.{ports['reference']}", _scale(assembly, part.name)
            if asked := _fed(assembly, place):
                reading = scale or f"{part.name}.{ports['displacement']}"
                found.append(Loop(place, asked, reading, part.name, "", "", scale, frozenset({part.name, Place.of(scale).part} - {""})))
    return tuple(found)


def _scale(assembly: Assembly, axis: str, without: str = "") -> str:
    """Return the reading of a sensor at the table of an axis, the last one where there are several; empty where there is none."""
    beyond = ""
    for part in assembly.parts:
        ports = part.component.ports
        if {"reading", "measured"} <= set(ports) and part.side != "motor" and part.name != without:
            other = _fed(assembly, f"{part.name}.{ports['measured']}")
            if Place.of(other).part == axis and part.component.declarations[ports["reading"]].unit == "m":
                beyond = f"{part.name}.{ports['reading']}"
    return beyond


def _fed(assembly: Assembly, target: str) -> str:
    """Return the output that feeds an input in the end, before the effects on its way; empty where there is none."""
    source = assembly.sources.get(target, "")
    part = assembly.by_name.get(Place.of(source).part)
    passes = part is not None and issubclass(part.component, (Effect, SeenBeyond))
    return _fed(assembly, f"{Place.of(source).part}.incoming") if passes else source


def _after(assembly: Assembly, name: str) -> str:
    """Return the converter that holds the command of a controller, or nothing."""
    for target in assembly.wired:
        part = Place.of(target).part
        if Place.of(_fed(assembly, target)).part != name or part not in assembly.by_name:
            continue
        component = assembly.by_name[part].component
        if "bits" in component.declared(Parameter) and component.ports.get("reading") == "voltage":
            return part
    return ""


def _on_the_way(wires: Mapping[str, str], controller: str, axis: str) -> set[str]:
    """Return the parts between a controller and its axis."""
    before, behind = dict[str, set[str]](), dict[str, set[str]]()
    for target, source in ((Place.of(target).part, Place.of(source).part) for target, source in wires.items() if source):
        before.setdefault(target, set()).add(source)
        behind.setdefault(source, set()).add(target)
    return (_reached(controller, behind, axis) & _reached(axis, before, controller)) - {controller}


def _reached(start: str, onward: Mapping[str, set[str]], end: str) -> set[str]:
    """Return the parts that one leads to, itself too, without one at which the way ends."""
    found, waiting = {start}, [start]
    while waiting:
        further = onward.get(waiting.pop(), set()) - found - {end}
        found |= further
        waiting += further
    return found


def level_of(assembly: Assembly, converter: str) -> float:
    """Return one level of a converter [V], 0 where there is none."""
    if converter not in assembly.by_name:
        return 0.0
    value = assembly.by_name[converter].values
    return float((value["largest_voltage"] - value["smallest_voltage"]) / (2.0 ** value["bits"] - 1.0))


def resolution_of(assembly: Assembly, sensor: str) -> float:
    """Return one count of a sensor [m], 0 where it measures exactly or nobody knows."""
    name = assembly.ports(sensor).get("resolution")
    return assembly.by_name[sensor].value(name) if name else 0.0
