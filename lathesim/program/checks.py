"""What is odd in a program that can be read: checks before anything is cut, each a warning with its line and what to do."""

from __future__ import annotations

import math

from lathesim.program.moves import Program
from lathesim.program.words import Warned

_BEYOND_AXIS = -1e-3
"""[m] how far beyond the spindle's axis a facing cut goes at most, assumed: twice a nose radius of 0.4 mm and a little."""
_SAME = 1e-9


def checked(program: Program) -> list[Warned]:
    """Return warnings: X far beyond the axis, a surface speed without a limit, feeds in the air at rest, thread in surface speed."""
    found: list[Warned] = []
    seen: set[str] = set()

    def warn(kind: str, line: int, sentence: str) -> None:
        if kind not in seen:
            seen.add(kind)
            found.append(Warned(line, sentence))

    ends = [move.end_x for move in program.moves]
    positive = sum(x > _SAME for x in ends) > sum(x < -_SAME for x in ends)
    for move in program.moves:
        cuts = move.kind in ("feed", "arc", "thread")
        if positive and cuts and move.end_x < _BEYOND_AXIS:
            x = f"X {1e3 * move.end_x:.4g} mm (radius)"
            warn("axis", move.line, f"The cut goes beyond the spindle's axis, to {x}. Check the sign and whether X is a diameter.")
        spindle = move.spindle
        if cuts and spindle.direction and spindle.surface and spindle.limit is None:
            smallest = min(abs(move.start_x), abs(move.end_x))
            rpm = 30.0 / math.pi * spindle.speed / smallest if smallest > _SAME else math.inf
            told = "without bound" if math.isinf(rpm) else f"at up to {rpm:.0f} rpm"
            warn("limit", move.line, f"The spindle runs {told} under constant surface speed. Write a speed limit before it.")
        if move.kind == "thread" and spindle.surface:
            warn("thread", move.line, "A thread is cut under constant surface speed, so its lead changes the speed. Write G97 before it.")
    return found
