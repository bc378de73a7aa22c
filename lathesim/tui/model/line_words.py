"""What a line of a part program does, in one sentence."""

from __future__ import annotations

from pathlib import Path

from lathesim.errors import LatheSimError
from lathesim.program.explain import explain
from lathesim.program.interpreter import interpret
from lathesim.program.words import read_program_file


class LineWords:
    """The sentences about the lines of a program, made once."""

    def __init__(self, path: Path, dialect: str) -> None:
        self.fault = ""
        self._sentences: dict[int, str] = {}
        try:
            blocks = read_program_file(path)
            self._sentences = dict(explain(blocks, interpret(blocks, dialect)))
        except LatheSimError as error:
            self.fault = str(error)

    def of(self, line: int) -> str:
        """Return the sentence about a line, counted from 1."""
        return self.fault or f"Line {line}: {self._sentences.get(line, 'Nothing is done.')}"
