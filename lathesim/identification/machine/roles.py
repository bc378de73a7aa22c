"""What a part of a machine is for, read off the roles of its ports and off the wiring."""

from __future__ import annotations

from lathesim.component import Component, Output
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Assembly, Part


def decides(component: type[Component]) -> bool:
    """Return whether a part is a controller or a converter: it takes a measurement or a command and gives a command."""
    return "drive" in component.ports and "measured" in component.ports


def closes_a_loop(part: Part) -> bool:
    """Return whether a part decides on what it measures of what it drives."""
    return decides(part.component) and part.component.ports["drive"] != part.component.ports["measured"]


def acting(assembly: Assembly) -> list[tuple[str, str]]:
    """Return for each moving part the output that pushes it: (``part.input``, ``part.output``)."""
    sources = {item.target: item.source for item in assembly.wires}
    found = []
    for part in assembly.parts:
        ports = part.component.ports
        target = f"{part.name}.{ports.get('drive', '')}"
        if not ("effort" in ports and "flow" in ports and sources.get(target)):
            continue
        # a part that holds its motor takes a voltage, and tells the force that this comes to
        own = isinstance(part.component.declarations.get(ports.get("applied", "")), Output)
        found.append((target, f"{part.name}.{ports['applied']}" if own else sources[target]))
    return found


def commands(assembly: Assembly) -> dict[str, str]:
    """Return by part the output that a drive, an amplifier or a table takes its command from."""
    sources = {item.target: item.source for item in assembly.wires}
    found = {}
    for part in assembly.parts:
        ports = part.component.ports
        source = sources.get(f"{part.name}.{ports.get('drive', '')}", "")
        if source and not issubclass(part.component, Effect) and "measured" not in ports:
            found[part.name] = source
    return found
