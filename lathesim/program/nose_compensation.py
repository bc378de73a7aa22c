"""Programmed moves to the moves of the tool point, where nose compensation is on.

The centre of the nose runs at the nose radius beside the contour: lines are shifted, arcs get another radius. Round outer corners it
swings about the corner, in inner corners the shifted moves meet. The first compensated move starts where the tool stands; on Fanuc it ends
beside the beginning of the next one. The move behind the last one starts beside the end of that one.

Source: LinuxCNC 2.9 manual, chapter Tool Compensation; Fanuc 0i-T operator's manual, tool nose radius compensation. Left out: a look at
more than the next move, so that a nose too large for a groove is refused only where two neighbouring moves do not meet.
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from lathesim.errors import Fault
from lathesim.program.moves import LEFT, Arc, Move, Nose, turned
from lathesim.units import in_unit

_NO_TURN = 1e-9
"""Angle [rad] of an arc that turns by nothing: rounding."""
_SAME = 1e-9
"""[m] below this, two places are one."""
_TANGENT = 1e-4
"""[rad] below this, two moves join smoothly, assumed: coordinates come rounded to 1 um."""
_SLACK = 2e-6
"""[m] how much a shifted move may be too short, assumed: coordinates come rounded to 1 um."""


@dataclass
class _Side:
    """A shifted move: its ends, and the centre and radius of an arc."""

    move: Move
    start: complex
    end: complex
    centre: complex | None = None
    radius: float = 0.0

    @property
    def way(self) -> complex:
        """From the start to the end [m]."""
        return self.end - self.start


def compensated(moves: Sequence[Move]) -> list[list[Move]]:
    """Return for each move the moves that the tool point makes for it.

    Raises :class:`Fault` where the nose does not reach the contour, and where compensation begins or ends with an arc.
    """
    found: list[list[Move]] = [[move] for move in moves]
    run: list[int] = []
    here: complex | None = None
    for index, move in enumerate(moves):
        if run and move.mode.nose != moves[run[-1]].mode.nose and _moves(move):
            here = _carry_out(run, moves, found, here)
            run = []
        if move.mode.nose is not None and _moves(move):
            run.append(index)
        elif here is not None and _moves(move):
            if move.arc is not None:
                raise Fault("Nose compensation ends with an arc.", "End it with G0 or G1.", move.line)
            found[index] = [move.between(here, move.end)]
            here = None
    if run:
        _carry_out(run, moves, found, here)
    return _joined(found)


def beside(moves: Sequence[Move], side: int, distance: float) -> list[Move]:
    """Return a contour shifted by a ``distance`` [m] to its ``side``, LEFT or RIGHT.

    Moves too close to their neighbours, such as a small step in a corner, are left out, and the neighbours meet. Raises
    :class:`Fault` if the contour still does not keep the distance.
    """
    if distance <= _SAME:
        return list(moves)
    nose = Nose(side, distance, 0.0, 0.0)
    contour = [move for move in moves if _moves(move)]
    found: list[_Side] = []
    for piece, joined in _pieces(contour, nose):
        if joined and found and found[-1].end == piece.start:
            found.append(piece)
            continue
        while found:
            meeting = _meeting(found[-1], piece, piece.start)
            shorter = meeting is None and piece.move.length < found[-1].move.length
            if shorter or (meeting is not None and _overrun(piece, meeting, at_end=False)):
                break
            if meeting is not None and not _overrun(found[-1], meeting, at_end=True):
                found[-1].end = piece.start = meeting
                if abs(piece.end - meeting) > _SAME:
                    found = [*found[: -1 if abs(found[-1].start - meeting) <= _SAME else None], piece]
                break
            found.pop()
        else:
            found.append(piece)
    made = [part.move.between(part.start, part.end, arc=_arc_of(part, 0.0)) for part in found]
    lost = contour[0] if not found or found[0].move is not contour[0] else contour[-1] if found[-1].move is not contour[-1] else None
    near = lost or next((move for part in made for move in contour if _near(part, move, distance - _SLACK)), None)
    if near is not None:
        fact = f"A contour at a distance of {in_unit(distance, 'mm')} does not fit into the corners of this move."
        raise Fault(fact, "Take a smaller distance, or a longer move.", near.line)
    return made


def _near(first: Move, second: Move, distance: float) -> bool:
    """Return whether two moves are closer than a distance [m], tested at nine points of each."""
    return _nearer(first, second, distance) or _nearer(second, first, distance)


def _nearer(move: Move, other: Move, distance: float) -> bool:
    """Return whether one of nine points of a move is closer to another move than a distance [m]."""
    for number in range(9):
        share = number / 8.0
        arc = move.arc
        place = move.start + share * (move.end - move.start) if arc is None else arc.at(arc.start_angle + share * arc.sweep)
        if _away(place, other) < distance:
            return True
    return False


def _away(place: complex, move: Move) -> float:
    """Return the distance [m] between a place and a move."""
    if move.arc is not None:
        from_centre = place - move.arc.centre
        angle = cmath.phase(from_centre) - move.arc.start_angle
        if (-angle if move.arc.clockwise else angle) % (2.0 * math.pi) <= abs(move.arc.sweep):
            return abs(abs(from_centre) - move.arc.radius)
        return min(abs(place - move.start), abs(place - move.end))
    along = move.end - move.start
    share = _dot(place - move.start, along) / _dot(along, along)
    return abs(place - move.start - min(1.0, max(0.0, share)) * along)


def _dot(first: complex, second: complex) -> float:
    return (first.conjugate() * second).real


def _cross(first: complex, second: complex) -> float:
    return (first.conjugate() * second).imag


def _pieces(moves: Sequence[Move], nose: Nose) -> Iterator[tuple[_Side, bool]]:
    """Yield the shifted moves with the swings about outer corners, and whether each begins at the end of the previous one."""
    before: _Side | None = None
    for move in moves:
        if move.arc is not None and move.arc.radius < nose.radius + _SAME and move.arc.clockwise != (nose.side == LEFT):
            before = None  # it vanishes
            continue
        after = _shifted(move, nose)
        turn = 0.0 if before is None else _turn(before.move, move)
        if before is not None and abs(turn) < _TANGENT:
            after.start = before.end
        elif before is not None and turn * nose.side < 0.0:
            yield _Side(_swing(before, after, move.start, nose, abs(turn)), before.end, after.start, move.start, nose.radius), True
        yield after, before is not None and (abs(turn) < _TANGENT or turn * nose.side < 0.0)
        before = after


def _turn(before: Move, after: Move) -> float:
    """Return the angle [rad] by which a move turns left from the previous one."""
    return cmath.phase(_tangent(before, at_end=True).conjugate() * _tangent(after, at_end=False))


def _moves(move: Move) -> bool:
    return move.arc is not None or move.length > _SAME


def _joined(found: list[list[Move]]) -> list[list[Move]]:
    """Let every move without a length, as a dwell, stand where the tool is."""
    here: complex | None = None
    for index, made in enumerate(found):
        if here is not None and not any(_moves(move) for move in made):
            found[index] = [move.between(here, here) for move in made]
        elif made:
            here = made[-1].end
    return found


def _carry_out(run: list[int], moves: Sequence[Move], found: list[list[Move]], here: complex | None) -> complex:
    """Compensate the moves of one run and return where the tool point stands behind it."""
    nose = moves[run[0]].mode.nose
    assert nose is not None
    first = moves[run[0]]
    if first.arc is not None and here is None:
        raise Fault("Nose compensation begins with an arc.", "Begin it with G0 or G1 to the contour.", first.line)
    sides = [_shifted(moves[index], nose) for index in run]
    swings: list[Move | None] = [None]
    for before, after in itertools.pairwise(sides):
        if nose.starts_beside and before is sides[0]:
            before.end = after.start
            swings.append(None)
        else:
            swings.append(_corner(before, after, nose))
    point = complex(nose.point_z, nose.point_x)
    place = first.start if here is None else here
    for index, side, swing in zip(run, sides, swings, strict=True):
        made = [] if swing is None else [_placed(swing, place, point)]
        if made:
            place = made[0].end
        end = side.end + point
        found[index] = [*made, side.move.between(place, end, arc=_arc_of(side, point))]
        place = end
    return place


def _shifted(move: Move, nose: Nose) -> _Side:
    """Return a move shifted by the nose radius to its side."""
    left = nose.radius * nose.side * 1j
    begin, finish = move.start + left * _tangent(move, at_end=False), move.end + left * _tangent(move, at_end=True)
    if move.arc is None:
        return _Side(move, begin, finish)
    grows = move.arc.clockwise == (nose.side == LEFT)
    radius = move.arc.radius + (nose.radius if grows else -nose.radius)
    if radius < -_SLACK:
        raise Fault(
            f"The nose radius of {in_unit(nose.radius, 'mm')} does not go into the arc of radius {in_unit(move.arc.radius, 'mm')}.",
            "Take a tool with a smaller nose, or a larger arc.",
            move.line,
        )
    return _Side(move, begin, finish, move.arc.centre, max(radius, 0.0))


def _tangent(move: Move, *, at_end: bool) -> complex:
    """Return the direction of a move at one of its ends."""
    if move.arc is None:
        return (move.end - move.start) / move.length
    angle = move.arc.start_angle + (move.arc.sweep if at_end else 0.0)
    return (-1j if move.arc.clockwise else 1j) * cmath.rect(1.0, angle)


def _corner(before: _Side, after: _Side, nose: Nose) -> Move | None:
    """Join two shifted moves: return the swing round an outer corner, or move both ends to where they meet in an inner one."""
    turn = _turn(before.move, after.move)
    corner = before.move.end
    if abs(turn) < _TANGENT:
        after.start = before.end
        return None
    if turn * nose.side < 0.0 or abs(turn) > math.pi - _TANGENT:
        return _swing(before, after, corner, nose, abs(turn))
    meeting = _meeting(before, after, corner)
    if meeting is None or _overrun(before, meeting, at_end=True) or _overrun(after, meeting, at_end=False):
        raise Fault(
            f"The nose radius of {in_unit(nose.radius, 'mm')} does not go into the corner at X {in_unit(corner.imag, 'mm')} (radius), "
            f"Z {in_unit(corner.real, 'mm')}.",
            "Take a tool with a smaller nose, or make the moves beside the corner longer.",
            after.move.line,
        )
    before.end = after.start = meeting
    return None


def _swing(before: _Side, after: _Side, corner: complex, nose: Nose, angle: float) -> Move:
    """Return the arc of the nose's centre about an outer corner; a straight rapid between rapids."""
    sweep = -nose.side * angle
    if after.move.kind == "rapid":
        return after.move.between(before.end, after.start)
    arc = Arc(corner.imag, corner.real, nose.radius, nose.radius, cmath.phase(before.end - corner), sweep)
    return after.move.between(before.end, after.start, kind="arc", arc=arc)


