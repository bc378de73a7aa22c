"""The form that says what the columns of a recording mean, where the lesson does not."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.suggester import SuggestFromList
from textual.widgets import Button, Input, Label, Select, Static

from lathesim.errors import LatheSimError
from lathesim.tui.model.column_mapping import COMPARE, DRIVE, IGNORE, TIME, ColumnMeaning, recordings_entry


class MappingForm(ModalScreen[list[ColumnMeaning] | None]):
    """Gives the meaning of each column, or None where the dialog was left; guesses stand in the fields at first."""

    BINDINGS = [Binding("escape", "dismiss(None)", "Cancel")]
    DEFAULT_CSS = """
    MappingForm .dialog { width: 98%; max-width: 130; height: 95%; padding: 0 1; }
    MappingForm .column { height: 1; }
    MappingForm .column Label { width: 20; }
    MappingForm .column Select { width: 14; }
    MappingForm .column .target { width: 1fr; }
    MappingForm .column .unit { width: 10; }
    MappingForm .column .scale { width: 8; }
    MappingForm VerticalScroll { height: 1fr; }
    MappingForm #fault { color: $error; height: auto; }
    """

    def __init__(self, file: Path, columns: Sequence[ColumnMeaning], targets: Sequence[str]) -> None:
        super().__init__()
        self._file, self._columns, self._targets = file, list(columns), list(targets)

    def compose(self) -> ComposeResult:
        """Return a row for each column: role, channel, unit, scale."""
        suggester = SuggestFromList(self._targets, case_sensitive=False)
        with Vertical(classes="dialog"):
            yield Label(f"{self._file.name}: what the columns mean. Channels were guessed from the names: look at each.", markup=False)
            with Horizontal(classes="column"):
                yield Label("column")
                yield Label("role, channel or input, unit, scale")
            with VerticalScroll():
                for place, item in enumerate(self._columns):
                    with Horizontal(classes="column"):
                        yield Label(item.column[:19], markup=False)
                        roles = [(role, role) for role in (IGNORE, TIME, COMPARE, DRIVE)]
                        yield Select[str](roles, value=item.role, allow_blank=False, compact=True, id=f"role-{place}")
                        yield Input(item.target, classes="target", compact=True, id=f"target-{place}", suggester=suggester)
                        yield Input(item.unit, classes="unit", compact=True, id=f"unit-{place}")
                        yield Input(f"{item.scale:g}", classes="scale", compact=True, id=f"scale-{place}", type="number")
            yield Static("", id="fault", markup=False)
            with Horizontal(classes="buttons"):
                yield Button("Use", variant="primary", id="take", compact=True)
                yield Button("Cancel", id="leave", compact=True)

    def _meanings(self) -> list[ColumnMeaning]:
        found = []
        for place, item in enumerate(self._columns):
            scale = self.query_one(f"#scale-{place}", Input).value.strip() or "1"
            found.append(
                ColumnMeaning(
                    item.column,
                    str(self.query_one(f"#role-{place}", Select).value),
                    self.query_one(f"#target-{place}", Input).value.strip(),
                    self.query_one(f"#unit-{place}", Input).value.strip(),
                    float(scale),
                )
            )
        return found

    @on(Button.Pressed, "#take")
    def _take(self) -> None:
        try:
            meanings = self._meanings()
            recordings_entry(meanings)
        except LatheSimError as error:
            self.query_one("#fault", Static).update(f"✗ {error}")
        except ValueError:
            self.query_one("#fault", Static).update("✗ A scale is a number.")
        else:
            self.dismiss(meanings)

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)
