"""References without a part program: whole turns of a circle, and a smooth free path of cubic pieces.

A smooth free path: cubic pieces between points, and the nearest point on them.

Columns of the table ``curve`` (one row a point, SI): x, z, and the derivatives x', z' over the number of the row; between two rows the
path is the cubic with these ends, p(u) = h00 p0 + h10 p0' + h01 p1 + h11 p1', u from 0 to 1. A closed path repeats its first point.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from lathesim.component import ON, Component, DiscreteState, Output, Parameter, Table
from lathesim.components.interpolator import ReferenceOutputs
from lathesim.elementary import within

_BENT_AWAY = 0.25
"""Share of the squared tangent below which the second derivative of the distance no longer guides Newton's step."""
_SETTLED = 1.0e-13
"""Relative change of the parameter at which the search has ended."""
_CLOCK = 1e-9
"""Rounding of the clock [s]."""

CURVE_COLUMNS = ("x", "z", "x_slope", "z_slope")
EXAMPLE_CURVE = [[0.0, 0.0, 2e-3, 0.0], [2e-3, 1e-3, 2e-3, 2e-3], [3e-3, 3e-3, 0.0, 2e-3], [2e-3, 5e-3, -2e-3, 2e-3]]
"""Three pieces of some millimetres, for the conformance test."""

_STEPS = 12
_LONGEST_STEP = 0.25
"""Pieces by which Newton's method may go at once: a longer step could end on another branch."""
_FEWEST = 1.0e-30


def point_of(curve: Any, at: float, column: int, order: int) -> float:
    """Return the coordinate (0 x, 1 z) of the point ``at`` (row number with its part), or its first or second derivative over it."""
    last = len(curve) - 2
    row = int(at)
    if row > last:
        row = last
    if row < 0:
        row = 0
    u = at - row
    p0 = curve[row][column]
    p1 = curve[row + 1][column]
    m0 = curve[row][column + 2]
    m1 = curve[row + 1][column + 2]
    c2 = 3.0 * (p1 - p0) - 2.0 * m0 - m1
    c3 = 2.0 * (p0 - p1) + m0 + m1
    if order == 0:
        return float(p0 + u * (m0 + u * (c2 + u * c3)))
    if order == 1:
        return float(m0 + u * (2.0 * c2 + 3.0 * u * c3))
    return float(2.0 * c2 + 6.0 * u * c3)


def nearest_on(curve: Any, x: float, z: float, start: float) -> float:
    """Return where on the curve (row number with its part) the distance to (x, z) is least, near ``start``.

    Newton's method on f(u) = (p(u) - q) . p'(u) = 0, with the Gauss-Newton slope where the distance is not convex and steps of at most a
    quarter of a piece, so that the answer stays on the branch it begins on. At the ends it stands at the end.
    """
    end = len(curve) - 1.0
    at = start
    for _ in range(_STEPS):
        dx = point_of(curve, at, 0, 0) - x
        dz = point_of(curve, at, 1, 0) - z
        tx = point_of(curve, at, 0, 1)
        tz = point_of(curve, at, 1, 1)
        along = dx * tx + dz * tz
        square = tx * tx + tz * tz
        slope = square + dx * point_of(curve, at, 0, 2) + dz * point_of(curve, at, 1, 2)
        if slope < _BENT_AWAY * square:
            slope = square
        if slope < _FEWEST:
            return at
        change = within(-along / slope, -_LONGEST_STEP, _LONGEST_STEP)
        at = at + change
        if at < 0.0:
            at = 0.0
        if at > end:
            at = end
        if abs(change) < _SETTLED * (1.0 + at):
            return at
    return at


def curvature_at(curve: Any, at: float) -> float:
    """Return the signed curvature [1/m] there, positive where the path bends to the left (from +Z towards +X seen along it)."""
    tx = point_of(curve, at, 0, 1)
    tz = point_of(curve, at, 1, 1)
    square = tx * tx + tz * tz
    if square < _FEWEST:
        return 0.0
    bend = tz * point_of(curve, at, 0, 2) - tx * point_of(curve, at, 1, 2)
    return bend / (square * math.sqrt(square))


