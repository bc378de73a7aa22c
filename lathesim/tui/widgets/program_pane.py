"""A part program to read: the listing, what each line does, and what is odd."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from textual import on
from textual.containers import Vertical
from textual.widget import Widget
from textual.widgets import Static

from lathesim.errors import LatheSimError
from lathesim.program.checks import checked
from lathesim.program.explain import explain
from lathesim.program.interpreter import interpret
from lathesim.program.words import read_program_file
from lathesim.tui.widgets.program_listing import ProgramListing, program_lines
from lathesim.units import in_unit


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
            self.fault = str(error)
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
