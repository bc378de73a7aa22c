"""Depth of cut, feed and cutting speed as they really are, from the motion of the axes and the spindle."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output, Parameter


class CuttingGeometry(Component):
    """Gives depth of cut, feed per revolution, cutting speed and contact from actual positions and speeds.

        turning:  d = radius of the material ahead - x,     f = min(|v|, sqrt(2) |v_z|) 2 pi/|w|
        facing:   d = width the edge takes,                 f = min(|v|, sqrt(2) |v_x|) 2 pi/|w|      (towards the axis, |v_x| > |v_z|)
        V = |w| x

    The feed is the one along the path; the second term lets it end where the tool moves past the material instead of into it.
    ``in_contact`` is 1 while the tip is inside the bounds of the raw stock in a block run at feed: what contour errors are judged over.
    ``engaged`` is 1 only where material is left there. In rapid blocks no force is computed, but ``rapid_contact`` warns that the tool
    ran into the part: without an in-position check a lagging tool may.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), figure 9 and section Force models. Left out: nose radius, chip flow,
    the surface left by the last turn (chatter).
    """

    group = "process"

    ports = {"displacement": "x_position"}

    x_position = Input("m", doc="actual radius of the tool tip")
    x_velocity = Input("m/s", doc="actual speed of the x axis")
    z_velocity = Input("m/s", doc="actual speed of the z axis")
    spindle_speed = Input("rad/s", doc="actual spindle speed")
    uncut_radius = Input("m", doc="radius of the material just ahead of the tool")
    material_radius = Input("m", doc="larger radius of the material beside the tool")
    facing_width = Input("m", doc="width of the layer taken while facing")
    inside_stock = Input("1", doc="1 while the tool tip is inside the bounds of the raw stock")
    cutting_block = Input("1", default=1.0, doc="1 in blocks run at feed")

    slowest_spindle = Parameter("rad/s", 0.5, low=1e-6, doc="spindle speed below which nothing is cut")

    depth_of_cut = Output("m", doc="actual depth of cut")
    feed = Output("m", doc="actual feed per revolution")
    cutting_speed = Output("m/s", doc="actual cutting speed")
    part_radius = Output("m", doc="radius at which the tool cuts")
    in_contact = Output("1", doc="1 while the tip is inside the bounds of the raw stock in a block run at feed")
    engaged = Output("1", doc="1 while tool and material touch in a block run at feed")
    rapid_contact = Output("1", doc="1 while the tool stands in the part in a rapid block")
    removal_rate = Output("m^3/s", doc="volume cut per time")

    @staticmethod
    def output(
        x_position: float,
        x_velocity: float,
        z_velocity: float,
        spindle_speed: float,
        uncut_radius: float,
        material_radius: float,
        facing_width: float,
        inside_stock: float,
        cutting_block: float,
        slowest_spindle: float,
    ) -> tuple[float, ...]:
        """Geometry of the cut at this moment."""
        radius = x_position if x_position > 0.0 else 0.0
        touching = material_radius > x_position or facing_width > 0.0
        turning = abs(spindle_speed)
        speed = turning * radius
        contact = 1.0 if inside_stock > 0.5 and cutting_block > 0.5 else 0.0
        if not touching or cutting_block < 0.5:
            return 0.0, 0.0, speed, radius, contact, 0.0, (1.0 if touching else 0.0), 0.0
        if facing_width > 0.0:
            depth = facing_width
            inward = abs(x_velocity)
        else:
            depth = uncut_radius - x_position
            inward = abs(z_velocity)
            if depth < 0.0:
                depth = 0.0
        feed = 0.0
        if turning > slowest_spindle:
            along = math.sqrt(x_velocity * x_velocity + z_velocity * z_velocity)
            bound = 1.4142135623730951 * inward
            feed = 2.0 * math.pi / turning * (along if along < bound else bound)
        return depth, feed, speed, radius, contact, 1.0, 0.0, depth * feed * speed
