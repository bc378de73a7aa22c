"""What the cut does to the machine: disturbance forces of the axes, torque and power of the spindle."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output, Parameter


class CuttingLoad(Component):
    """Gives the load of axes and spindle from the forces on the insert.

        T = R_p F_C (22), against the rotation;   P = T w
        force on the tool = -F_lon u + F_rad n;   disturbance = minus that, as a positive disturbance acts against positive motion

    u is the direction of feed, n the direction across it that leads away from the part. Turning along z this is F_x = F_rad and
    F_z = F_lon (19, 21): the longitudinal force holds the feed back, the radial force pushes the tool away from the axis.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (16) to (22); the signs are worked out from its figure 9.
    Left out: deflection of tool and part.
    """

    group = "process"

    cutting_force = Input("N", doc="force along the cutting speed, F_C")
    longitudinal_force = Input("N", doc="force against the feed, F_lon")
    radial_force = Input("N", doc="force across feed and cutting speed, F_rad")
    part_radius = Input("m", doc="radius at which the tool cuts")
    x_velocity = Input("m/s", doc="actual speed of the x axis")
    z_velocity = Input("m/s", doc="actual speed of the z axis")
    spindle_speed = Input("rad/s", doc="actual spindle speed")

    free_end = Parameter("1", -1.0, low=-1.0, high=1.0, doc="where the free end of the part lies: -1 at smaller z, +1 at larger z")
    slowest_feed = Parameter("m/s", 1e-6, low=1e-12, doc="speed below which the direction of feed fades out")
    slowest_spindle = Parameter("rad/s", 0.1, low=1e-9, doc="spindle speed below which the torque fades out")

    x_disturbance = Output("N", doc="force on the x axis, positive against positive motion")
    z_disturbance = Output("N", doc="force on the z axis, positive against positive motion")
    torque = Output("N*m", doc="torque on the spindle, positive against positive rotation")
    power = Output("W", doc="cutting power at the spindle")

    @staticmethod
    def output(
        cutting_force: float,
        longitudinal_force: float,
        radial_force: float,
        part_radius: float,
        x_velocity: float,
        z_velocity: float,
        spindle_speed: float,
        free_end: float,
        slowest_feed: float,
        slowest_spindle: float,
    ) -> tuple[float, float, float, float]:
        """Equation (22) and the balance of forces at the tool."""
        along = math.sqrt(x_velocity * x_velocity + z_velocity * z_velocity + slowest_feed * slowest_feed)
        feed_x = x_velocity / along
        feed_z = z_velocity / along
        side = feed_x if free_end >= 0.0 else -feed_x
        across_x = radial_force * feed_z
        across_z = radial_force * feed_x
        if side < feed_z:
            across_x = -across_x
            across_z = -across_z
        torque = part_radius * cutting_force
        torque = torque * spindle_speed / math.sqrt(spindle_speed * spindle_speed + slowest_spindle * slowest_spindle)
        return (
            longitudinal_force * feed_x + across_x,
            longitudinal_force * feed_z - across_z,
            torque,
            torque * spindle_speed,
        )
