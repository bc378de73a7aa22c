"""The choice of a part program: those of the folder, beside the lesson, and those that came along, or a path."""

from __future__ import annotations

from pathlib import Path

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Button, Input, Label, OptionList
from textual.widgets.option_list import Option

from lathesim.shipped import shipped_folder
from lathesim.tui.model.program_text import program_lines
from lathesim.tui.widgets.browse_list import BrowseList
from lathesim.tui.widgets.program_listing import ProgramListing

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
