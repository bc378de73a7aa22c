"""What a line of a part program does, in one sentence."""

from __future__ import annotations

import math
from pathlib import Path

from lathesim.errors import LatheSimError
from lathesim.program.loading import load_program
from lathesim.program.moves import Move, Program


class LineWords:
    """The moves and events of a program, found by the line they stand in."""

    def __init__(self, path: Path, dialect: str, start: tuple[float, float] | None = None) -> None:
        self.fault = ""
        self._program: Program | None = None
        try:
            self._program = load_program(path, dialect, start=start)
        except LatheSimError as error:
            self.fault = str(error)

    def of(self, line: int) -> str:
        """Return the sentence about a line, counted from 1."""
        if self._program is None:
            return self.fault
        words = [_event_words(event.kind, event.text) for event in self._program.events if event.line == line]
        words += [_move_words(move) for move in self._program.moves if move.line == line]
        words = list(dict.fromkeys(words))
        if len(words) > 6:
            words = [*words[:5], f"and {len(words) - 5} more"]
        return f"Line {line}: {'; '.join(words) if words else 'no motion'}."


def _move_words(move: Move) -> str:
    end = f"X {move.end_x * 1e3:.6g} mm (radius), Z {move.end_z * 1e3:.6g} mm"
    if move.kind == "dwell":
        return f"dwell of {move.seconds:g} s"
    if move.kind == "rapid":
        return f"rapid to {end}"
    feed = ""
    if move.feed is not None:
        feed = f" at {move.feed * 1e3:.4g} mm/rev" if move.per_revolution else f" at {move.feed * 6e4:.4g} mm/min"
    if move.arc is not None:
        turn = "clockwise" if move.arc.clockwise else "counterclockwise"
        return f"{turn} arc of radius {move.arc.radius * 1e3:.4g} mm, {math.degrees(abs(move.arc.sweep)):.4g} degrees, to {end}{feed}"
    return f"{'thread' if move.kind == 'thread' else 'straight line'} to {end}{feed}"


def _event_words(kind: str, text: str) -> str:
    return f"{kind.replace('_', ' ')}{f' ({text})' if text else ''}"
