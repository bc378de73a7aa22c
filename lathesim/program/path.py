"""Moves to the path: the read-only table the interpolator walks along, one row a segment, everything SI, X as a radius.

A point of an arc is ``(cx + r sin(a), cz + r cos(a))`` with ``a = start_angle + sweep * s / length``; the sweep is positive
counterclockwise, seen with +Z to the right and +X up. Moves of no length make no row; what they
change (feed, spindle) stands in the row behind them. A thread directly after a thread continues it while the spindle turns the same
way, as on every control. After any other move it waits for the index.

An arc whose ends are not equally far from its programmed centre (the tolerance allows it) is laid on the true circle through both ends:
the centre moves onto the perpendicular bisector of the chord. Where that would move it far (short or nearly closed arcs), the arc keeps
its centre and a straight row of at most the tolerance closes the gap. So the path has no jumps.
"""

from __future__ import annotations

import cmath
import math
from array import array
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lathesim import path_columns as at
from lathesim.errors import ProgramError
from lathesim.program.moves import Arc, Move, Program, turned

SHORTEST = 1e-12  # [m] shorter moves make no row, assumed: rounding of the arithmetic, no programmed length
_CENTRE_SHIFT = 10.0  # assumed: a centre may move by ten times the difference of the radii before the arc keeps it instead


@dataclass(frozen=True)
class Limits:
    """What the machine can reach: travel of X (radius) and Z [m] and the largest programmed feed [m/s]. Without limits all goes."""

    x_low: float = -math.inf
    x_high: float = math.inf
    z_low: float = -math.inf
    z_high: float = math.inf
    feed: float = math.inf


@dataclass(frozen=True, eq=False)
class Path:
    """The path of a program: ``table`` of shape (segments, 19), columns as in ``path_columns.py``, not writable."""

    table: npt.NDArray[np.float64]

    @property
    def segments(self) -> int:
        """How many rows the table has."""
        return int(self.table.shape[0])


def lay_path(program: Program, limits: Limits | None = None) -> Path:
    """Return the path of a program.

    Raises :class:`ProgramError` with ``file:line`` where a move leaves the travel of the machine or is faster than its largest feed, and
    where nothing moves at all.
    """
    last: list[float] = []
    values = array("d")  # a list would take four times the memory
    for move in program.moves:
        if limits is not None:
            _check_limits(move, limits, f"{program.name}:{move.line}")
        made = _rows(move)
        if made and move.kind == "thread":
            made[0][at.FEED_MODE] = _thread_mode(move, last)
        for last in made:
            values.extend(last)
    if not values:
        raise ProgramError("The program moves nothing.", place=program.name, remedy="Write a G0 or G1 with an end point.")
    table = np.array(values, dtype=np.float64).reshape(-1, len(at.PATH_COLUMNS))
    table.setflags(write=False)
    return Path(table)


def _thread_mode(move: Move, last: list[float]) -> float:
    """Return the feed mode of a thread after the ``last`` row, which is empty at first."""
    if move.mode.spin_back:
        return at.TAP_OUT
    goes_on = last and last[at.FEED_MODE] in (at.THREAD, at.THREAD_ON) and last[at.SPINDLE_DIRECTION] == float(move.mode.spindle.direction)
    return at.THREAD_ON if goes_on else at.THREAD


def _rows(move: Move) -> list[list[float]]:
    """The rows of one move: none, one, or for an arc that needs closing two."""
    if move.kind == "dwell":
        row = _row(move, at.DWELL_PAUSE, 0.0, move.start, move.end)
        row[at.DWELL] = move.mode.seconds
        return [row] if move.mode.seconds > 0.0 else []
    if move.arc is None:
        if move.length < SHORTEST:
            return []
        return [_row(move, at.RAPID if move.kind == "rapid" else at.LINE_MOVE, move.length, move.start, move.end)]
    arc = true_circle(move.arc, move.start, move.end)
    reached = move.end
    if arc is None:
        arc = move.arc
        reached = arc.at(arc.start_angle + arc.sweep)
    row = _row(move, at.ARC_MOVE, abs(arc.sweep) * arc.radius, move.start, reached)
    row[at.CENTRE_X], row[at.CENTRE_Z], row[at.RADIUS] = arc.centre_x, arc.centre_z, arc.radius
    row[at.START_ANGLE], row[at.SWEEP] = arc.start_angle, arc.sweep
    gap = abs(move.end - reached)
    return [row] if gap < SHORTEST else [row, _row(move, at.LINE_MOVE, gap, reached, move.end)]


