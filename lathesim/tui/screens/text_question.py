"""A dialog that asks for one line of text, a file name for example."""

from __future__ import annotations

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Button, Input, Label


class TextQuestion(ModalScreen[str | None]):
    """Gives the text, or None where the dialog was left."""

    BINDINGS = [Binding("escape", "dismiss(None)", "Cancel")]

    def __init__(self, question: str, text: str = "", placeholder: str = "") -> None:
        super().__init__()
        self._question, self._text, self._placeholder = question, text, placeholder

    def compose(self) -> ComposeResult:
        """Return the question, the field and two buttons."""
        with Vertical(classes="dialog -short"):
            yield Label(self._question, markup=False)
            yield Input(self._text, placeholder=self._placeholder, id="answer", compact=True)
            with Horizontal(classes="buttons"):
                yield Button("OK", variant="primary", id="take", compact=True)
                yield Button("Cancel", id="leave", compact=True)

    @on(Input.Submitted, "#answer")
    @on(Button.Pressed, "#take")
    def _take(self) -> None:
        text = self.query_one(Input).value.strip()
        self.dismiss(text or None)

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)
