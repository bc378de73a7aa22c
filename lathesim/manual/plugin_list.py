"""Which plug-ins were loaded, what they gave, and whether a plug-in file is in order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from lathesim.component import Component
from lathesim.errors import PluginError
from lathesim.plugins import KINDS, Registry, load_registry


def plugin_lines(registry: Registry) -> list[str]:
    """Return how much of each kind there is, what of it came from plug-ins and from where, and the plug-ins that were loaded."""
    registry.ask()
    lines = []
    for word in KINDS:
        found = getattr(registry, word)
        guests = [name for name in found if not registry.origins[name].startswith("lathesim.")]
        lines.append(f"{len(found):>4} {word}" + (f", {len(guests)} of them from plug-ins:" if guests else ""))
        lines += [f"       {name:<30} {registry.origins[name]}" for name in guests]
    lines.append("Plug-ins loaded: " + (", ".join(registry.plugins) or "none besides the stock parts."))
    return lines


def checked_plugin(path: Path) -> str:
    """Return in words that a plug-in file or folder is in order; raises :class:`PluginError` with a line for each fault."""
    registry = load_registry([path], installed=False)
    registry.ask()
    if registry.problems:
        raise PluginError("\n".join(registry.problems))
    every = {**registry.components, **registry.effects}
    return "\n".join([f"{len(registry.plugins)} plug-in{'' if len(registry.plugins) == 1 else 's'} OK.", *without_vectors(every)])


def without_vectors(components: Mapping[str, type[Component]]) -> Iterator[str]:
    """Yield a line for each part of a plug-in that a batch of runs computes one run after the other, with the line of its law that is the
    reason. Stock parts have none: whoever checks a lesson cannot change them."""
    from lathesim.engine.lane_flat import refusal

    for name, component in components.items():
        if component.__module__.startswith("lathesim."):
            continue
        if place := next((found for function in component.laws.values() if (found := refusal(function))), ""):
            yield f"  {name}: a batch computes it one run after the other, because of {place}"