def true_circle(arc: Arc, start: complex, end: complex) -> Arc | None:
    """Return the arc with its centre on the perpendicular bisector of its ends, or None where that would move the centre too far.

    With the middle M and the unit normal n of the chord, the new centre is ``M + ((C - M) . n) n``.
    """
    difference = abs(arc.end_radius - arc.radius)
    if difference == 0.0:
        return arc
    chord = abs(end - start)
    if chord < SHORTEST:
        return arc if difference < SHORTEST else None
    middle, normal = 0.5 * (start + end), 1j * (end - start) / chord
    centre = middle + ((arc.centre - middle) * normal.conjugate()).real * normal
    if abs(centre - arc.centre) > _CENTRE_SHIFT * difference + SHORTEST:
        return None
    radius, sweep = abs(start - centre), turned(centre, start, end, clockwise=arc.clockwise)
    return Arc(centre.imag, centre.real, radius, radius, cmath.phase(start - centre), -sweep if arc.clockwise else sweep)


def _row(move: Move, kind: float, length: float, start: complex, end: complex) -> list[float]:
    row = [0.0] * len(at.PATH_COLUMNS)
    row[at.KIND], row[at.LENGTH], row[at.LINE] = kind, length, float(move.line)
    row[at.START_X], row[at.START_Z], row[at.END_X], row[at.END_Z] = start.imag, start.real, end.imag, end.real
    row[at.FEED] = move.feed or 0.0
    row[at.START_ANGLE] = move.mode.start_angle
    row[at.FEED_MODE] = at.THREAD if move.kind == "thread" else at.PER_REVOLUTION if move.mode.per_revolution else at.PER_MINUTE
    spindle = move.mode.spindle
    row[at.SPINDLE_DIRECTION] = float(spindle.direction)
    if spindle.direction != 0:
        row[at.SPINDLE_MODE] = at.CONSTANT_SURFACE_SPEED if spindle.surface else at.CONSTANT_SPEED
        row[at.SPINDLE_SPEED] = spindle.speed if spindle.surface else spindle.direction * spindle.speed
        row[at.SPINDLE_LIMIT] = spindle.limit or 0.0
    return row


def _check_limits(move: Move, limits: Limits, line: str) -> None:
    places = [move.start, move.end]
    if move.arc is not None:
        for quarter in range(-8, 9):
            angle = 0.5 * math.pi * quarter
            if 0.0 < (angle - move.arc.start_angle) / move.arc.sweep < 1.0:
                places.append(move.arc.at(angle))
    for name, values, low, high in (
        ("X", [place.imag for place in places], limits.x_low, limits.x_high),
        ("Z", [place.real for place in places], limits.z_low, limits.z_high),
    ):
        for value in values:
            if not low <= value <= high:
                raise ProgramError(
                    f"The move reaches {name} {1e3 * value:.4g} mm, and the machine travels from {1e3 * low:.4g} to {1e3 * high:.4g} mm.",
                    place=line,
                    remedy="Keep the move inside; X is a radius.",
                )
    if move.feed is not None and not move.mode.per_revolution and move.feed > limits.feed:
        raise ProgramError(
            f"The feed of {6e4 * move.feed:.6g} mm/min is above the machine's {6e4 * limits.feed:.6g} mm/min.",
            place=line,
            remedy="Lower F.",
        )
