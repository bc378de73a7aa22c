"""Forms to fill in: a line of text, physics to conceal, columns of a recording, a cut."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from textual import on
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.suggester import SuggestFromList
from textual.widgets import Button, Checkbox, Input, Label, OptionList, Select, Static

from lathesim.errors import LatheSimError
from lathesim.lessons.proposed_lesson import COMPARE, DRIVE, IGNORE, TIME, ColumnMeaning, recordings_entry
from lathesim.program.program_file import straight_from_form, taper_from_form
from lathesim.tui.model.workbench import fault_words
from lathesim.tui.screens.workbench_screen import Dialog, dialog_buttons
from lathesim.units import split_quantity
from lathesim.whole_file import make_folder, write_new

_MOST_CASES = 200
"""Cases of a class that are made at once at most."""


class TextQuestion(Dialog[str | None]):
    """Gives the text, or None where the dialog was left."""

    def __init__(self, question: str, text: str = "", placeholder: str = "") -> None:
        super().__init__()
        self._question, self._text, self._placeholder = question, text, placeholder

    def compose(self) -> ComposeResult:
        """Return the question, the field and two buttons."""
        with Vertical(classes="dialog -short"):
            yield Label(self._question, markup=False)
            yield Input(self._text, placeholder=self._placeholder, id="answer", compact=True)
            yield dialog_buttons("OK", "Cancel")

    @on(Input.Submitted, "#answer")
    @on(Button.Pressed, "#take")
    def _take(self) -> None:
        self.dismiss(self.query_one(Input).value.strip() or None)


class ChoiceQuestion(Dialog[str | None]):
    """Gives the choice, or None where the dialog was left."""

    def __init__(self, question: str, choices: Sequence[str]) -> None:
        super().__init__()
        self._question, self._choices = question, list(choices)

    def compose(self) -> ComposeResult:
        """Return the question and its choices."""
        with Vertical(classes="dialog -short"):
            yield Label(self._question, markup=False)
            yield OptionList(*self._choices, id="choices", markup=False, compact=True)

    @on(OptionList.OptionSelected, "#choices")
    def _take(self, event: OptionList.OptionSelected) -> None:
        self.dismiss(self._choices[event.option_index])


@dataclass(frozen=True)
class Order:
    """What to make: folders, what is hidden (empty: drawn), and whether a second recording is made."""

    folders: tuple[Path, ...]
    hidden: str
    validate: bool


class ConcealForm(Dialog[Order | None]):
    """Gives the order, or None where the dialog was left."""

    DEFAULT_CSS = """
    ConcealForm #fault { color: $error; height: auto; }
    ConcealForm Input, ConcealForm #choose { margin-bottom: 1; }
    """

    def __init__(self, lesson: str, choice: Callable[[], ModalScreen[tuple[str, str] | None]]) -> None:
        """Ask for what is hidden in the machine of ``lesson``; ``choice`` makes the list of effects with their pages."""
        super().__init__()
        self._lesson, self._choice = lesson, choice

    def compose(self) -> ComposeResult:
        """Return the fields and two buttons."""
        with Vertical(classes="dialog -short"):
            yield Label(f"Hide something in the machine of {self._lesson}", markup=False)
            yield Label("Effect: empty for one drawn at random, 'none' for nothing")
            yield Input(id="hidden", compact=True, placeholder="CoulombFriction:level=20 N@x_axis")
            yield Button("Choose from the list", id="choose", compact=True)
            yield Label("Folder for the class; the answer goes beside it")
            yield Input("case_1", id="folder", compact=True)
            yield Label("How many cases (numbered)")
            yield Input("1", id="count", compact=True, type="integer")
            yield Checkbox("a second recording to judge on", value=True, id="validate", compact=True)
            yield Static("", id="fault", markup=False)
            yield dialog_buttons("Make it", "Cancel")

    @on(Button.Pressed, "#choose")
    def _choose(self) -> None:
        self.app.push_screen(self._choice(), self._take_effect)

    def _take_effect(self, chosen: tuple[str, str] | None) -> None:
        if chosen is not None:
            self.query_one("#hidden", Input).value = "@".join(chosen)

    @on(Button.Pressed, "#take")
    @on(Input.Submitted)
    def _take(self) -> None:
        folder = self.query_one("#folder", Input).value.strip()
        count = self.query_one("#count", Input).value.strip()
        if not folder or not count.isdigit() or not 1 <= int(count) <= _MOST_CASES:
            self.query_one("#fault", Static).update(f"✗ Write a folder, and a number of cases from 1 to {_MOST_CASES}.")
            return
        folders = (Path(folder),) if int(count) == 1 else tuple(Path(f"{folder}_{number + 1}") for number in range(int(count)))
        self.dismiss(Order(folders, self.query_one("#hidden", Input).value.strip(), self.query_one("#validate", Checkbox).value))


class MappingForm(Dialog[list[ColumnMeaning] | None]):
    """Gives the meaning of each column, or None where the dialog was left; guesses stand in the fields at first."""

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
            yield dialog_buttons("Use", "Cancel")

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
            self.query_one("#fault", Static).update(f"✗ {fault_words(error)}")
        except ValueError:
            self.query_one("#fault", Static).update("✗ A scale is a number.")
        else:
            self.dismiss(meanings)


FIELDS = (
    ("diameter", "Diameter", "30 mm"),
    ("small_diameter", "Diameter at the face", "30 mm"),
    ("large_diameter", "Diameter at the far end", "34 mm"),
    ("length", "Length behind the face", "20 mm"),
    ("face", "Z of the face", "15 mm"),
    ("clearance", "Clearance", "5 mm"),
    ("feed", "Feed (mm/min or mm/rev)", "120 mm/min"),
    ("speed", "Spindle (rpm or m/min)", "1000 rpm"),
    ("file", "File", "part_programs/cut.nc"),
)
_TITLES = {name: title for name, title, _ in FIELDS}
_UNITS = {name: split_quantity(text)[1] for name, _, text in FIELDS if name != "file"}
_STRAIGHT, _TAPER = "straight cut", "taper cut"


class CutForm(Dialog[Path | None]):
    """Writes the part program and gives its file; None where the dialog was left."""

    DEFAULT_CSS = """
    CutForm .dialog { height: 95%; padding: 0 1; }
    CutForm .field { height: 1; }
    CutForm .field Label { width: 28; }
    CutForm .field Input { width: 1fr; }
    CutForm #fault { height: auto; }
    CutForm #fault.-wrong { color: $error; }
    CutForm VerticalScroll { height: 1fr; }
    """

    def compose(self) -> ComposeResult:
        """Return the kind of cut, its fields, and two buttons."""
        with Vertical(classes="dialog"):
            yield Select[str]([(kind, kind) for kind in (_STRAIGHT, _TAPER)], value=_STRAIGHT, allow_blank=False, id="kind", compact=True)
            with VerticalScroll():
                for name, title, text in FIELDS:
                    with Horizontal(classes="field", id=f"row-{name}"):
                        yield Label(title)
                        yield Input(text, id=name, compact=True)
            yield Static("", id="fault", markup=False)
            yield dialog_buttons("Write it", "Cancel")

    @on(Select.Changed, "#kind")
    def _choose_kind(self) -> None:
        self.query_one("#row-diameter").display = self._is_straight
        self.query_one("#row-small_diameter").display = not self._is_straight
        self.query_one("#row-large_diameter").display = not self._is_straight
        self._check()

    @on(Input.Changed)
    def _check(self) -> None:
        try:
            self._text()
        except LatheSimError as error:
            self._tell(fault_words(error))
        else:
            typed = {name: self.query_one(f"#{name}", Input).value.strip() for name in self._wanted}
            taken = [f"{_TITLES[name]} {text}" for name, text in self._values().items() if text != typed[name]]
            self._tell(f"Taken as {', '.join(taken)}." if taken else "", wrong=False)

    def _tell(self, sentence: str, *, wrong: bool = True) -> None:
        fault = self.query_one("#fault", Static)
        fault.set_class(wrong, "-wrong")
        fault.update(sentence)

    @property
    def _is_straight(self) -> bool:
        return self.query_one("#kind", Select).value == _STRAIGHT

    @property
    def _wanted(self) -> list[str]:
        left_out = {"small_diameter", "large_diameter"} if self._is_straight else {"diameter"}
        return [name for name in _TITLES if name not in {*left_out, "file"}]

    def _values(self) -> dict[str, str]:
        """Return what is typed; a number alone is in the unit that the form shows first."""
        values = {name: self.query_one(f"#{name}", Input).value.strip() for name in self._wanted}
        return {name: text if split_quantity(text)[1] else f"{text} {_UNITS[name]}" for name, text in values.items()}

    def _text(self) -> str:
        return straight_from_form(**self._values()) if self._is_straight else taper_from_form(**self._values())

    @on(Button.Pressed, "#take")
    @on(Input.Submitted)
    def _take(self) -> None:
        path = Path(self.query_one("#file", Input).value.strip() or "cut.nc")
        try:
            text = self._text()
            make_folder(path.parent)
            write_new((path,), lambda part: part.write_text(text, encoding="utf-8"))
        except FileExistsError:
            self._tell(f"'{path}' is there already. Choose another name.")
        except LatheSimError as error:
            self._tell(fault_words(error))
        else:
            self.dismiss(path)
