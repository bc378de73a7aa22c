"""The geometry of single moves: arcs, corners that are broken, and lines given by their angle.

Where the centre of a programmed arc lies, and whether it is one.

Seen with +Z to the right and +X up: G02 is clockwise, G03 counterclockwise, a positive sweep counterclockwise. Lengths [m].
Source: NIST RS274NGC Interpreter version 3, section 3.5.3 (radius and centre format); tolerances of LinuxCNC 2.9 rs274.

Corners that a program breaks between two straight feeds, and lines that it gives by their angle.

A chamfer is ``,C`` or ``C``, a rounding ``,R`` or ``R``. Between moves along the axes a chamfer may be I or K, whose sign says which way
the next move goes along X or Z. ``,A`` or ``A`` is the angle of a line from +Z towards +X, of whose end X or Z is given.

Source: Fanuc 0i-T operator's manual, chamfering and corner R, direct drawing dimension programming; Haas lathe operator's manual, G01.
"""

from __future__ import annotations

import math
from dataclasses import replace

from lathesim.errors import Fault
from lathesim.program.moves import Arc, Corner, Move, MoveKind
from lathesim.program.words import Word
from lathesim.units import in_unit

RADIUS_TOLERANCE = 2.83e-5  # [m] radii may differ so much ... Source: LinuxCNC 2.9 rs274
RELATIVE_TOLERANCE = 1e-3  # ... or by this share of the radius ...
LARGEST_DIFFERENCE = 2.83e-3  # [m] ... but never by more than this
CHORD_TOLERANCE = 5e-6  # [m] half a chord may exceed R by this, assumed: coordinates come rounded to 1 um or 0.0001 inch
SAME_POINT = 1e-9  # [m] points nearer than this are one, assumed: far below any programmed digit

Point = tuple[float, float]  # (x, z) [m]

_FULL_TURN = 2.0 * math.pi


def arc_by_centre(start: tuple[float, float], end: tuple[float, float], centre: tuple[float, float], clockwise: bool, code: str) -> Arc:
    """Return the arc from start to end (x, z) about ``centre``; equal ends make a full circle.

    Raises :class:`Fault` where the centre coincides with the start or is not equally far from both ends.
    """
    radius = math.hypot(start[0] - centre[0], start[1] - centre[1])
    end_radius = math.hypot(end[0] - centre[0], end[1] - centre[1])
    if radius < SAME_POINT:
        raise Fault(f"{code} has its centre where it starts.", "I and K point from the start to the centre.")
    difference = abs(end_radius - radius)
    if difference > LARGEST_DIFFERENCE or (difference > RADIUS_TOLERANCE and difference > RELATIVE_TOLERANCE * radius):
        raise Fault(
            f"{code} ends {in_unit(end_radius, 'mm', '.4f')} from its centre and starts {in_unit(radius, 'mm', '.4f')} from it.",
            "Correct I and K, or the end point, so that both lie on one circle.",
        )
    start_angle = math.atan2(start[0] - centre[0], start[1] - centre[1])
    if math.hypot(end[0] - start[0], end[1] - start[1]) < SAME_POINT:
        sweep = _FULL_TURN
    else:
        end_angle = math.atan2(end[0] - centre[0], end[1] - centre[1])
        sweep = (start_angle - end_angle if clockwise else end_angle - start_angle) % _FULL_TURN
        if sweep == 0.0:
            sweep = _FULL_TURN
    return Arc(centre[0], centre[1], radius, end_radius, start_angle, -sweep if clockwise else sweep)


def arc_by_radius(start: Point, end: Point, radius: float, clockwise: bool, code: str) -> Arc:
    """Return the arc of this radius from start to end (x, z); a negative radius takes the longer way round.

    Raises :class:`Fault` where the ends are one point or too far apart.
    """
    across, along = end[0] - start[0], end[1] - start[1]
    chord = math.hypot(across, along)
    if radius == 0.0:
        raise Fault(f"{code} has the radius 0.", "Give R, or the centre with I and K.")
    if chord < SAME_POINT:
        raise Fault(
            f"{code} with R ends where it starts, so its centre could lie anywhere.", "Give the centre of a full circle with I and K."
        )
    size = abs(radius)
    if 0.5 * chord > size + CHORD_TOLERANCE:
        raise Fault(
            f"{code} has the radius {in_unit(size, 'mm', '.4f')}, too small to reach its end {in_unit(chord, 'mm', '.4f')} away.",
            f"It takes {500.0 * chord:.4f} mm at least.",
        )
    size = max(size, 0.5 * chord)
    height = math.sqrt(max(0.0, size * size - 0.25 * chord * chord))
    # Seen with +Z right and +X up, the centre of a short clockwise arc lies to the right of the way from start to end.
    side = 1.0 if clockwise == (radius > 0.0) else -1.0
    centre = (
        0.5 * (start[0] + end[0]) - side * height * along / chord,
        0.5 * (start[1] + end[1]) + side * height * across / chord,
    )
    start_angle = math.atan2(start[0] - centre[0], start[1] - centre[1])
    half = math.asin(min(1.0, 0.5 * chord / size))
    sweep = 2.0 * half if radius > 0.0 else _FULL_TURN - 2.0 * half
    return Arc(centre[0], centre[1], size, size, start_angle, -sweep if clockwise else sweep)


