"""What a part of a machine is for, read off the roles of its ports and off the wiring."""

from __future__ import annotations

from collections.abc import Sequence

from lathesim.component import Component, Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Assembly, Part, Place


def decides(component: type[Component]) -> bool:
    """Return whether a part is a controller or a converter: it takes a measurement or a command and gives a command."""
    return "drive" in component.ports and "measured" in component.ports


def closes_a_loop(part: Part) -> bool:
    """Return whether a part decides on what it measures of what it drives."""
    return decides(part.component) and part.component.ports["drive"] != part.component.ports["measured"]


def acting(assembly: Assembly) -> list[tuple[str, str]]:
    """Return for each moving part the output that pushes it: (``part.input``, ``part.output``)."""
    found = []
    for part in assembly.parts:
        ports = part.component.ports
        target = f"{part.name}.{ports.get('drive', '')}"
        if not ("effort" in ports and "flow" in ports and assembly.sources.get(target)):
            continue
        # a part that holds its motor takes a voltage, and tells the force that this comes to
        own = isinstance(part.component.declarations.get(ports.get("applied", "")), Output)
        found.append((target, f"{part.name}.{ports['applied']}" if own else assembly.sources[target]))
    return found


def commands(assembly: Assembly) -> dict[str, str]:
    """Return by part the output that a drive, an amplifier or a table takes its command from."""
    found = {}
    for part in assembly.parts:
        ports = part.component.ports
        source = assembly.sources.get(f"{part.name}.{ports.get('drive', '')}", "")
        if source and not issubclass(part.component, Effect) and "measured" not in ports:
            found[part.name] = source
    return found


def is_led(component: type[Component]) -> bool:
    """Return whether a part has the motion that its reference gives, whatever pushes it."""
    return {"reference_rate", "displacement", "flow"} <= set(component.ports) and "drive" not in component.ports


SENSED = "sensed_"
"""Beginning of the parts of a replay that say how much of the recorded motion an input senses."""


def is_sensed_share(name: str) -> bool:
    """Return whether a parameter says how much of the recorded motion an input senses."""
    return name.startswith(SENSED)


def inputs_of_readings(component: type[Component], readings: Sequence[str]) -> list[str]:
    """Return the inputs of a sensor of several channels that some of its readings show: that of ``main`` is ``main_force``."""
    return [name for name in component.declared(Input) if name.startswith(tuple(readings))]


def is_of_machine(part: str) -> bool:
    """Return whether a part, by its name in a replay, is the machine's own and was not put in: a candidate, or what stands for a sensor."""
    return not part.startswith(("try_", "sight_", "rounded_"))


def is_recorded_signal(part: str) -> bool:
    """Return whether a part, by its name in a replay, stands for a recorded signal or for a candidate that was tried."""
    return part.startswith(("try_", "recorded_", "motion_"))


def is_signal(part: str) -> bool:
    """Return whether a part, by its name in a replay, gives a signal: recorded, of the motion, of a command, or of a converter's steps."""
    return part.startswith(("recorded_", "motion_", "followed_", "rounding_", SENSED))


def comes_from_effect(source: str) -> bool:
    """Return whether a wire's source is the output of an effect, by the name that the contract of effects gives it."""
    return source.endswith(".outgoing")


def behind_effects(assembly: Assembly, target: str) -> str:
    """Return the output that feeds an input, or the effects on its way; empty where there is none."""
    source = assembly.sources.get(target, "")
    part = assembly.by_name.get(Place.of(source).part)
    passes = part is not None and comes_from_effect(source) and "incoming" in part.component.declared(Input)
    return behind_effects(assembly, f"{Place.of(source).part}.incoming") if passes else source


def goes_to_effect(target: str) -> bool:
    """Return whether a wire's target is the input of an effect, by the name that the contract of effects gives it."""
    return target.endswith(".incoming")


def readings_of(component: type[Component]) -> tuple[str, ...]:
    """Return the outputs of a sensor that are readings, by their roles."""
    return tuple(port for role, port in component.ports.items() if role.endswith("reading"))


def further_readings_of(component: type[Component]) -> tuple[str, ...]:
    """Return the readings of a sensor beside its first one."""
    return tuple(port for role, port in component.ports.items() if role.endswith("_reading"))


def start_values(component: type[Component]) -> tuple[str, ...]:
    """Return the parameters of a part that are values at its start, by their names."""
    return tuple(name for name in component.declared(Parameter) if name.startswith("start_"))
