"""Programmed moves to the moves of the tool point, where nose compensation is on.

The centre of the nose runs at the nose radius beside the contour: lines are shifted, arcs get another radius. Round outer corners it
swings about the corner, in inner corners the shifted moves meet. The first compensated move starts where the tool stands; on Fanuc it ends
beside the beginning of the next one. The move behind the last one starts beside the end of that one.

Source: LinuxCNC 2.9 manual, chapter Tool Compensation; Fanuc 0i-T operator's manual, tool nose radius compensation. Left out: a look at
more than the next move, so that a nose too large for a groove is refused only where two neighbouring moves do not meet.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from lathesim.errors import Fault
from lathesim.program.moves import LEFT, Arc, Move, Nose
from lathesim.units import in_unit

_NO_TURN = 1e-9
"""Angle [rad] of an arc that turns by nothing: rounding."""
_SAME = 1e-9
"""[m] below this, two places are one."""
_TANGENT = 1e-4
"""[rad] below this, two moves join smoothly, assumed: coordinates come rounded to 1 um."""
_SLACK = 2e-6
"""[m] how much a shifted move may be too short, assumed: coordinates come rounded to 1 um."""

Point = tuple[float, float]  # (z, x) [m]


@dataclass
class _Side:
    """A shifted move: its ends, and the centre and radius of an arc."""

    move: Move
    start: Point
    end: Point
    centre: Point | None = None
    radius: float = 0.0


def compensated(moves: Sequence[Move]) -> list[list[Move]]:
    """Return for each move the moves that the tool point makes for it.

    Raises :class:`Fault` where the nose does not reach the contour, and where compensation begins or ends with an arc.
    """
    found: list[list[Move]] = [[move] for move in moves]
    run: list[int] = []
    here: Point | None = None
    for index, move in enumerate(moves):
        if run and move.nose != moves[run[-1]].nose and _moves(move):
            here = _carry_out(run, moves, found, here)
            run = []
        if move.nose is not None and _moves(move):
            run.append(index)
        elif here is not None and _moves(move):
            if move.arc is not None:
                raise Fault("Nose compensation ends with an arc.", "End it with G0 or G1.", move.line)
            found[index] = [replace(move, start_x=here[1], start_z=here[0])]
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
                if math.dist(meeting, piece.end) > _SAME:
                    found = [*found[: -1 if math.dist(meeting, found[-1].start) <= _SAME else None], piece]
                break
            found.pop()
        else:
            found.append(piece)
    made = [_made(part) for part in found]
    lost = contour[0] if not found or found[0].move is not contour[0] else contour[-1] if found[-1].move is not contour[-1] else None
    near = lost or next((move for part in made for move in contour if _near(part, move, distance - _SLACK)), None)
    if near is not None:
        fact = f"A contour at a distance of {in_unit(distance, 'mm')} does not fit into the corners of this move."
        raise Fault(fact, "Take a smaller distance, or a longer move.", near.line)
    return made


def _made(part: _Side) -> Move:
    ends = {"start_x": part.start[1], "start_z": part.start[0], "end_x": part.end[1], "end_z": part.end[0]}
    return replace(part.move, **ends, arc=_arc_of(part, (0.0, 0.0)))  # type: ignore[arg-type]


def _near(first: Move, second: Move, distance: float) -> bool:
    """Return whether two moves are closer than a distance [m], tested at nine points of each."""
    return _nearer(first, second, distance) or _nearer(second, first, distance)


def _nearer(move: Move, other: Move, distance: float) -> bool:
    """Return whether one of nine points of a move is closer to another move than a distance [m]."""
    for number in range(9):
        share = number / 8.0
        if move.arc is not None:
            angle = move.arc.start_angle + share * move.arc.sweep
            z, x = move.arc.centre_z + move.arc.radius * math.cos(angle), move.arc.centre_x + move.arc.radius * math.sin(angle)
        else:
            z, x = move.start_z + share * (move.end_z - move.start_z), move.start_x + share * (move.end_x - move.start_x)
        if _away(z, x, other) < distance:
            return True
    return False


def _away(z: float, x: float, move: Move) -> float:
    """Return the distance [m] between a point and a move."""
    if move.arc is not None:
        dz, dx = z - move.arc.centre_z, x - move.arc.centre_x
        angle = math.atan2(dx, dz) - move.arc.start_angle
        if (-angle if move.arc.clockwise else angle) % (2.0 * math.pi) <= abs(move.arc.sweep):
            return abs(math.hypot(dz, dx) - move.arc.radius)
        return min(math.hypot(z - move.start_z, x - move.start_x), math.hypot(z - move.end_z, x - move.end_x))
    along = (move.end_z - move.start_z, move.end_x - move.start_x)
    share = ((z - move.start_z) * along[0] + (x - move.start_x) * along[1]) / (along[0] ** 2 + along[1] ** 2)
    share = min(1.0, max(0.0, share))
    return math.hypot(z - move.start_z - share * along[0], x - move.start_x - share * along[1])


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
            corner = (move.start_z, move.start_x)
            swing = _swing(before, after, corner, nose, abs(turn))
            yield _Side(swing, before.end, after.start, corner, nose.radius), True
        yield after, before is not None and (abs(turn) < _TANGENT or turn * nose.side < 0.0)
        before = after


def _turn(before: Move, after: Move) -> float:
    """Return the angle [rad] by which a move turns left from the previous one."""
    t1, t2 = _tangent(before, at_end=True), _tangent(after, at_end=False)
    return math.atan2(t1[0] * t2[1] - t1[1] * t2[0], t1[0] * t2[0] + t1[1] * t2[1])


def _moves(move: Move) -> bool:
    return move.arc is not None or math.hypot(move.end_x - move.start_x, move.end_z - move.start_z) > _SAME


def _joined(found: list[list[Move]]) -> list[list[Move]]:
    """Let every move without a length, as a dwell, stand where the tool is."""
    here: Point | None = None
    for index, made in enumerate(found):
        if here is not None and not any(_moves(move) for move in made):
            found[index] = [replace(move, start_x=here[1], start_z=here[0], end_x=here[1], end_z=here[0]) for move in made]
        elif made:
            here = (made[-1].end_z, made[-1].end_x)
    return found


def _carry_out(run: list[int], moves: Sequence[Move], found: list[list[Move]], here: Point | None) -> Point:
    """Compensate the moves of one run and return where the tool point stands behind it."""
    nose = moves[run[0]].nose
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
    point = (nose.point_z, nose.point_x)
    place = (first.start_z, first.start_x) if here is None else here
    for index, side, swing in zip(run, sides, swings, strict=True):
        made = [] if swing is None else [_placed(swing, place, point)]
        if made:
            place = (made[0].end_z, made[0].end_x)
        end = _plus(side.end, point)
        moved = replace(side.move, start_x=place[1], start_z=place[0], end_x=end[1], end_z=end[0], arc=_arc_of(side, point))
        found[index] = [*made, moved]
        place = end
    return place


def _shifted(move: Move, nose: Nose) -> _Side:
    """Return a move shifted by the nose radius to its side."""
    start, end = (move.start_z, move.start_x), (move.end_z, move.end_x)
    shift = nose.radius * nose.side
    n1, n2 = _left(_tangent(move, at_end=False)), _left(_tangent(move, at_end=True))
    begin, finish = (start[0] + shift * n1[0], start[1] + shift * n1[1]), (end[0] + shift * n2[0], end[1] + shift * n2[1])
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
    return _Side(move, begin, finish, (move.arc.centre_z, move.arc.centre_x), max(radius, 0.0))


def _tangent(move: Move, *, at_end: bool) -> Point:
    """Return the direction (z, x) of a move at one of its ends."""
    if move.arc is None:
        length = math.hypot(move.end_z - move.start_z, move.end_x - move.start_x)
        return (move.end_z - move.start_z) / length, (move.end_x - move.start_x) / length
    angle = move.arc.start_angle + (move.arc.sweep if at_end else 0.0)
    turn = -1.0 if move.arc.clockwise else 1.0
    return -turn * math.sin(angle), turn * math.cos(angle)


def _left(direction: Point) -> Point:
    return -direction[1], direction[0]


def _plus(first: Point, second: Point) -> Point:
    return first[0] + second[0], first[1] + second[1]


def _corner(before: _Side, after: _Side, nose: Nose) -> Move | None:
    """Join two shifted moves: return the swing round an outer corner, or move both ends to where they meet in an inner one."""
    turn = _turn(before.move, after.move)
    corner = (before.move.end_z, before.move.end_x)
    if abs(turn) < _TANGENT:
        after.start = before.end
        return None
    if turn * nose.side < 0.0 or abs(turn) > math.pi - _TANGENT:
        return _swing(before, after, corner, nose, abs(turn))
    meeting = _meeting(before, after, corner)
    if meeting is None or _overrun(before, meeting, at_end=True) or _overrun(after, meeting, at_end=False):
        raise Fault(
            f"The nose radius of {in_unit(nose.radius, 'mm')} does not go into the corner at X {in_unit(corner[1], 'mm')} (radius), "
            f"Z {in_unit(corner[0], 'mm')}.",
            "Take a tool with a smaller nose, or make the moves beside the corner longer.",
            after.move.line,
        )
    before.end = after.start = meeting
    return None


def _swing(before: _Side, after: _Side, corner: Point, nose: Nose, angle: float) -> Move:
    """Return the arc of the nose's centre about an outer corner; a straight rapid between rapids."""
    sweep = -nose.side * angle
    begin = math.atan2(before.end[1] - corner[1], before.end[0] - corner[0])
    move = after.move
    if move.kind == "rapid":
        return replace(move, start_z=before.end[0], start_x=before.end[1], end_z=after.start[0], end_x=after.start[1])
    arc = Arc(corner[1], corner[0], nose.radius, nose.radius, begin, sweep)
    return replace(move, kind="arc", start_z=before.end[0], start_x=before.end[1], end_z=after.start[0], end_x=after.start[1], arc=arc)


