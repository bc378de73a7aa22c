"""The page of a part or an effect as text, what plug-ins gave of them, and whether a plug-in file can be used."""

from __future__ import annotations

import inspect
import math
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from lathesim.component import Component, DiscreteState, Input, Memory, Noise, Output, Parameter, State, Table
from lathesim.errors import PluginError
from lathesim.plugins import KINDS, Registry, load_registry

if TYPE_CHECKING:
    from lathesim.effects.effect import Effect


_GROUPS: tuple[tuple[str, type], ...] = (
    ("Inputs", Input),
    ("Outputs", Output),
    ("Parameters", Parameter),
    ("States (integrated)", State),
    ("States (sampled)", DiscreteState),
    ("Memories", Memory),
    ("Tables", Table),
    ("Noise", Noise),
)


def first_sentence(component: type[Component]) -> str:
    """Return the first line of what the class says about itself."""
    text = _said(component)
    return text.splitlines()[0] if text else ""


def component_page(component: type[Component], origin: str) -> str:
    """Return the page of a component."""
    lines = [component.__name__, "=" * len(component.__name__), "", _said(component), ""]
    for title, kind in _GROUPS:
        rows = [_row(name, item) for name, item in component.declarations.items() if type(item) is kind]
        if rows:
            lines += [title, *_aligned(rows), ""]
    if component.laws:
        lines += ["Laws", *(f"  {name}({', '.join(arguments)})" for name, arguments in component.arguments.items()), ""]
    if component.ports:
        lines += ["Ports by role, for effects and metrics", *(f"  {role}: {name}" for role, name in component.ports.items()), ""]
    return "\n".join([*lines, f"From {origin}."])


def _said(component: type[Component]) -> str:
    """Return what the class says about itself, without the marks that its documentation is set with."""
    return re.sub(r":\w+:`~?([^`]+)`|``(.+?)``", lambda found: found[1] or f"'{found[2]}'", inspect.getdoc(component) or "", flags=re.S)


def _row(name: str, item: object) -> tuple[str, str, str, str]:
    unit = f"[{plain_unit(getattr(item, 'unit', '1'))}]"
    doc = str(getattr(item, "doc", ""))
    value = ""
    if isinstance(item, Parameter):
        value = f"{item.default:g}{_bounds(item)}"
    elif isinstance(item, Input):
        value = "must be wired" if item.default is None else f"{item.default:g} where unwired" if item.shown else "may be unwired"
    elif isinstance(item, (State, Memory)):
        value = f"starts at {item.start:g}" if getattr(item, "shown", True) else ""
    elif isinstance(item, Table):
        value = f"{len(item.columns)} columns"
    return name, unit, value, doc


def plain_unit(unit: str) -> str:
    """Return a unit without the braces in which an effect names the units of what it sits on."""
    return unit.translate({ord("{"): None, ord("}"): None})


def _bounds(item: Parameter) -> str:
    if math.isinf(item.low) and math.isinf(item.high):
        return ""
    if math.isinf(item.high):
        return f" (at least {item.low:g})"
    return f" (at most {item.high:g})" if math.isinf(item.low) else f" ({item.low:g} to {item.high:g})"


def _aligned(rows: Iterable[tuple[str, str, str, str]]) -> list[str]:
    rows = list(rows)
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    return ["  " + "  ".join([*(row[column].ljust(widths[column]) for column in range(3)), row[3]]).rstrip() for row in rows]


_EXAMPLE_HOST = {"measured": "x_encoder", "reading": "x_encoder", "force": "cutting_force", "flow": "spindle"}
_EXAMPLE_SOURCES = {
    "angle": "spindle.angle",
    "spindle_speed": "spindle.speed",
    "other_position": "z_axis.position",
    "force": "cutting_force.radial_force",
    "distance": "z_axis.position",
    "other_force": "cutting_force.radial_force",
}
"""What an effect may sense that its host does not have, on the two-axis lathe."""


def _example_host(effect: type[Effect]) -> str:
    """Return the part of the two-axis lathe an effect is usually put on."""
    for start in ("Tachometer", "Dynamometer"):
        if effect.__name__.startswith(start):
            return "dynamometer_adc" if start == "Dynamometer" else "tachometer"
    return _EXAMPLE_HOST.get(effect.site, "x_axis")


def effect_page(effect: type[Effect], origin: str, width: int = 110) -> str:
    """Return the page of an effect: that of a component, and what is known about it in lines of so many characters at most."""
    return f"{component_page(effect, origin)}\n\n{_effect_notes(effect, width)}"


def _effect_notes(effect: type[Effect], width: int) -> str:
    neutral = ", ".join(f"{name} = {value:g} {plain_unit(effect.declarations[name].unit)}" for name, value in effect.neutral.items())
    rows = [
        ("Catalogue", str(effect.catalogue) if effect.catalogue else "outside it"),
        ("Family", effect.family),
        ("Sits on", f"the port '{effect.site}' of a part"),
        ("Vanishes with", neutral),
        ("Fingerprint", effect.fingerprint),
        ("Confused with", "; ".join(effect.confused_with) or "nothing known"),
        ("Told apart by", effect.experiment),
        ("Source", effect.source),
    ]
    senses = "".join(f", {name}: {_EXAMPLE_SOURCES[name]}" for name in effect.declared(Input) if name in _EXAMPLE_SOURCES)
    example = f"insert: [{{effect: {effect.__name__}, at: {_example_host(effect)}{senses}}}]"
    if effect.placeholders():
        rows.insert(3, ("Units", "'signal' is the unit of what the wire carries, 'flow' and the like that of the port of this role"))
    own = [name for name in dict.fromkeys((*effect.identification.nuisance, *effect.identification.history)) if name in effect.declarations]
    if own:
        rows.insert(
            next(place for place, (title, _) in enumerate(rows) if title == "Fingerprint"),
            ("Fitted anew", f"in each recording: {', '.join(own)}"),
        )
    lines = [textwrap.fill(text, width, initial_indent=f"{title:<14} ", subsequent_indent=" " * 15) for title, text in rows]
    return "\n".join([*lines, f"{'In a lesson':<14} {example}"])


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
    """Return in words that a plug-in file or folder can be used; raises :class:`PluginError` with a line for each fault."""
    registry = load_registry([path], installed=False)
    registry.ask()
    for name in registry.plugins:
        if name.endswith(".fmu"):
            registry.component(Path(name).name)
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
