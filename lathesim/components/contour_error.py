"""The distance of the tool from its path: the nearest point of the path, exact and as the literature estimates it."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from lathesim.component import ON, Component, DiscreteState, Input, Output, Parameter, Table
from lathesim.components.free_paths import CURVE_COLUMNS, EXAMPLE_CURVE, curvature_at, nearest_on, point_of
from lathesim.components.interpolator import EXAMPLE_PATH, point_on_path, tangent_on_path
from lathesim.components.threads import TWO_PI
from lathesim.path_columns import (
    ARC_MOVE,
    CENTRE_X,
    CENTRE_Z,
    END_X,
    END_Z,
    KIND,
    LENGTH,
    PATH_COLUMNS,
    RADIUS,
    START_ANGLE,
    START_X,
    START_Z,
    SWEEP,
)

_ROUNDING = 1e-12
"""Distance [m] below which two places are one."""


class ContourError(Component):
    """Gives the contour error: the shortest distance from the tool to the line or circle of the present block.

    Line, with cos = direction_z and sin = direction_x of the block:  eps = e_x cos - e_z sin,  e = reference - position       (10)
    Arc about (X_c, Z_c) with radius R:  eps = sqrt((x - X_c)^2 + (z - Z_c)^2) - R, positive outside                            (11)

    Fed with encoder readings it is the *sensed* error a cross-coupling controller acts on, fed with table positions the *actual* one.
    ``deviation`` is the same distance as (10) on lines, and signed alike on arcs; a push of its size along (normal_x, normal_z) leads
    back to the path. Before the first motion there is no direction and the error is 0.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (10) and (11); (10) is misprinted there, cos(v_x/v_r) stands
    for the cosine v_x/v_r. Left out: the ends of a block, past which the line goes on.
    """

    group = "tool and part"

    ports = {"reading": "contour_error"}

    x_reference = Input("m", doc="reference radius of the tool tip")
    z_reference = Input("m", doc="reference z position of the tool tip")
    x_position = Input("m", doc="radius of the tool tip")
    z_position = Input("m", doc="z position of the tool tip")
    direction_x = Input("1", doc="x part of the unit tangent of the path")
    direction_z = Input("1", doc="z part of the unit tangent of the path")
    centre_x = Input("m", default=0.0, doc="centre of the arc, radius coordinate")
    centre_z = Input("m", default=0.0, doc="centre of the arc, z coordinate")
    radius = Input("m", default=0.0, doc="radius of the arc, 0 on lines")

    contour_error = Output("m", doc="contour error, positive left of a line's direction (+z right, +x up) missing, outside of arcs")
    deviation = Output("m", doc="contour error with the sign of (10) on lines and arcs alike")
    normal_x = Output("1", doc="x part of the unit direction in which a positive deviation is made good")
    normal_z = Output("1", doc="z part of that direction")
    x_error = Output("m", doc="reference minus position of the x axis")
    z_error = Output("m", doc="reference minus position of the z axis")

    @staticmethod
    def output(
        x_reference: float, z_reference: float, x_position: float, z_position: float, direction_x: float, direction_z: float,
        centre_x: float, centre_z: float, radius: float,
    ) -> tuple[float, float, float, float, float, float]:  # fmt: skip
        """Equations (10) and (11)."""
        x_error = x_reference - x_position
        z_error = z_reference - z_position
        if radius <= 0.0:
            error = x_error * direction_z - z_error * direction_x
            return error, error, direction_z, -direction_x, x_error, z_error
        off_x = x_position - centre_x
        off_z = z_position - centre_z
        distance = math.sqrt(off_x * off_x + off_z * off_z)
        error = distance - radius
        side = 1.0 if off_z * direction_x - off_x * direction_z >= 0.0 else -1.0
        if distance <= 0.0:
            return error, side * error, side * direction_z, -side * direction_x, x_error, z_error
        return error, side * error, -side * off_x / distance, -side * off_z / distance, x_error, z_error


EXACT, TANGENT, CIRCLE = 0.0, 1.0, 2.0
"""How the deviation is found; above CIRCLE it is two circles."""
_REACH = 4.0
"""A foot point on a later row counts where the way to it along the path is at most so many times the distance to the path: round a corner
it is some twice, on another branch that comes close it is far more."""
_STRAIGHT = 1.0e-9
"""Curvature [1/m] below which a path is straight."""


def along_row(path: Any, row: int, x: float, z: float) -> float:
    """Return how far along a line or arc [m] its point nearest to (x, z) lies, within its ends."""
    length = float(path[row][LENGTH])
    if length <= 0.0 or path[row][KIND] > ARC_MOVE:
        return 0.0
    if path[row][KIND] == ARC_MOVE:
        angle = math.atan2(x - path[row][CENTRE_X], z - path[row][CENTRE_Z])
        sweep = float(path[row][SWEEP])
        side = 1.0 if sweep >= 0.0 else -1.0
        turned = side * (angle - path[row][START_ANGLE])
        # counted from the middle of the arc, so that both ends are clipped alike
        off = turned - 0.5 * abs(sweep)
        off = off - TWO_PI * math.floor(off / TWO_PI + 0.5)
        way = (off / abs(sweep) + 0.5) * length
    else:
        along_x = (path[row][END_X] - path[row][START_X]) / length
        along_z = (path[row][END_Z] - path[row][START_Z]) / length
        way = (x - path[row][START_X]) * along_x + (z - path[row][START_Z]) * along_z
    if way < 0.0:
        return 0.0
    return length if way > length else float(way)


def distance_at(path: Any, row: int, way: float, x: float, z: float) -> float:
    """Return how far (x, z) is from the point a way along a row [m]."""
    on_x, on_z = point_on_path(path, row, way)
    off_x, off_z = on_x - x, on_z - z
    return math.sqrt(off_x * off_x + off_z * off_z)


def bounded_row(number: float, rows: int) -> int:
    """Return the row of a number, within the table."""
    row = int(max(number, 0.0))
    return row if row < rows else rows - 1


def foot_row(path: Any, row: int, last: int, x: float, z: float) -> int:
    """Return the row of the foot point: from the row before on, up to row ``last`` where the reference is, never another branch."""
    best = row
    here = along_row(path, row, x, z)
    least = distance_at(path, row, here, x, z)
    between = float(path[row][LENGTH]) - here if path[row][KIND] <= ARC_MOVE else 0.0
    following = row + 1
    while following <= last:
        if path[following][KIND] <= ARC_MOVE and path[following][LENGTH] > 0.0:
            there = along_row(path, following, x, z)
            distance = distance_at(path, following, there, x, z)
            if distance <= least and between + there <= _REACH * (distance + least) + _ROUNDING:
                best = following
                least = distance
                between = -there
            between = between + float(path[following][LENGTH])
        following += 1
    return best


class FootOutputs:
    """What is told of a foot point, whatever the path is made of."""

    contour_error = Output("m", doc="distance of the tool from the path, signed as the deviation")
    deviation = Output("m", doc="the same: what is to be made good along the normal")
    normal_x = Output("1", doc="x part of the unit direction in which a positive deviation is made good")
    normal_z = Output("1", doc="z part of that direction")
    tangent_x = Output("1", doc="x part of the unit tangent at the foot point")
    tangent_z = Output("1", doc="z part of that tangent")
    lag = Output("m", doc="how far the tool is behind the reference along the tangent")
    curvature = Output("1/m", doc="signed curvature of the path at the foot point")


class FootPoint(FootOutputs, Component):
    """Gives the foot point: the nearest point of the laid path (lines and arcs), and how far the tool is from it.

    deviation = (foot - position) . n,   n = (t_z, -t_x) the normal left of the tangent t;  pushed by it along n the tool is on the path

    It begins at the row where it last was and goes on up to that of the reference, so it never leaps to another branch that comes close;
    at a corner it is the corner itself, where that is nearest. ``method`` 0 is exact; 1 takes the tangent at the reference, 2 the circle
    of curvature there, as the literature does: they are off by (lag)^2 / (2 R) and, where the curvature changes, by (lag)^3 R'/(6 R^2).

    Source: Y. Koren, C. C. Lo, Variable-gain cross-coupling controller for contouring, Annals of the CIRP 40 (1991), for the estimates.
    Left out: a foot point ahead of the reference's block.
    """

    group = "tool and part"

    ports = {"reading": "contour_error"}
    example_tables: ClassVar[dict[str, list[list[float]]]] = {"path": EXAMPLE_PATH}

    path = Table("1", PATH_COLUMNS, doc="the path, one row a segment, SI")

    segment_number = Input("1", doc="row of the path in which the reference is")
    x_reference = Input("m", doc="reference radius of the tool tip")
    z_reference = Input("m", doc="reference z position of the tool tip")
    direction_x = Input("1", doc="x part of the unit tangent at the reference")
    direction_z = Input("1", doc="z part of the unit tangent at the reference")
    x_position = Input("m", doc="radius of the tool tip")
    z_position = Input("m", doc="z position of the tool tip")

    method = Parameter("1", 0.0, low=0.0, high=2.0, doc="0 exact foot point, 1 tangent, 2 circle of curvature")

    row = DiscreteState("1", doc="row of the path in which the foot point is")
    way = DiscreteState("m", doc="how far along that row it is")
    last_row = DiscreteState("1", doc="row in which the reference was a sample before")

    foot_x = Output("m", doc="foot point, radius coordinate")
    foot_z = Output("m", doc="foot point, z coordinate")

    @staticmethod
    def update(path: Any, segment_number: float, x_position: float, z_position: float, row: float) -> tuple[float, float, float]:
        rows = len(path)
        if rows == 0:
            return 0.0, 0.0, 0.0
        last = bounded_row(segment_number, rows)
        found = foot_row(path, bounded_row(row, rows), last, x_position, z_position)
        return found * 1.0, along_row(path, found, x_position, z_position), segment_number

    @staticmethod
    def output(
        path: Any, segment_number: float, x_reference: float, z_reference: float, direction_x: float, direction_z: float, x_position: float,
        z_position: float, method: float, row: float,
    ) -> tuple[float, ...]:  # fmt: skip
        """The foot point of the present position, in the row of this sample."""
        rows = len(path)
        if rows == 0:
            return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        here = bounded_row(row if method < EXACT + 0.5 else segment_number, rows)
        x_error = x_reference - x_position
        z_error = z_reference - z_position
        bend = 0.0
        if path[here][KIND] == ARC_MOVE and path[here][RADIUS] > 0.0:
            bend = (1.0 if path[here][SWEEP] >= 0.0 else -1.0) / float(path[here][RADIUS])
        if method > EXACT + 0.5:
            deviation, normal_x, normal_z = estimate(x_error, z_error, direction_x, direction_z, bend if method > TANGENT + 0.5 else 0.0)
            lag = x_error * direction_x + z_error * direction_z
            return (
                deviation, deviation, normal_x, normal_z, direction_x, direction_z, lag, bend,
                x_position + deviation * normal_x, z_position + deviation * normal_z,
            )  # fmt: skip
        way = along_row(path, here, x_position, z_position)
        foot_x, foot_z = point_on_path(path, here, way)
        along_x = direction_x
        along_z = direction_z
        if path[here][KIND] <= ARC_MOVE and path[here][LENGTH] > 0.0:
            along_x, along_z = tangent_on_path(path, here, way)
        off_x = foot_x - x_position
        off_z = foot_z - z_position
        normal_x = along_z
        normal_z = -along_x
        across = off_x * normal_x + off_z * normal_z
        distance = math.sqrt(off_x * off_x + off_z * off_z)
        if distance - abs(across) > _ROUNDING:
            # nearest is an end of the row: straight towards it
            side = 1.0 if across >= 0.0 else -1.0
            normal_x = side * off_x / distance
            normal_z = side * off_z / distance
            across = side * distance
        lag = x_error * along_x + z_error * along_z
        return across, across, normal_x, normal_z, along_x, along_z, lag, bend, foot_x, foot_z


def estimate(x_error: float, z_error: float, direction_x: float, direction_z: float, curvature: float) -> tuple[float, float, float]:
    """Return the deviation from the tangent (curvature 0) or the circle of curvature at the reference, and the normal to make it good.

    The circle's centre lies at 1/curvature to the left of the reference; the deviation is its radius less the distance from there, signed.
    """
    across = x_error * direction_z - z_error * direction_x
    if abs(curvature) < _STRAIGHT:
        return across, direction_z, -direction_x
    # from the tool to the centre of the circle
    to_x = x_error + direction_z / curvature
    to_z = z_error - direction_x / curvature
    distance = math.sqrt(to_x * to_x + to_z * to_z)
    if distance <= 0.0:
        return across, direction_z, -direction_x
    side = 1.0 if curvature > 0.0 else -1.0
    return side * (distance - abs(1.0 / curvature)), side * to_x / distance, side * to_z / distance


class FreeFootPoint(FootOutputs, Component):
    """Gives the foot point on a free path of cubic pieces, and how far the tool is from it.

    Solves (p(u) - q) . p'(u) = 0 by Newton's method from where the foot point was before, with steps too short to leap to another branch;
    deviation = (foot - position) . n as FootPoint. ``method`` 0 is exact, 1 the tangent at the reference, 2 the circle of curvature
    there, 3 two circles: the first tells how far back along the path the foot point lies, the circle of the path there is the second.

    Source: Y. Koren, C. C. Lo, Annals of the CIRP 40 (1991); S.-S. Yeh, P.-L. Hsu, Estimation of the contouring error vector for the
    cross-coupled control design, IEEE/ASME Trans. Mechatronics 7 (2002), for the estimates.
    """

    group = "tool and part"

    ports = {"reading": "contour_error"}
    example_tables: ClassVar[dict[str, list[list[float]]]] = {"curve": EXAMPLE_CURVE}

    curve = Table("m", CURVE_COLUMNS, doc="points of the path and their slopes per row")

    place = Input("1", doc="where on the curve the reference stands, in rows")
    x_position = Input("m", doc="radius of the tool tip")
    z_position = Input("m", doc="z position of the tool tip")

    method = Parameter("1", 0.0, low=0.0, high=3.0, doc="0 exact foot point, 1 tangent, 2 circle of curvature, 3 two circles")

    at = DiscreteState("1", doc="where on the curve the foot point is, in rows")
    started = DiscreteState("1", doc="1 after the first sample")

    @staticmethod
    def update(
        curve: Any, place: float, x_position: float, z_position: float, method: float, at: float, started: float
    ) -> tuple[float, float]:
        if method > EXACT + 0.5:
            return place, 1.0
        begin = at if started > ON else place
        return nearest_on(curve, x_position, z_position, begin), 1.0

    @staticmethod
    def output(curve: Any, place: float, x_position: float, z_position: float, method: float, at: float) -> tuple[float, ...]:
        begin = place if method > EXACT + 0.5 else nearest_on(curve, x_position, z_position, at)
        if method > CIRCLE + 0.5:
            begin = _further_back(curve, place, x_position, z_position)
        tx = point_of(curve, begin, 0, 1)
        tz = point_of(curve, begin, 1, 1)
        size = max(math.sqrt(tx * tx + tz * tz), 1e-12)
        along_x = tx / size
        along_z = tz / size
        bend = curvature_at(curve, begin)
        x_error = point_of(curve, begin, 0, 0) - x_position
        z_error = point_of(curve, begin, 1, 0) - z_position
        deviation, normal_x, normal_z = estimate(x_error, z_error, along_x, along_z, bend if method > TANGENT + 0.5 else 0.0)
        lag = (point_of(curve, place, 0, 0) - x_position) * along_x + (point_of(curve, place, 1, 0) - z_position) * along_z
        if method < EXACT + 0.5:
            distance = math.sqrt(x_error * x_error + z_error * z_error)
            deviation = distance if deviation >= 0.0 else -distance
        return deviation, deviation, normal_x, normal_z, along_x, along_z, lag, bend


def _further_back(curve: Any, place: float, x: float, z: float) -> float:
    """Return where the first of two circles puts the foot point: the reference less the way turned on its circle of curvature."""
    tx = point_of(curve, place, 0, 1)
    tz = point_of(curve, place, 1, 1)
    size = max(math.sqrt(tx * tx + tz * tz), 1e-12)
    x_error = point_of(curve, place, 0, 0) - x
    z_error = point_of(curve, place, 1, 0) - z
    behind = (x_error * tx + z_error * tz) / size
    bend = curvature_at(curve, place)
    if abs(bend) > _STRAIGHT:
        across = (x_error * tz - z_error * tx) / size
        behind = math.atan2(behind, (1.0 / bend + across) * (1.0 if bend > 0.0 else -1.0)) / abs(bend)
    at = place - behind / size
    end = len(curve) - 1.0
    if at < 0.0:
        return 0.0
    return end if at > end else at