def _placed(swing: Move, place: Point, point: Point) -> Move:
    """Return a swing with the tool point instead of the centre of the nose."""
    arc = swing.arc
    if arc is not None:
        arc = replace(arc, centre_x=arc.centre_x + point[1], centre_z=arc.centre_z + point[0])
    return replace(swing, start_z=place[0], start_x=place[1], end_z=swing.end_z + point[0], end_x=swing.end_x + point[1], arc=arc)


def _arc_of(side: _Side, point: Point) -> Arc | None:
    """Return the arc of the tool point for a shifted arc, between the ends that its corners gave it."""
    arc, centre = side.move.arc, side.centre
    if arc is None or centre is None:
        return None
    begin = math.atan2(side.start[1] - centre[1], side.start[0] - centre[0])
    finish = math.atan2(side.end[1] - centre[1], side.end[0] - centre[0])
    full = 2.0 * math.pi
    sweep = (begin - finish if arc.clockwise else finish - begin) % full
    if sweep < _NO_TURN or sweep > full - _NO_TURN:
        sweep = full if abs(arc.sweep) > math.pi else 0.0
    if side.radius <= _SAME:
        begin, sweep = arc.start_angle, abs(arc.sweep)
    at = _plus(centre, point)
    return Arc(at[1], at[0], side.radius, side.radius, begin, -sweep if arc.clockwise else sweep)