_STRAIGHT = 1e-6
"""[rad] below this, two moves make no corner."""
_SAME = 1e-9


CORNER_AXES = {"I": "X", "K": "Z"}
"""The axis of the next move that a letter of a corner tells."""
CORNER_LETTERS = (",C", ",R", "C", "R", *CORNER_AXES)


def corner_of(word: Word, metres: float, line: int) -> Corner:
    """Return the corner that a word asks for; ``metres`` is its value."""
    axis = CORNER_AXES.get(word.letter, "")
    sign = math.copysign(1.0, metres) if axis or metres < 0.0 else 0.0
    return Corner(word.letter in (",R", "R"), abs(metres), word.text, line, axis, sign)


def end_at_angle(start: tuple[float, float], end: tuple[float, float], degrees: float, *, x_given: bool) -> tuple[float, float] | None:
    """Return the end (x, z) [m] of a line at an angle from +Z towards +X, of which X or Z is given; none where it never gets there."""
    along_z, along_x = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    way, given = (end[0] - start[0], along_x) if x_given else (end[1] - start[1], along_z)
    if abs(given) < _STRAIGHT or way / given < 0.0:
        return None
    return start[0] + way / given * along_x, start[1] + way / given * along_z


def broken(before: Move, after: Move, corner: Corner) -> list[Move]:
    """Return the two moves with their corner broken: the first, the chamfer or rounding, the second."""
    if before.arc is not None or after.kind != "feed" or after.arc is not None:
        fact = f"{corner.text} needs a straight feed before and behind it."
        raise Fault(fact, "Write arcs with G2 and G3.")
    length = (before.length, after.length)
    if min(length) < _SAME:
        raise Fault(f"{corner.text} stands beside a move without a length.", "Take one of the two out.")
    u = ((before.end_z - before.start_z) / length[0], (before.end_x - before.start_x) / length[0])
    v = ((after.end_z - after.start_z) / length[1], (after.end_x - after.start_x) / length[1])
    if corner.sign != 0.0:
        _check_direction(corner, u, v)
    turn = math.atan2(u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1])
    if abs(turn) < _STRAIGHT:
        return [before, after]
    if abs(turn) > math.pi - _STRAIGHT:
        raise Fault(f"{corner.text} stands where the tool turns back.", "Take it out.")
    cut = corner.size * math.tan(0.5 * abs(turn)) if corner.rounds else corner.size
    if cut > min(length) + _SAME:
        raise Fault(
            f"{corner.text} takes {in_unit(cut, 'mm')} off moves of {1e3 * length[0]:.4g} and {1e3 * length[1]:.4g} mm.", "Make it smaller."
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


def _check_direction(corner: Corner, u: tuple[float, float], v: tuple[float, float]) -> None:
    """Refuse a corner whose sign says another way than that of the next move; ``u`` and ``v`` are directions (z, x)."""
    place = max((0, 1), key=lambda number: abs(v[number]))
    if min(abs(v[0]), abs(v[1])) > _STRAIGHT or abs(u[place]) > _STRAIGHT:
        fact = f"{corner.text} needs a move along one axis before it and one along the other behind it."
        raise Fault(fact, f"Write ,{'R' if corner.rounds else 'C'}{1e3 * corner.size:g} for any corner.")
    if v[place] * corner.sign < 0.0 or (corner.axis and corner.axis != "ZX"[place]):
        way = f"{'+' if v[place] > 0.0 else '-'}{'ZX'[place]}"
        told = f"{'+' if corner.sign > 0.0 else '-'}{corner.axis}" if corner.axis else f"{'+' if corner.sign > 0.0 else '-'}{'ZX'[place]}"
        fact = f"{corner.text} says that the next move goes to {told}, and it goes to {way}."
        raise Fault(fact, "Correct the sign or the letter.")