def _placed(swing: Move, place: complex, point: complex) -> Move:
    """Return a swing with the tool point instead of the centre of the nose."""
    arc = swing.arc
    if arc is not None:
        arc = replace(arc, centre_x=arc.centre_x + point.imag, centre_z=arc.centre_z + point.real)
    return swing.between(place, swing.end + point, arc=arc)


def _arc_of(side: _Side, point: complex) -> Arc | None:
    """Return the arc of the tool point for a shifted arc, between the ends that its corners gave it."""
    arc, centre = side.move.arc, side.centre
    if arc is None or centre is None:
        return None
    full = 2.0 * math.pi
    begin, sweep = cmath.phase(side.start - centre), turned(centre, side.start, side.end, clockwise=arc.clockwise)
    if sweep < _NO_TURN or sweep > full - _NO_TURN:
        sweep = full if abs(arc.sweep) > math.pi else 0.0
    if side.radius <= _SAME:
        begin, sweep = arc.start_angle, abs(arc.sweep)
    at = centre + point
    return Arc(at.imag, at.real, side.radius, side.radius, begin, -sweep if arc.clockwise else sweep)


def _meeting(before: _Side, after: _Side, corner: complex) -> complex | None:
    """Return where two shifted moves meet, nearest to their corner."""
    if before.centre is None and after.centre is None:
        places = _line_line(before, after)
    elif before.centre is None:
        places = _line_circle(before, after)
    elif after.centre is None:
        places = _line_circle(after, before)
    else:
        places = _circle_circle(before, after)
    return min(places, key=lambda place: abs(place - corner), default=None)