def _meeting(before: _Side, after: _Side, corner: Point) -> Point | None:
    """Return where two shifted moves meet, nearest to their corner."""
    if before.centre is None and after.centre is None:
        points = _line_line(before, after)
    elif before.centre is None:
        points = _line_circle(before, after)
    elif after.centre is None:
        points = _line_circle(after, before)
    else:
        points = _circle_circle(before, after)
    return min(points, key=lambda point: math.hypot(point[0] - corner[0], point[1] - corner[1]), default=None)


def _line_line(first: _Side, second: _Side) -> list[Point]:
    d1 = (first.end[0] - first.start[0], first.end[1] - first.start[1])
    d2 = (second.end[0] - second.start[0], second.end[1] - second.start[1])
    cross = d1[0] * d2[1] - d1[1] * d2[0]
    if cross == 0.0:
        return []
    share = ((second.start[0] - first.start[0]) * d2[1] - (second.start[1] - first.start[1]) * d2[0]) / cross
    return [(first.start[0] + share * d1[0], first.start[1] + share * d1[1])]


def _line_circle(line: _Side, circle: _Side) -> list[Point]:
    centre = circle.centre or (0.0, 0.0)
    d = (line.end[0] - line.start[0], line.end[1] - line.start[1])
    length = math.hypot(*d)
    u = (d[0] / length, d[1] / length)
    along = (centre[0] - line.start[0]) * u[0] + (centre[1] - line.start[1]) * u[1]
    foot = (line.start[0] + along * u[0], line.start[1] + along * u[1])
    away = math.hypot(centre[0] - foot[0], centre[1] - foot[1])
    if away > circle.radius + _SLACK:
        return []
    half = math.sqrt(max(0.0, circle.radius * circle.radius - away * away))
    return [(foot[0] + sign * half * u[0], foot[1] + sign * half * u[1]) for sign in (-1.0, 1.0)]