TWO_PI = 2.0 * math.pi


class CircleReference(ReferenceOutputs, Component):
    """Gives the point of a circle that a test asks for, sample by sample:  x = X_c + R cos a,  z = Z_c + R sin a,  da/dt = d v/R.

    ``direction`` +1 turns from +X to +Z, -1 the other way. With an ``acceleration`` the speed rises evenly to ``speed`` and falls so at
    the end; at 0 it is there at once. Velocity and acceleration are those of the circle at the sample instant.

    Source: ISO 230-4 (circular tests for numerically controlled machine tools). Left out: the run in and out along a tangent.
    """

    group = "interpolator"

    radius = Parameter("m", 0.02, low=1e-6, doc="radius of the circle")
    speed = Parameter("m/s", 0.02, low=1e-9, doc="path speed")
    acceleration = Parameter("m/s^2", 0.0, low=0.0, doc="path acceleration at start and end; 0: at once")
    turns = Parameter("1", 2.0, low=0.0, doc="turns until it is finished")
    direction = Parameter("1", 1.0, low=-1.0, high=1.0, doc="+1 from +X to +Z, -1 the other way")
    start_angle = Parameter("rad", 0.0, doc="angle of the first point, from +X")
    centre_x_at = Parameter("m", 0.0, doc="centre, radius coordinate")
    centre_z_at = Parameter("m", 0.0, doc="centre, z coordinate")

    now = DiscreteState("s", doc="time of this sample")

    x_acceleration = Output("m/s^2", doc="reference acceleration of the x axis")
    z_acceleration = Output("m/s^2", doc="reference acceleration of the z axis")
    direction_x = Output("1", doc="x part of the unit tangent of the path")
    direction_z = Output("1", doc="z part of the unit tangent of the path")
    normal_x = Output("1", doc="x part of the unit normal left of the path at the reference")
    normal_z = Output("1", doc="z part of that normal")
    centre_x = Output("m", doc="centre of the circle, radius coordinate")
    centre_z = Output("m", doc="centre of the circle, z coordinate")
    circle_radius = Output("m", doc="radius of the circle")
    feed_speed = Output("m/s", doc="reference path speed")
    angle = Output("rad", doc="angle turned since the start")
    finished = Output("1", doc="1 once all turns are done")

    @staticmethod
    def update(time: float) -> float:
        return time

    @staticmethod
    def output(
        now: float, radius: float, speed: float, acceleration: float, turns: float, direction: float, start_angle: float,
        centre_x_at: float, centre_z_at: float,
    ) -> tuple[float, ...]:  # fmt: skip
        whole = TWO_PI * radius * turns
        ramp = speed / acceleration if acceleration > 0.0 else 0.0
        if acceleration > 0.0 and speed * ramp > whole:
            ramp = math.sqrt(whole / acceleration)
        top = acceleration * ramp if acceleration > 0.0 else speed
        lasting = whole / top + ramp
        way, rate, rise = whole, 0.0, 0.0
        if now < ramp:
            way, rate, rise = 0.5 * acceleration * now * now, acceleration * now, acceleration
        elif now < lasting - ramp:
            way, rate = 0.5 * top * ramp + top * (now - ramp), top
        elif now < lasting:
            left = lasting - now
            way, rate, rise = whole - 0.5 * acceleration * left * left, acceleration * left, -acceleration
        side = 1.0 if direction >= 0.0 else -1.0
        at = start_angle + side * way / radius
        cosine = math.cos(at)
        sine = math.sin(at)
        along_x = -side * sine
        along_z = side * cosine
        inward = rate * rate / radius
        return (
            centre_x_at + radius * cosine, centre_z_at + radius * sine, rate * along_x, rate * along_z, rise * along_x - inward * cosine,
            rise * along_z - inward * sine, along_x, along_z, along_z, -along_x, centre_x_at * 1.0, centre_z_at * 1.0, radius * 1.0,
            rate * 1.0, way / radius, 1.0 if now >= lasting - _CLOCK else 0.0,
        )  # fmt: skip


