"""Corners that a program breaks between two straight feeds: a chamfer (``,C``) or a rounding (``,R``).

Source: Fanuc 0i-T operator's manual, chamfering and corner R (arbitrary angle).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from lathesim.errors import ProgramError
from lathesim.program.moves import Arc, Move, MoveKind

_STRAIGHT = 1e-6
"""[rad] below this, two moves make no corner."""
_SAME = 1e-9


@dataclass(frozen=True)
class Corner:
    """A corner at the end of a move: ``size`` [m] is the radius of a rounding, else what a chamfer takes off both moves."""

    rounds: bool
    size: float
    text: str
    place: str


def broken(before: Move, after: Move, corner: Corner) -> list[Move]:
    """Return the two moves with their corner broken: the first, the chamfer or rounding, the second."""
    if before.arc is not None or after.kind != "feed" or after.arc is not None:
        fact = f"{corner.text} needs a straight feed before and behind it."
        raise ProgramError(fact, place=corner.place, remedy="Write arcs with G2 and G3.")
    length = (before.length, after.length)
    if min(length) < _SAME:
        raise ProgramError(f"{corner.text} stands beside a move without a length.", place=corner.place, remedy="Take one of the two out.")
    u = ((before.end_z - before.start_z) / length[0], (before.end_x - before.start_x) / length[0])
    v = ((after.end_z - after.start_z) / length[1], (after.end_x - after.start_x) / length[1])
    turn = math.atan2(u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1])
    if abs(turn) < _STRAIGHT:
        return [before, after]
    if abs(turn) > math.pi - _STRAIGHT:
        raise ProgramError(f"{corner.text} stands where the tool turns back.", place=corner.place, remedy="Take it out.")
    cut = corner.size * math.tan(0.5 * abs(turn)) if corner.rounds else corner.size
    if cut > min(length) + _SAME:
        raise ProgramError(
            f"{corner.text} takes {1e3 * cut:.4g} mm off moves of {1e3 * length[0]:.4g} and {1e3 * length[1]:.4g} mm.",
            place=corner.place,
            remedy="Make it smaller.",
        )
    begin = (before.end_z - cut * u[0], before.end_x - cut * u[1])
    end = (before.end_z + cut * v[0], before.end_x + cut * v[1])
    arc = None
    if corner.rounds:
        side = math.copysign(1.0, turn)
        centre = (begin[0] - side * corner.size * u[1], begin[1] + side * corner.size * u[0])
        angle = math.atan2(begin[1] - centre[1], begin[0] - centre[0])
        arc = Arc(centre[1], centre[0], corner.size, corner.size, angle, turn)
    kind: MoveKind = "arc" if arc is not None else "feed"
    between = replace(before, kind=kind, start_z=begin[0], start_x=begin[1], end_z=end[0], end_x=end[1], arc=arc)
    return [replace(before, end_z=begin[0], end_x=begin[1]), between, replace(after, start_z=end[0], start_x=end[1])]
