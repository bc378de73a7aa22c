"""The forms of the straight cut and the taper cut: a part program from a few quantities."""

from __future__ import annotations

from pathlib import Path

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Button, Input, Label, Select, Static

from lathesim.errors import LatheSimError
from lathesim.program.cut_form import straight_from_form, taper_from_form
from lathesim.units import split_quantity
from lathesim.whole_file import make_folder, write_new

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


class CutForm(ModalScreen[Path | None]):
    """Writes the part program and gives its file; None where the dialog was left."""

    BINDINGS = [Binding("escape", "dismiss(None)", "Cancel")]
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
            with Horizontal(classes="buttons"):
                yield Button("Write it", variant="primary", id="take", compact=True)
                yield Button("Cancel", id="leave", compact=True)

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
            self._tell(str(error))
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
            self._tell(str(error))
        else:
            self.dismiss(path)

    @on(Button.Pressed, "#leave")
    def _leave(self) -> None:
        self.dismiss(None)
