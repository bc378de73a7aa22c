"""Panes of a machine: the values of a part, and its wiring, drawn anew in every width."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from rich.text import Text
from textual import on
from textual.containers import Horizontal, Vertical
from textual.message import Message
from textual.widget import Widget
from textual.widgets import DataTable, Label, Static
from textual.widgets import Input as Field

from lathesim.analysis.display_unit import plain_name, pretty_quantities
from lathesim.component import Input, Output, Parameter
from lathesim.engine.assembly import Place
from lathesim.errors import LatheSimError
from lathesim.lessons.simulate import Prepared
from lathesim.tui.model.machine_tree import Entry
from lathesim.tui.model.workbench import fault_words


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
            first, *others = [wire.target for wire in case.machinery.wires if wire.source == f"{part}.{item}"] or ["not wired"]
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


_COLUMNS = ("", "name", "value", "default", "bounds", "what it is")


class ValuesPane(Vertical):
    """The values of a part as a table, one of them in a field to edit; what stands aside is folded into the last row.

    ``check`` returns the value that a typed text is taken as, or raises :class:`LatheSimError`.
    """

    DEFAULT_CSS = """
    ValuesPane { height: 1fr; }
    ValuesPane #entries { height: 1fr; }
    ValuesPane #edit { height: 1; }
    ValuesPane #edit Label { width: auto; padding: 0 1; }
    ValuesPane #value { width: 1fr; }
    ValuesPane #fault { height: auto; max-height: 3; padding: 0 1; }
    ValuesPane #fault.-wrong { color: $error; }
    """

    class ValueTaken(Message):
        """A person gave an entry another value, as text with its unit."""

        def __init__(self, entry: Entry, text: str) -> None:
            super().__init__()
            self.entry, self.text = entry, text

    def __init__(self, check: Callable[[Entry, str], str]) -> None:
        super().__init__()
        self._value_of = check
        self._entries: list[Entry] = []
        self._shows_aside = False
        """Whether what stands aside is unfolded."""

    def compose(self) -> Iterable[Widget]:
        """Return the table, the field, and what is said of its text."""
        yield DataTable[Any](id="entries", cursor_type="row", zebra_stripes=True)
        with Horizontal(id="edit"):
            yield Label("", id="edited", markup=False)
            yield Field(id="value", compact=True, disabled=True)
        yield Static("", id="fault", markup=False)

    def show(self, entries: Sequence[Entry]) -> None:
        """Show entries; those that stand aside come last."""
        self._entries = list(entries)
        table = self.query_one("#entries", DataTable)
        row = table.cursor_row
        table.clear(columns=True)
        table.add_columns(*_COLUMNS)
        aside = sum(entry.is_aside for entry in self._entries)
        for entry in self._entries[: None if self._shows_aside else len(self._entries) - aside]:
            sign = "*" if entry.changed else "~" if entry.fed else ""
            style = "bold" if entry.changed else "dim" if entry.is_aside else ""
            quantities = (pretty_quantities(text) for text in (entry.text, entry.default, entry.bounds))
            cells = (sign, plain_name(Place.of(entry.name).port or entry.name), *quantities, entry.doc)
            table.add_row(*(Text(cell, style=style) for cell in cells))
        if aside:
            more = f"{aside} start value{'s' * (aside > 1)} and wired inputs"
            table.add_row(Text("▾" if self._shows_aside else "▸"), Text(more, style="dim"), *[""] * (len(_COLUMNS) - 2))
        if table.row_count:
            table.move_cursor(row=min(row, table.row_count - 1))
        self._show_edited()

    @property
    def entry(self) -> Entry | None:
        """What the cursor of the table stands on."""
        row = self.query_one("#entries", DataTable).cursor_row
        return self._entries[row] if 0 <= row < len(self._entries) and not self._is_fold(row) else None

    def _is_fold(self, row: int) -> bool:
        """Return whether a row of the table folds what stands aside, or unfolds it."""
        table = self.query_one("#entries", DataTable)
        return any(entry.is_aside for entry in self._entries) and row == table.row_count - 1

    def focus_table(self) -> None:
        """Go to the table."""
        self.query_one("#entries", DataTable).focus()

    def go_to(self, name: str) -> None:
        """Go to the entry of this name, unfolded where it stands aside."""
        row = next((place for place, entry in enumerate(self._entries) if entry.name == name), 0)
        self._shows_aside = bool(self._entries) and self._entries[row].is_aside
        self.show(self._entries)
        self.query_one("#entries", DataTable).move_cursor(row=row)
        self.focus_table()

    def say(self, fault: str) -> None:
        """Show a sentence about what is at fault."""
        self._tell(None, fault)

    @on(DataTable.RowHighlighted, "#entries")
    def _show_edited(self) -> None:
        entry, field = self.entry, self.query_one("#value", Field)
        label, table = self.query_one("#edited", Label), self.query_one("#entries", DataTable)
        with self.prevent(Field.Changed):
            if entry is None:
                label.update("Enter shows or hides them." if table.row_count else "nothing to set")
                field.value, field.disabled = "", True
            elif entry.fed:
                label.update(f"{entry.name} comes by a wire from {entry.fed}")
                field.value, field.disabled = "", True
            else:
                label.update(f"{entry.name} =")
                field.value, field.disabled = entry.text, False
        self._tell(entry, "")

    @on(DataTable.RowSelected, "#entries")
    def _edit(self) -> None:
        field = self.query_one("#value", Field)
        if self._is_fold(self.query_one("#entries", DataTable).cursor_row):
            self._shows_aside = not self._shows_aside
            self.show(self._entries)
        elif not field.disabled:
            field.focus()

    @on(Field.Changed, "#value")
    def _check(self, event: Field.Changed) -> None:
        self._taken(event.value)

    def _taken(self, typed: str) -> str | None:
        """Return the typed text as a value, and show below the field the value taken, or the fault."""
        entry = self.entry
        if entry is None:
            return None
        try:
            text = self._value_of(entry, typed)
        except LatheSimError as error:
            self._tell(entry, fault_words(error))
            return None
        self._tell(entry, "", "" if text == typed.strip() else f"Taken as {text}. ")
        return text

    def _tell(self, entry: Entry | None, fault: str, taken: str = "") -> None:
        """Show below the field the fault of the text, or else the value taken, the description of the entry and its bounds."""
        bounds = f" ({entry.bounds})" if entry is not None and entry.bounds else ""
        words = f"✗ {fault}" if fault else f"{taken}{entry.doc}{bounds}" if entry is not None else ""
        self.query_one("#fault", Static).update(words)
        self.query_one("#fault", Static).set_class(bool(fault), "-wrong")

    @on(Field.Submitted, "#value")
    def _take(self, event: Field.Submitted) -> None:
        entry = self.entry
        text = self._taken(event.value)
        if entry is None or text is None:
            return
        if text != entry.text:
            self.post_message(self.ValueTaken(entry, text))
        self.focus_table()
