"""The choice of channels, with unit and description, found by typing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Button, Input, SelectionList
from textual.widgets.selection_list import Selection

from lathesim.tui.widgets.tick_list import TickList


class ChannelChoice(ModalScreen[tuple[str, ...] | None]):
    """Gives the names chosen, or None where the dialog was left."""

    BINDINGS = [Binding("escape", "dismiss(None)", "Cancel"), Binding("ctrl+s", "take", "Use")]

    def __init__(self, known: Mapping[str, tuple[str, str]], chosen: Sequence[str]) -> None:
        super().__init__()
        self._known = dict(known)
        self._chosen = list(chosen)

    def compose(self) -> ComposeResult:
        """Return a field to search in, the list, and two buttons."""
        with Vertical(classes="dialog"):
            yield Input(placeholder="Type to find a channel", id="wanted", compact=True)
            yield TickList[str](id="channels")
            with Horizontal(classes="buttons"):
                yield Button("Use", variant="primary", id="take", compact=True)
                yield Button("Cancel", id="leave", compact=True)

    def on_mount(self) -> None:
        """Fill the list."""
        self._fill("")

    @on(Input.Changed, "#wanted")
    def _search(self, event: Input.Changed) -> None:
        self._fill(event.value.lower())

    def _fill(self, wanted: str) -> None:
        listed = self.query_one(SelectionList)
        with self.prevent(SelectionList.SelectedChanged):
            listed.clear_options()
            for name, (unit, doc) in self._known.items():
                if wanted in name.lower() or wanted in doc.lower():
                    text = Text.assemble((name, "bold"), f" [{unit}] ", (doc, "dim"))
                    listed.add_option(Selection(text, name, name in self._chosen))

    @on(SelectionList.SelectionToggled)
    def _toggle(self, event: SelectionList.SelectionToggled[str]) -> None:
        name = str(event.selection.value)
        if name in self._chosen:
            self._chosen.remove(name)
        else:
            self._chosen.append(name)

    @on(Input.Submitted, "#wanted")
    def _to_list(self) -> None:
        self.query_one(SelectionList).focus()

    @on(Button.Pressed, "#take")
    def action_take(self) -> None:
        """Close the dialog with the names chosen."""
        self.dismiss(tuple(self._chosen))

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)
