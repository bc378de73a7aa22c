"""Dialogs that choose a component for a place, or an effect and the place it sits on."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Button, Input, Label, OptionList, Static
from textual.widgets.option_list import Option

from lathesim.component import Component
from lathesim.manual.component_page import component_page
from lathesim.tui.widgets.browse_list import BrowseList


class PartChoice(ModalScreen[tuple[str, str] | None]):
    """Gives the name of the class chosen and the place; None where the dialog was left.

    ``origins`` tells where each comes from; those of plug-ins are marked. With a ``place`` of None no place is asked for; ``propose`` gives
    one for the class that is looked at.
    """

    BINDINGS = [Binding("escape", "dismiss(None)", "Cancel")]
    DEFAULT_CSS = """
    PartChoice .dialog { width: 96%; max-width: 130; height: 90%; padding: 0 1; }
    PartChoice #found { width: 36; height: 1fr; }
    PartChoice .columns { height: 1fr; }
    """

    def __init__(
        self,
        title: str,
        found: Mapping[str, type[Component]],
        origins: Mapping[str, str],
        *,
        present: str = "",
        place: str | None = None,
        propose: Callable[[type[Component]], str] | None = None,
    ) -> None:
        super().__init__()
        self._title, self._found, self._origins, self._present, self._place = title, dict(found), origins, present, place
        self._listed: list[str] = []
        self._propose = propose

    def compose(self) -> ComposeResult:
        """Return a field to search in, the list, the page of what is looked at, and two buttons."""
        with Vertical(classes="dialog"):
            yield Label(self._title, markup=False)
            yield Input(placeholder="type to find", id="wanted", compact=True)
            with Horizontal(classes="columns"):
                yield BrowseList(id="found")
                with VerticalScroll():
                    yield Static("", id="page", markup=False)
            if self._place is not None:
                yield Label("Place: a part, or part.name")
                yield Input(self._place, id="place", compact=True)
            with Horizontal(classes="buttons"):
                yield Button("Use", variant="primary", id="take", compact=True)
                yield Button("Cancel", id="leave", compact=True)

    def on_mount(self) -> None:
        """Fill the list and look at it."""
        self._fill("")
        self.query_one(BrowseList).focus()

    def _fill(self, wanted: str) -> None:
        listed = self.query_one(BrowseList)
        listed.clear_options()
        self._listed = [name for name, item in self._found.items() if wanted in name.lower() or wanted in (item.__doc__ or "").lower()]
        for name in self._listed:
            own = "" if self._origins.get(name, "").startswith("lathesim.") else " (plug-in)"
            listed.add_option(Option(Text(f"{'>' if name == self._present else ' '} {name}{own}")))
        if self._listed:
            listed.highlighted = self._listed.index(self._present) if self._present in self._listed else 0

    @on(Input.Changed, "#wanted")
    def _search(self, event: Input.Changed) -> None:
        self._fill(event.value.lower())

    @on(Input.Submitted, "#wanted")
    def _to_list(self) -> None:
        self.query_one(BrowseList).focus()

    @on(OptionList.OptionHighlighted)
    def _look(self, event: OptionList.OptionHighlighted) -> None:
        name = self._listed[event.option_index]
        if self._propose is not None:
            self.query_one("#place", Input).value = self._propose(self._found[name])
        self.query_one("#page", Static).update(component_page(self._found[name], self._origins.get(name, "")))

    @on(OptionList.OptionSelected)
    @on(Button.Pressed, "#take")
    @on(Input.Submitted, "#place")
    def _take(self) -> None:
        place = self.query_one(BrowseList).highlighted
        if place is None:
            return
        at = self.query_one("#place", Input).value.strip() if self._place is not None else ""
        self.dismiss((self._listed[place], at))

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)