def _further(curve: Any, at: float, way: float) -> float:
    """Return the place a way [m] further on: a step of the midpoint rule for du/ds = 1/|p'(u)|, in quarters of a sample's way."""
    for _ in range(4):
        tx = point_of(curve, at, 0, 1)
        tz = point_of(curve, at, 1, 1)
        middle = at + 0.125 * way / max(math.sqrt(tx * tx + tz * tz), 1e-12)
        tx = point_of(curve, middle, 0, 1)
        tz = point_of(curve, middle, 1, 1)
        at = at + 0.25 * way / max(math.sqrt(tx * tx + tz * tz), 1e-12)
    return at


class FreePathInterpolator(ReferenceOutputs, Component):
    """Gives the reference point of each sample on a free path, run at constant path speed.

    The table ``curve`` holds points and slopes of cubic pieces (columns x, z, x_slope, z_slope); a lesson names its file under ``tables:``.
    Speed rises and falls with ``acceleration`` at the ends. ``place`` is where on the curve the reference stands, in rows, which a foot
    point on the same curve begins from.

    Source: C. de Boor, A Practical Guide to Splines, Springer 1978, chapter IV (cubic Hermite interpolation). Left out: slowing down
    where the path bends.
    """

    group = "interpolator"

    example_tables: ClassVar[dict[str, list[list[float]]]] = {"curve": EXAMPLE_CURVE}

    curve = Table("m", CURVE_COLUMNS, doc="points of the path and their slopes per row")

    speed = Parameter("m/s", 0.02, low=0.0, doc="path speed")
    acceleration = Parameter("m/s^2", 0.5, low=1e-6, doc="path acceleration at both ends")

    at = DiscreteState("1", doc="where on the curve the reference stands, in rows")
    path_speed = DiscreteState("m/s", doc="path speed of this sample")
    started = DiscreteState("1", doc="1 after the first sample")

    x_acceleration = Output("m/s^2", doc="reference acceleration of the x axis, across the path")
    z_acceleration = Output("m/s^2", doc="reference acceleration of the z axis, across the path")
    direction_x = Output("1", doc="x part of the unit tangent of the path")
    direction_z = Output("1", doc="z part of the unit tangent of the path")
    curvature = Output("1/m", doc="signed curvature of the path")
    feed_speed = Output("m/s", doc="reference path speed")
    place = Output("1", doc="where on the curve the reference stands, in rows")
    finished = Output("1", doc="1 once the reference has reached the last point")

    @staticmethod
    def update(
        curve: Any, at: float, path_speed: float, started: float, speed: float, acceleration: float, sample_period: float
    ) -> tuple[float, float, float]:
        """Walk one sample further; the end is braked for along the chord that is left."""
        end = len(curve) - 1.0
        if started < ON or at >= end:
            return at, 0.0, 1.0
        tx = point_of(curve, at, 0, 1)
        tz = point_of(curve, at, 1, 1)
        left = (end - at) * math.sqrt(tx * tx + tz * tz)
        slow = math.sqrt(2.0 * acceleration * left)
        wanted = min(speed, path_speed + acceleration * sample_period)
        wanted = min(wanted, max(slow, acceleration * sample_period))
        further = _further(curve, at, wanted * sample_period)
        return min(further, end), wanted, 1.0

    @staticmethod
    def output(curve: Any, at: float, path_speed: float) -> tuple[float, ...]:
        tx = point_of(curve, at, 0, 1)
        tz = point_of(curve, at, 1, 1)
        size = max(math.sqrt(tx * tx + tz * tz), 1e-12)
        bend = curvature_at(curve, at)
        along_x = tx / size
        along_z = tz / size
        inward = path_speed * path_speed * bend
        return (
            point_of(curve, at, 0, 0), point_of(curve, at, 1, 0), path_speed * along_x, path_speed * along_z, inward * along_z,
            -inward * along_x, along_x, along_z, bend, path_speed * 1.0, at * 1.0, 1.0 if at >= len(curve) - 1.0 else 0.0,
        )  # fmt: skip
