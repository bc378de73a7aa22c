"""Where the centre of a programmed arc lies, and whether it is one.

Seen with +Z to the right and +X up: G02 is clockwise, G03 counterclockwise, a positive sweep counterclockwise. Lengths [m].
Source: NIST RS274NGC Interpreter version 3, section 3.5.3 (radius and centre format); tolerances of LinuxCNC 2.9 rs274.
"""

from __future__ import annotations

import math

from lathesim.errors import ProgramError
from lathesim.program.moves import Arc

RADIUS_TOLERANCE = 2.83e-5  # [m] radii may differ so much ... Source: LinuxCNC 2.9 rs274
RELATIVE_TOLERANCE = 1e-3  # ... or by this share of the radius ...
LARGEST_DIFFERENCE = 2.83e-3  # [m] ... but never by more than this
CHORD_TOLERANCE = 5e-6  # [m] half a chord may exceed R by this, assumed: coordinates come rounded to 1 um or 0.0001 inch
SAME_POINT = 1e-9  # [m] points nearer than this are one, assumed: far below any programmed digit

Point = tuple[float, float]  # (x, z) [m]

_FULL_TURN = 2.0 * math.pi


def arc_by_centre(
    start: tuple[float, float], end: tuple[float, float], centre: tuple[float, float], clockwise: bool, place: str, code: str
) -> Arc:
    """Return the arc from start to end (x, z) about ``centre``; equal ends make a full circle.

    Raises :class:`ProgramError` where the centre coincides with the start or is not equally far from both ends.
    """
    radius = math.hypot(start[0] - centre[0], start[1] - centre[1])
    end_radius = math.hypot(end[0] - centre[0], end[1] - centre[1])
    if radius < SAME_POINT:
        raise ProgramError(f"{code} has its centre where it starts.", place=place, remedy="I and K point from the start to the centre.")
    difference = abs(end_radius - radius)
    if difference > LARGEST_DIFFERENCE or (difference > RADIUS_TOLERANCE and difference > RELATIVE_TOLERANCE * radius):
        raise ProgramError(
            f"{code} ends {1e3 * end_radius:.4f} mm from its centre and starts {1e3 * radius:.4f} mm from it.",
            place=place,
            remedy="Correct I and K, or the end point, so that both lie on one circle.",
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


def arc_by_radius(start: Point, end: Point, radius: float, clockwise: bool, place: str, code: str) -> Arc:
    """Return the arc of this radius from start to end (x, z); a negative radius takes the longer way round.

    Raises :class:`ProgramError` where the ends are one point or too far apart.
    """
    across, along = end[0] - start[0], end[1] - start[1]
    chord = math.hypot(across, along)
    if radius == 0.0:
        raise ProgramError(f"{code} has the radius 0.", place=place, remedy="Give R, or the centre with I and K.")
    if chord < SAME_POINT:
        raise ProgramError(
            f"{code} with R ends where it starts, so its centre could lie anywhere.",
            place=place,
            remedy="Give the centre of a full circle with I and K.",
        )
    size = abs(radius)
    if 0.5 * chord > size + CHORD_TOLERANCE:
        raise ProgramError(
            f"{code} has the radius {1e3 * size:.4f} mm, too small to reach its end {1e3 * chord:.4f} mm away.",
            place=place,
            remedy=f"It takes {500.0 * chord:.4f} mm at least.",
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
