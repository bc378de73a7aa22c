"""Dialogs to choose from lists: a part and its place, a file, channels."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets import Button, Input, Label, OptionList, SelectionList, Static
from textual.widgets.option_list import Option

from lathesim.component import Component
from lathesim.errors import LatheSimError
from lathesim.lessons.lesson import lesson_files
from lathesim.lessons.simulate import Prepared
from lathesim.manual.component_page import component_page
from lathesim.plugins import Registry
from lathesim.record import load
from lathesim.shipped import shipped_folder
from lathesim.tui.model.machine_tree import proposed_place
from lathesim.tui.model.workbench import fault_words
from lathesim.tui.screens.workbench_screen import Dialog, dialog_buttons
from lathesim.tui.widgets.controls import BrowseList, TickList
from lathesim.tui.widgets.program_listing import ProgramListing, program_lines


class PartChoice(Dialog[tuple[str, str] | None]):
    """Gives the name of the class chosen and the place; None where the dialog was left.

    ``origins`` tells where each comes from; those of plug-ins are marked. With a ``place`` of None no place is asked for; ``propose`` gives
    one for the class that is looked at.
    """

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
            yield dialog_buttons("Use", "Cancel")

    def on_mount(self) -> None:
        """Fill the list and look at it."""
        self._fill("")
        self.query_one(BrowseList).focus()

    def _fill(self, wanted: str) -> None:
        self._listed = [name for name, item in self._found.items() if wanted in name.lower() or wanted in (item.__doc__ or "").lower()]
        guests = [name for name in self._listed if not self._origins.get(name, "").startswith("lathesim.")]
        rows = (f"{'>' if name == self._present else ' '} {name}{' (plug-in)' if name in guests else ''}" for name in self._listed)
        listed = self.query_one(BrowseList)
        listed.fill(rows)
        if self._present in self._listed:
            listed.highlighted = self._listed.index(self._present)

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


def effect_choice(case: Prepared, registry: Registry, part: str) -> PartChoice:
    """Return the choice of an effect with its page, and of its place: at a part, or at the first that has the ports it sits on."""
    return PartChoice("Effect", registry.effects, registry.origins, place=part, propose=partial(proposed_place, case, chosen=part))


class FileChoice(Dialog[Path | None]):
    """Gives the file chosen, or the path typed, which need not exist; None where the dialog was left. ``show`` gives a file's lines."""

    DEFAULT_CSS = """
    FileChoice .dialog { width: 96%; max-width: 130; height: 90%; padding: 0 1; }
    FileChoice .columns { height: 1fr; }
    FileChoice #found { width: 40; height: 1fr; }
    FileChoice ProgramListing { width: 1fr; }
    """

    def __init__(self, title: str, paths: Sequence[Path], show: Callable[[Path], list[str]], placeholder: str) -> None:
        super().__init__()
        self._title, self._paths, self._lines, self._placeholder = title, list(paths), show, placeholder

    def compose(self) -> ComposeResult:
        """Return the list with a listing beside, a field for a path, and two buttons."""
        here = Path.cwd()
        names = [str(path.resolve().relative_to(here)) if path.resolve().is_relative_to(here) else path.name for path in self._paths]
        with Vertical(classes="dialog"):
            yield Label(self._title)
            with Horizontal(classes="columns"):
                yield BrowseList(*[Option(Text(name)) for name in names], id="found")
                yield ProgramListing()
            yield Label("or a path")
            yield Input(placeholder=self._placeholder, id="path", compact=True)
            yield dialog_buttons("Use", "Cancel")

    def on_mount(self) -> None:
        """Begin in the field where the list is empty."""
        if not self._paths:
            self.query_one("#path", Input).focus()

    @on(OptionList.OptionHighlighted)
    def _look(self, event: OptionList.OptionHighlighted) -> None:
        self.query_one(ProgramListing).show(self._lines(self._paths[event.option_index]))

    @on(OptionList.OptionSelected)
    @on(Button.Pressed, "#take")
    @on(Input.Submitted, "#path")
    def _take(self) -> None:
        typed = self.query_one("#path", Input).value.strip()
        place = self.query_one(BrowseList).highlighted
        if typed:
            self.dismiss(Path(typed).expanduser())
        elif place is not None:
            self.dismiss(self._paths[place])


_PROGRAM_ENDINGS = {".nc", ".ngc", ".tap", ".cnc", ".gcode", ".mpf", ".iso", ".txt"}


def files_in(folders: Iterable[Path], endings: Container[str]) -> list[Path]:
    """Return the files of these folders with one of the endings, each once."""
    found: dict[Path, Path] = {}
    for folder in folders:
        for path in sorted(folder.iterdir()) if folder.is_dir() else ():
            if path.suffix.lower() in endings and path.is_file():
                found.setdefault(path.resolve(), path)
    return list(found.values())


def program_choice(beside: Path) -> FileChoice:
    """Return the choice of a part program: of this folder, those beside a lesson, and those shipped."""
    folders = [Path("part_programs"), Path(), beside, shipped_folder("part_programs")]
    return FileChoice("Part program", files_in(folders, _PROGRAM_ENDINGS), program_lines, "programs/shaft.nc")


def lesson_choice() -> FileChoice:
    """Return the choice of a lesson: the files of this folder, and the lessons at hand."""
    paths = list(dict.fromkeys([*files_in([Path()], {".yaml"}), *lesson_files()]))
    return FileChoice("Lesson to load", paths, program_lines, "mine.yaml, or the name of a lesson")


def record_choice() -> FileChoice:
    """Return the choice of a record: those of this folder and of its runs, the newest first."""
    runs = Path("lathesim_runs")
    paths = [*(runs.rglob("*.h5") if runs.is_dir() else ()), *files_in([Path()], {".h5", ".hdf5"})]
    newest = sorted(paths, key=lambda path: path.stat().st_mtime, reverse=True)
    return FileChoice("Record to open", newest, _record_lines, "lathesim_runs/01_contour_error/001.h5")


_MOST_CHARACTERS = 200


def _record_lines(path: Path) -> list[str]:
    """Return the length of a record and what it says about itself, or why it cannot be read."""
    try:
        record = load(path)
    except LatheSimError as error:
        return [fault_words(error)]
    about = [f"{name}: {str(value)[:_MOST_CHARACTERS]}" for name, value in sorted(record.meta.items())]
    return [f"{len(record)} samples of {len(record.channels)} channels", *(line.replace("\n", " ") for line in about)]


class ChannelChoice(Dialog[tuple[str, ...] | None]):
    """Gives the names chosen, or None where the dialog was left."""

    BINDINGS = [Binding("ctrl+s", "take", "Use")]

    def __init__(self, known: Mapping[str, tuple[str, str]], chosen: Sequence[str]) -> None:
        super().__init__()
        self._known = dict(known)
        self._chosen = list(chosen)

    def compose(self) -> ComposeResult:
        """Return a field to search in, the list, and two buttons."""
        with Vertical(classes="dialog"):
            yield Input(placeholder="Type to find a channel", id="wanted", compact=True)
            yield TickList[str](id="channels")
            yield dialog_buttons("Use", "Cancel")

    def on_mount(self) -> None:
        """Fill the list."""
        self._fill()

    @on(Input.Changed, "#wanted")
    def _fill(self) -> None:
        known = [(name, *about) for name, about in self._known.items()]
        self.query_one(TickList).fill_channels(known, self.query_one("#wanted", Input).value, self._chosen)

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
