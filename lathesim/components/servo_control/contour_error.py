"""The distance between the tool and the path it should follow."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output


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
        x_reference: float,
        z_reference: float,
        x_position: float,
        z_position: float,
        direction_x: float,
        direction_z: float,
        centre_x: float,
        centre_z: float,
        radius: float,
    ) -> tuple[float, float, float, float, float, float]:
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
