"""What a part program does, line by line, and what is odd in it."""

from __future__ import annotations

from pathlib import Path

from lathesim.errors import LatheSimError
from lathesim.program.interpreter import interpret
from lathesim.program.telling.checks import checked
from lathesim.program.telling.explain import explain
from lathesim.program.words import read_program_file


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
        self.summary = f"{counts}; cut {1e3 * found.cut_path:.4g} mm, rapid {1e3 * found.rapid_path:.4g} mm"

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