def _circle_circle(first: _Side, second: _Side) -> list[Point]:
    c1, c2 = first.centre or (0.0, 0.0), second.centre or (0.0, 0.0)
    between = math.hypot(c2[0] - c1[0], c2[1] - c1[1])
    if between < _SAME or between > first.radius + second.radius + _SLACK or between < abs(first.radius - second.radius) - _SLACK:
        return []
    along = (first.radius**2 - second.radius**2 + between**2) / (2.0 * between)
    half = math.sqrt(max(0.0, first.radius**2 - along**2))
    u = ((c2[0] - c1[0]) / between, (c2[1] - c1[1]) / between)
    foot = (c1[0] + along * u[0], c1[1] + along * u[1])
    return [(foot[0] - sign * half * u[1], foot[1] + sign * half * u[0]) for sign in (-1.0, 1.0)]


def _overrun(side: _Side, meeting: Point, *, at_end: bool) -> bool:
    """Return whether a shifted move would have to run backwards to the place where it meets its neighbour."""
    if side.centre is not None:
        if side.radius <= _SLACK:
            return False
        fixed = side.start if at_end else side.end
        used = _angle(side, fixed, meeting) if at_end else _angle(side, meeting, fixed)
        whole = _angle(side, side.start, side.end)
        return side.radius * used > side.radius * whole + _SLACK and side.radius * (2.0 * math.pi - used) > _SLACK
    d = (side.end[0] - side.start[0], side.end[1] - side.start[1])
    length = math.hypot(*d)
    fixed = side.start if at_end else side.end
    left = ((meeting[0] - fixed[0]) * d[0] + (meeting[1] - fixed[1]) * d[1]) / length
    return (left if at_end else -left) < -_SLACK


def _angle(side: _Side, start: Point, end: Point) -> float:
    centre = side.centre or (0.0, 0.0)
    begin = math.atan2(start[1] - centre[1], start[0] - centre[0])
    finish = math.atan2(end[1] - centre[1], end[0] - centre[0])
    clockwise = side.move.arc is not None and side.move.arc.clockwise
    return (begin - finish if clockwise else finish - begin) % (2.0 * math.pi)
