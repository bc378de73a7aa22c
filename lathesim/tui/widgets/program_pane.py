"""A part program to read: the listing, what each line does, and what is odd."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from textual import on
from textual.containers import Vertical
from textual.widget import Widget
from textual.widgets import Static

from lathesim.tui.model.line_words import LineWords
from lathesim.tui.model.program_text import program_lines
from lathesim.tui.widgets.program_listing import ProgramListing


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
