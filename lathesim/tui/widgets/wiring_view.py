"""The wiring of a part, drawn anew in every width."""

from __future__ import annotations

from textual.widgets import Static

from lathesim.component import Input, Output, Parameter
from lathesim.lessons.simulate import Prepared


def wiring_box(case: Prepared, part: str, width: int) -> str:
    """Return the drawing of a part: inputs with their sources, outputs with all they feed, and units.

    Where ``width`` characters do not hold the sources, the box and what it feeds beside each other, they stand one below the other.
    """
    component = case.plan.parts[part].component
    left, right = _inputs(case, part), _outputs(case, part)
    sources = max((len(source) for source, _ in left), default=0)
    targets = max((len(target) for _, target in right), default=0)
    inner = max(_longest(left) + max((len(out) for out, _ in right), default=0) + 3, len(part) + 2, len(component.__name__) + 2)
    if sources + 3 + inner + 2 + 4 + targets <= width:
        return _beside(part, component.__name__, left, right, sources, inner)
    return _below(part, component.__name__, left, right, width)


def _inputs(case: Prepared, part: str) -> list[tuple[str, str]]:
    """Return source and name with unit of each input, and of each parameter that a wire feeds."""
    found = []
    for item, declaration in case.plan.parts[part].component.declarations.items():
        feeding = case.plan.feeds.get(f"{part}.{item}")
        if isinstance(declaration, Input) or (isinstance(declaration, Parameter) and feeding is not None):
            source = feeding[1] if feeding is not None else ""
            source = "constant" if source == f"{part}.{item}" or not source else source
            found.append((source, f"{item} [{declaration.unit}]"))
    return found


def _outputs(case: Prepared, part: str) -> list[tuple[str, str]]:
    """Return name with unit and target of each wire that leaves a part; the name is left out where it stands in the row above."""
    found = []
    for item, declaration in case.plan.parts[part].component.declarations.items():
        if isinstance(declaration, Output):
            targets = [wire.target for wire in case.machinery.wires if wire.source == f"{part}.{item}"]
            first, *others = targets or ["not wired"]
            found.append((f"{item} [{declaration.unit}]", first))
            found += [("", other) for other in others]
    return found


def _longest(left: list[tuple[str, str]]) -> int:
    return max((len(name) for _, name in left), default=0)


def _beside(part: str, component: str, left: list[tuple[str, str]], right: list[tuple[str, str]], sources: int, inner: int) -> str:
    rows = [f"{'':{sources}}   ┌{'─' * inner}┐", f"{'':{sources}}   │{part.center(inner)}│"]
    rows += [f"{'':{sources}}   │{component.center(inner)}│", f"{'':{sources}}   ├{'─' * inner}┤"]
    for place in range(max(len(left), len(right))):
        source, name = left[place] if place < len(left) else ("", "")
        out, target = right[place] if place < len(right) else ("", "")
        arrow_in = "──>" if name else "   "
        arrow_out = "──> " if target and out else "└─> " if target else ""
        rows.append(f"{source:>{sources}}{arrow_in}│{name}{out:>{inner - len(name)}}│{arrow_out}{target}")
    rows.append(f"{'':{sources}}   └{'─' * inner}┘")
    return "\n".join(row.rstrip() for row in rows)


def _below(part: str, component: str, left: list[tuple[str, str]], right: list[tuple[str, str]], width: int) -> str:
    inner = min(max(len(part), len(component)) + 4, width - 2)
    names = max((len(name) for name, _ in right), default=0)
    rows = [f"{name:<{_longest(left)}} <── {source}" for source, name in left]
    rows += [f"┌{'─' * inner}┐", f"│{part.center(inner)}│", f"│{component.center(inner)}│", f"└{'─' * inner}┘"]
    rows += [f"{name:<{names}} {'──>' if name else '└─>'} {target}" for name, target in right]
    return "\n".join(row.rstrip() for row in rows)


class WiringView(Static):
    """A part as a box with what feeds it and what it feeds."""

    DEFAULT_CSS = """
    WiringView { width: 1fr; padding: 0 1; }
    """

    def __init__(self, id: str | None = None) -> None:
        super().__init__("Choose a part to see its wiring.", id=id, markup=False)
        self._shown: tuple[Prepared, str] | None = None

    def show(self, case: Prepared, part: str) -> None:
        """Show the wiring of a part of a machine; no part where it is empty."""
        self._shown = (case, part) if part else None
        self._draw()

    def on_resize(self) -> None:
        """Draw anew in another width."""
        self._draw()

    def _draw(self) -> None:
        width = self.size.width or self.app.size.width
        self.update(wiring_box(*self._shown, width) if self._shown is not None else "Choose a part to see its wiring.")
