"""The page of an effect: what is known about it beside its declarations."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from lathesim.component import Input
from lathesim.manual.component_page import plain_unit

if TYPE_CHECKING:
    from lathesim.effects.effect import Effect

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


def effect_notes(effect: type[Effect], width: int = 110) -> str:
    """Return what is known about an effect, for its page, in lines of so many characters at most."""
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
