"""A part program to read: the listing with the line in work marked, what each line does, and what is odd."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from rich.segment import Segment
from textual import on
from textual.binding import Binding
from textual.containers import Vertical
from textual.geometry import Size
from textual.message import Message
from textual.scroll_view import ScrollView
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import Static

from lathesim.errors import LatheSimError
from lathesim.program.explain import explain
from lathesim.program.interpreter import interpret
from lathesim.program.program_checks import checked
from lathesim.program.words import read_program_file
from lathesim.tui.model.workbench import fault_words
from lathesim.units import in_unit

_MOST_BYTES = 20_000_000


def program_lines(path: Path | None) -> list[str]:
    """Return the lines of a part program; one sentence where it cannot be read."""
    if path is None:
        return ["This lesson has no part program."]
    try:
        with path.open("rb") as file:
            data = file.read(_MOST_BYTES + 1)
    except OSError as error:
        return [f"{path}: {error.strerror}."]
    lines = data[:_MOST_BYTES].decode("utf-8", errors="replace").replace("\t", "    ").splitlines()
    if len(data) > _MOST_BYTES:
        lines.append(f"Only the first {_MOST_BYTES // 1_000_000} MB are shown.")
    return ["".join(character if character.isprintable() else "�" for character in line) for line in lines]


class ProgramListing(ScrollView, can_focus=True):
    """Shows numbered lines; the line in work has an arrow and a bar. The line under the cursor may be asked for (:class:`LineChosen`)."""

    COMPONENT_CLASSES = {"listing--number", "listing--line", "listing--work"}
    DEFAULT_CSS = """
    ProgramListing {
        background: $surface;
        & > .listing--number { color: $text-muted; }
        & > .listing--line { color: $foreground; }
        & > .listing--work { background: $accent; color: #111111; text-style: bold; }
    }
    """
    BINDINGS = [
        Binding("up", "move(-1)", "Line up", show=False),
        Binding("down", "move(1)", "Line down", show=False),
        Binding("pageup", "move(-10)", "Page up", show=False),
        Binding("pagedown", "move(10)", "Page down", show=False),
    ]

    class LineChosen(Message):
        """The cursor went to another line, counted from 1."""

        def __init__(self, line: int) -> None:
            super().__init__()
            self.line = line

    def __init__(self, id: str | None = None) -> None:
        super().__init__(id=id)
        self.lines: list[str] = []
        self.line: int | None = None
        self.odd: frozenset[int] = frozenset()

    def flag(self, odd: Collection[int]) -> None:
        """Put a ! before lines in which something is odd, counted from 1."""
        self.odd = frozenset(odd)
        self.refresh()

    def show(self, lines: Sequence[str]) -> None:
        """Show the lines of a program."""
        if list(lines) == self.lines:
            return
        self.lines = list(lines)
        self.line = None
        self.virtual_size = Size(max((len(line) for line in self.lines), default=0) + self._digits + 3, len(self.lines))
        self.scroll_to(0, 0, animate=False)
        self.refresh()

    def mark(self, line: int | None) -> None:
        """Mark the line in work, counted from 1, and bring it into view."""
        if line == self.line:
            return
        self.line = line
        if line is not None:
            above, height = self.scroll_offset.y, self.size.height
            if not above <= line - 1 < above + height:
                self.scroll_to(y=max(0, line - 1 - height // 3), animate=False)
        self.refresh()

    @property
    def _digits(self) -> int:
        return len(str(max(len(self.lines), 1)))

    def action_move(self, lines: int) -> None:
        """Move the cursor and tell."""
        self._choose((self.line or 0) + lines)

    def on_click(self, event: object) -> None:
        """Choose the line that was clicked."""
        self._choose(int(getattr(event, "y", 0)) + self.scroll_offset.y + 1)

    def _choose(self, line: int) -> None:
        if not self.lines:
            return
        self.mark(max(1, min(len(self.lines), line)))
        assert self.line is not None
        self.post_message(self.LineChosen(self.line))

    def render_line(self, y: int) -> Strip:
        """Return one row of the listing."""
        left, top = self.scroll_offset
        row = top + y
        width = self.size.width
        if row >= len(self.lines):
            return Strip.blank(width, self.rich_style)
        in_work = row + 1 == self.line
        sign = "!" if row + 1 in self.odd else ">" if in_work else " "
        number = f"{sign}{row + 1:>{self._digits}} "
        style = self.get_component_rich_style("listing--work" if in_work else "listing--line")
        number_style = style if in_work else self.get_component_rich_style("listing--number")
        strip = Strip([Segment(number, number_style), Segment(self.lines[row], style)])
        return strip.crop_extend(left, left + width, style if in_work else self.rich_style)


class LineWords:
    """The sentences about the lines of a program and what is odd in them, made once, as ``lathesim program --explain --check`` has them."""

    def __init__(self, path: Path, dialect: str) -> None:
        self.fault = ""
        self.summary = ""
        """How many moves of each kind, and the ways cut and rapid."""
        self.odd: dict[int, list[str]] = {}
        """Line, counted from 1 -> what is odd there."""
        self._sentences: dict[int, str] = {}
        try:
            blocks = read_program_file(path)
            program = interpret(blocks, dialect)
        except LatheSimError as error:
            self.fault = fault_words(error)
            return
        self._sentences = dict(explain(blocks, program))
        for warned in [*program.warnings, *checked(program)]:
            self.odd.setdefault(warned.line, []).append(warned.sentence)
        found = program.summary
        counts = ", ".join(f"{number} {kind}" for kind, number in found.counts.items()) or "no moves"
        self.summary = f"{counts}; cut {in_unit(found.cut_path, 'mm')}, rapid {in_unit(found.rapid_path, 'mm')}"

    def of(self, line: int) -> str:
        """Return the sentence about a line, counted from 1, and what is odd there."""
        if self.fault:
            return self.fault
        return "\n".join([f"Line {line}: {self._sentences.get(line, 'Nothing is done.')}", *(f"! {odd}" for odd in self.odd.get(line, []))])

    def checked(self) -> str:
        """Return whether anything is odd in the program, and where."""
        if self.fault:
            return self.fault
        lines = ", ".join(str(line) for line in sorted(self.odd))
        return f"! Odd in line {lines}: go there to read why." if lines else "Nothing is odd."


class ProgramPane(Vertical):
    """The listing above, the sentence about the line under the cursor below; a ! stands before lines in which something is odd."""

    DEFAULT_CSS = """
    ProgramPane #explained { height: auto; max-height: 6; padding: 0 1; background: $panel; }
    """

    def __init__(self) -> None:
        super().__init__()
        self._words: LineWords | None = None
        self._words_of: tuple[Path | None, str] = (None, "")

    def compose(self) -> Iterable[Widget]:
        """Return listing and sentence."""
        yield ProgramListing(id="listing")
        yield Static("", id="explained", markup=False)

    def show(self, path: Path | None, dialect: str) -> None:
        """Show a program, checked."""
        listing, explained = self.query_one(ProgramListing), self.query_one("#explained", Static)
        listing.show(program_lines(path))
        if self._words_of != (path, dialect):
            self._words_of = (path, dialect)
            self._words = LineWords(path, dialect) if path is not None else None
        if path is None or self._words is None:
            listing.flag(())
            explained.update("No part program.")
            return
        listing.flag(self._words.odd)
        words = f"{path.name}, dialect {dialect}: {self._words.summary}. {self._words.checked()}"
        explained.update(f"{words}\nA click or the arrows explain a line.")

    @on(ProgramListing.LineChosen)
    def _explain(self, event: ProgramListing.LineChosen) -> None:
        if self._words is not None:
            self.query_one("#explained", Static).update(self._words.of(event.line))
