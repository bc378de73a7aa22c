"""The page of a component or an effect, as text: what it does, and every declared name with unit, default and bounds."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Iterable

from lathesim.component import Component, DiscreteState, Input, Memory, Noise, Output, Parameter, State, Table

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
        lines += ["Ports for effects", *(f"  {role}: {name}" for role, name in component.ports.items()), ""]
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