def _line_line(first: _Side, second: _Side) -> list[complex]:
    cross = _cross(first.way, second.way)
    return [] if cross == 0.0 else [first.start + _cross(second.start - first.start, second.way) / cross * first.way]


def _line_circle(line: _Side, circle: _Side) -> list[complex]:
    centre = circle.centre or 0j
    u = line.way / abs(line.way)
    foot = line.start + _dot(centre - line.start, u) * u
    away = abs(centre - foot)
    if away > circle.radius + _SLACK:
        return []
    half = math.sqrt(max(0.0, circle.radius * circle.radius - away * away))
    return [foot - half * u, foot + half * u]


def _circle_circle(first: _Side, second: _Side) -> list[complex]:
    c1, c2 = first.centre or 0j, second.centre or 0j
    between = abs(c2 - c1)
    if between < _SAME or between > first.radius + second.radius + _SLACK or between < abs(first.radius - second.radius) - _SLACK:
        return []
    along = (first.radius**2 - second.radius**2 + between**2) / (2.0 * between)
    half = math.sqrt(max(0.0, first.radius**2 - along**2))
    u = (c2 - c1) / between
    return [c1 + along * u - half * 1j * u, c1 + along * u + half * 1j * u]


def _overrun(side: _Side, meeting: complex, *, at_end: bool) -> bool:
    """Return whether a shifted move would have to run backwards to the place where it meets its neighbour."""
    fixed = side.start if at_end else side.end
    if side.centre is None:
        left = _dot(meeting - fixed, side.way) / abs(side.way)
        return (left if at_end else -left) < -_SLACK
    if side.radius <= _SLACK:
        return False
    used = _angle(side, fixed, meeting) if at_end else _angle(side, meeting, fixed)
    whole = _angle(side, side.start, side.end)
    return side.radius * used > side.radius * whole + _SLACK and side.radius * (2.0 * math.pi - used) > _SLACK


def _angle(side: _Side, start: complex, end: complex) -> float:
    return turned(side.centre or 0j, start, end, clockwise=side.move.arc is not None and side.move.arc.clockwise)
