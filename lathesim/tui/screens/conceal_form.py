"""The dialog that hides an effect in a lesson's machine: for another student, or for a class."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Button, Checkbox, Input, Label, Static


@dataclass(frozen=True)
class Order:
    """What to make: folders, what is hidden (empty: drawn), and whether a second recording is made."""

    folders: tuple[Path, ...]
    hidden: str
    validate: bool


class ConcealForm(ModalScreen[Order | None]):
    """Gives the order, or None where the dialog was left."""

    BINDINGS = [Binding("escape", "dismiss(None)", "Cancel")]
    DEFAULT_CSS = """
    ConcealForm #fault { color: $error; height: auto; }
    ConcealForm Input { margin-bottom: 1; }
    """

    def __init__(self, lesson: str) -> None:
        super().__init__()
        self._lesson = lesson

    def compose(self) -> ComposeResult:
        """Return the fields and two buttons."""
        with Vertical(classes="dialog -short"):
            yield Label(f"Hide something in the machine of {self._lesson}", markup=False)
            yield Label("Effect: empty for one drawn at random, 'none' for nothing")
            yield Input(id="hidden", compact=True, placeholder="CoulombFriction:level=20 N@x_axis")
            yield Label("Folder for the class; the answer goes beside it")
            yield Input("case_1", id="folder", compact=True)
            yield Label("How many cases (numbered)")
            yield Input("1", id="count", compact=True, type="integer")
            yield Checkbox("a second recording to judge on", value=True, id="validate", compact=True)
            yield Static("", id="fault", markup=False)
            with Horizontal(classes="buttons"):
                yield Button("Make it", variant="primary", id="take", compact=True)
                yield Button("Cancel", id="leave", compact=True)

    @on(Button.Pressed, "#take")
    @on(Input.Submitted)
    def _take(self) -> None:
        folder = self.query_one("#folder", Input).value.strip()
        count = self.query_one("#count", Input).value.strip()
        if not folder or not count.isdigit() or not 1 <= int(count) <= 200:
            self.query_one("#fault", Static).update("✗ Write a folder, and a number of cases from 1 to 200.")
            return
        folders = (Path(folder),) if int(count) == 1 else tuple(Path(f"{folder}_{number + 1}") for number in range(int(count)))
        self.dismiss(Order(folders, self.query_one("#hidden", Input).value.strip(), self.query_one("#validate", Checkbox).value))

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)
