"""Dialogs to choose from lists: a part and its place, a part program, channels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Button, Input, Label, OptionList, SelectionList, Static
from textual.widgets.option_list import Option
from textual.widgets.selection_list import Selection

from lathesim.component import Component
from lathesim.manual.component_page import component_page
from lathesim.shipped import shipped_folder
from lathesim.tui.widgets.controls import BrowseList, TickList
from lathesim.tui.widgets.program_listing import ProgramListing, program_lines


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


_ENDINGS = {".nc", ".ngc", ".tap", ".cnc", ".gcode", ".mpf", ".iso", ".txt"}


class ProgramChoice(ModalScreen[Path | None]):
    """Gives the file chosen; None where the dialog was left."""

    BINDINGS = [Binding("escape", "dismiss(None)", "Cancel")]
    DEFAULT_CSS = """
    ProgramChoice .dialog { width: 96%; max-width: 130; height: 90%; padding: 0 1; }
    ProgramChoice .columns { height: 1fr; }
    ProgramChoice #found { width: 40; height: 1fr; }
    ProgramChoice ProgramListing { width: 1fr; }
    """

    def __init__(self, beside: Path) -> None:
        super().__init__()
        folders = [Path("part_programs"), Path(), beside, shipped_folder("part_programs")]
        found: dict[Path, Path] = {}
        for folder in folders:
            if folder.is_dir():
                for path in sorted(folder.iterdir()):
                    if path.suffix.lower() in _ENDINGS and path.is_file():
                        found.setdefault(path.resolve(), path)
        self._paths = list(found.values())

    def compose(self) -> ComposeResult:
        """Return the list with a listing beside, a field for a path, and two buttons."""
        with Vertical(classes="dialog"):
            with Horizontal(classes="columns"):
                yield BrowseList(*[Option(Text(path.name)) for path in self._paths], id="found")
                yield ProgramListing()
            yield Label("or a path")
            yield Input(placeholder="programs/shaft.nc", id="path", compact=True)
            with Horizontal(classes="buttons"):
                yield Button("Use", variant="primary", id="take", compact=True)
                yield Button("Cancel", id="leave", compact=True)

    @on(OptionList.OptionHighlighted)
    def _look(self, event: OptionList.OptionHighlighted) -> None:
        self.query_one(ProgramListing).show(program_lines(self._paths[event.option_index]))

    @on(OptionList.OptionSelected)
    @on(Button.Pressed, "#take")
    @on(Input.Submitted, "#path")
    def _take(self) -> None:
        typed = self.query_one("#path", Input).value.strip()
        place = self.query_one(BrowseList).highlighted
        if typed:
            path = Path(typed).expanduser()
            if not path.is_file():
                self.notify(f"There is no file '{typed}'.", severity="error", markup=False)
                return
            self.dismiss(path)
        elif place is not None:
            self.dismiss(self._paths[place])

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)


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
