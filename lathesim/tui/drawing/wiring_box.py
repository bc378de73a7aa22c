"""A part as a box: what feeds it at the left, what takes from it at the right."""

from __future__ import annotations

from lathesim.component import Input, Output, Parameter
from lathesim.lessons.simulate import Prepared


def wiring_box(case: Prepared, part: str, width: int) -> str:
    """Return the drawing of a part, at most ``width`` characters wide: inputs with their sources, outputs with all they feed, and units."""
    component = case.plan.parts[part].component
    declared = component.declarations
    left = []
    for item, declaration in declared.items():
        feeding = case.plan.feeds.get(f"{part}.{item}")
        if isinstance(declaration, Input) or (isinstance(declaration, Parameter) and feeding is not None):
            source = feeding[1] if feeding is not None else ""
            source = "constant" if source == f"{part}.{item}" or not source else source
            left.append((source, f"{item} [{declaration.unit}]"))
    right = []
    for item, declaration in declared.items():
        if isinstance(declaration, Output):
            targets = [wire.target for wire in case.machinery.wires if wire.source == f"{part}.{item}"]
            first, *others = targets or ["not wired"]
            right.append((f"{item} [{declaration.unit}]", first))
            right += [("", other) for other in others]
    sources = max((len(source) for source, _ in left), default=0)
    names = max((len(name) for _, name in left), default=0)
    outs = max((len(name) for name, _ in right), default=0)
    inner = max(names + outs + 3, len(part) + 2, len(component.__name__) + 2)
    rows = [f"{'':{sources}}   ┌{'─' * inner}┐", f"{'':{sources}}   │{part.center(inner)}│"]
    rows += [f"{'':{sources}}   │{component.__name__.center(inner)}│", f"{'':{sources}}   ├{'─' * inner}┤"]
    for place in range(max(len(left), len(right))):
        source, name = left[place] if place < len(left) else ("", "")
        out, target = right[place] if place < len(right) else ("", "")
        arrow_in = "──>" if name else "   "
        arrow_out = "──> " if target and out else "└─> " if target else ""
        rows.append(f"{source:>{sources}}{arrow_in}│{name}{out:>{inner - len(name)}}│{arrow_out}{target}")
    rows.append(f"{'':{sources}}   └{'─' * inner}┘")
    return "\n".join(row.rstrip()[:width] for row in rows)
