"""An interpolator for a free path given by points and slopes."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from lathesim.component import Component, DiscreteState, Output, Parameter, Table
from lathesim.components.contour.curve import CURVE_COLUMNS, EXAMPLE_CURVE, curvature_at, point_of


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


class FreePathInterpolator(Component):
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

    x_reference = Output("m", doc="reference radius of the tool tip")
    z_reference = Output("m", doc="reference z position of the tool tip")
    x_velocity = Output("m/s", doc="reference speed of the x axis")
    z_velocity = Output("m/s", doc="reference speed of the z axis")
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
        if started < 0.5 or at >= end:
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
        """The point, its tangent, and how it bends."""
        tx = point_of(curve, at, 0, 1)
        tz = point_of(curve, at, 1, 1)
        size = max(math.sqrt(tx * tx + tz * tz), 1e-12)
        bend = curvature_at(curve, at)
        along_x = tx / size
        along_z = tz / size
        inward = path_speed * path_speed * bend
        return (
            point_of(curve, at, 0, 0),
            point_of(curve, at, 1, 0),
            path_speed * along_x,
            path_speed * along_z,
            inward * along_z,
            -inward * along_x,
            along_x,
            along_z,
            bend,
            path_speed * 1.0,
            at * 1.0,
            1.0 if at >= len(curve) - 1.0 else 0.0,
        )
