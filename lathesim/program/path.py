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

import math
from array import array
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lathesim import path_columns as at
from lathesim.errors import ProgramError
from lathesim.program.moves import Arc, Move, Program

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

    name: str
    table: npt.NDArray[np.float64]

    @property
    def segments(self) -> int:
        """How many rows the table has."""
        return int(self.table.shape[0])

    def point(self, row: int, distance: float) -> tuple[float, float]:
        """Return the point (x, z) [m] of a segment at a distance [m] from its start."""
        values = [float(value) for value in self.table[row]]
        share = min(1.0, max(0.0, distance / values[at.LENGTH])) if values[at.LENGTH] > 0.0 else 0.0
        if values[at.KIND] == at.ARC_MOVE:
            angle = values[at.START_ANGLE] + values[at.SWEEP] * share
            return values[at.CENTRE_X] + values[at.RADIUS] * math.sin(angle), values[at.CENTRE_Z] + values[at.RADIUS] * math.cos(angle)
        return (
            values[at.START_X] + share * (values[at.END_X] - values[at.START_X]),
            values[at.START_Z] + share * (values[at.END_Z] - values[at.START_Z]),
        )


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
    return Path(program.name, table)


def _thread_mode(move: Move, last: list[float]) -> float:
    """Return the feed mode of a thread after the ``last`` row, which is empty at first."""
    if move.spin_back:
        return at.TAP_OUT
    goes_on = last and last[at.FEED_MODE] in (at.THREAD, at.THREAD_ON) and last[at.SPINDLE_DIRECTION] == float(move.spindle.direction)
    return at.THREAD_ON if goes_on else at.THREAD


def _rows(move: Move) -> list[list[float]]:
    """The rows of one move: none, one, or for an arc that needs closing two."""
    if move.kind == "dwell":
        row = _row(move, at.DWELL_PAUSE, 0.0, (move.start_x, move.start_z), (move.end_x, move.end_z))
        row[at.DWELL] = move.seconds
        return [row] if move.seconds > 0.0 else []
    start, end = (move.start_x, move.start_z), (move.end_x, move.end_z)
    if move.arc is None:
        length = math.hypot(end[0] - start[0], end[1] - start[1])
        if length < SHORTEST:
            return []
        return [_row(move, at.RAPID if move.kind == "rapid" else at.LINE_MOVE, length, start, end)]
    arc = true_circle(move.arc, start, end)
    reached = end
    if arc is None:
        arc = move.arc
        last = arc.start_angle + arc.sweep
        reached = (arc.centre_x + arc.radius * math.sin(last), arc.centre_z + arc.radius * math.cos(last))
    row = _row(move, at.ARC_MOVE, abs(arc.sweep) * arc.radius, start, reached)
    row[at.CENTRE_X], row[at.CENTRE_Z], row[at.RADIUS] = arc.centre_x, arc.centre_z, arc.radius
    row[at.START_ANGLE], row[at.SWEEP] = arc.start_angle, arc.sweep
    gap = math.hypot(end[0] - reached[0], end[1] - reached[1])
    return [row] if gap < SHORTEST else [row, _row(move, at.LINE_MOVE, gap, reached, end)]


def true_circle(arc: Arc, start: tuple[float, float], end: tuple[float, float]) -> Arc | None:
    """Return the arc with its centre on the perpendicular bisector of its ends, or None where that would move the centre too far.

    With the middle M and the unit normal n of the chord, the new centre is ``M + ((C - M) . n) n``.
    """
    difference = abs(arc.end_radius - arc.radius)
    if difference == 0.0:
        return arc
    across, along = end[0] - start[0], end[1] - start[1]
    chord = math.hypot(across, along)
    if chord < SHORTEST:
        return arc if difference < SHORTEST else None
    middle = (0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1]))
    normal = (-along / chord, across / chord)
    offset = (arc.centre_x - middle[0]) * normal[0] + (arc.centre_z - middle[1]) * normal[1]
    centre = (middle[0] + offset * normal[0], middle[1] + offset * normal[1])
    if math.hypot(centre[0] - arc.centre_x, centre[1] - arc.centre_z) > _CENTRE_SHIFT * difference + SHORTEST:
        return None
    radius = math.hypot(start[0] - centre[0], start[1] - centre[1])
    start_angle = math.atan2(start[0] - centre[0], start[1] - centre[1])
    end_angle = math.atan2(end[0] - centre[0], end[1] - centre[1])
    turn = 2.0 * math.pi
    sweep = -((start_angle - end_angle) % turn) if arc.clockwise else (end_angle - start_angle) % turn
    return Arc(centre[0], centre[1], radius, radius, start_angle, sweep)


def _row(move: Move, kind: float, length: float, start: tuple[float, float], end: tuple[float, float]) -> list[float]:
    row = [0.0] * len(at.PATH_COLUMNS)
    row[at.KIND], row[at.LENGTH], row[at.LINE] = kind, length, float(move.line)
    row[at.START_X], row[at.START_Z], row[at.END_X], row[at.END_Z] = start[0], start[1], end[0], end[1]
    row[at.FEED] = move.feed or 0.0
    row[at.START_ANGLE] = move.start_angle
    row[at.FEED_MODE] = at.THREAD if move.kind == "thread" else at.PER_REVOLUTION if move.per_revolution else at.PER_MINUTE
    spindle = move.spindle
    row[at.SPINDLE_DIRECTION] = float(spindle.direction)
    if spindle.direction != 0:
        row[at.SPINDLE_MODE] = at.CONSTANT_SURFACE_SPEED if spindle.surface else at.CONSTANT_SPEED
        row[at.SPINDLE_SPEED] = spindle.speed if spindle.surface else spindle.direction * spindle.speed
        row[at.SPINDLE_LIMIT] = spindle.limit or 0.0
    return row


def _check_limits(move: Move, limits: Limits, place: str) -> None:
    points = [(move.start_x, move.start_z), (move.end_x, move.end_z)]
    if move.arc is not None:
        arc = move.arc
        for quarter in range(-8, 9):
            angle = 0.5 * math.pi * quarter
            if 0.0 < (angle - arc.start_angle) / arc.sweep < 1.0:
                points.append((arc.centre_x + arc.radius * math.sin(angle), arc.centre_z + arc.radius * math.cos(angle)))
    for name, values, low, high in (
        ("X", [point[0] for point in points], limits.x_low, limits.x_high),
        ("Z", [point[1] for point in points], limits.z_low, limits.z_high),
    ):
        for value in values:
            if not low <= value <= high:
                raise ProgramError(
                    f"The move reaches {name} {1e3 * value:.4g} mm, and the machine travels from {1e3 * low:.4g} to {1e3 * high:.4g} mm.",
                    place=place,
                    remedy="Keep the move inside; X is a radius.",
                )
    if move.feed is not None and not move.per_revolution and move.feed > limits.feed:
        raise ProgramError(
            f"The feed of {6e4 * move.feed:.6g} mm/min is above the machine's {6e4 * limits.feed:.6g} mm/min.",
            place=place,
            remedy="Lower F.",
        )
