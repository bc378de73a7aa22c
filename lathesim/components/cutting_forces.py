"""Cutting forces: from the chip to the forces on the tool, and what they do to axes and spindle."""

from __future__ import annotations

import math

from lathesim.component import ON, Component, Input, Output, Parameter, State


class LinearForce(Component):
    """Gives the forces on the insert from constant pressures on the chip:  F_C = P_C a,  F_T = P_T a,  a = f d.

    F_lon = F_T sin(psi), F_rad = F_T cos(psi) with the lead angle psi. Without contact all are 0.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (12), (13), (16) to (18); the pressures are least-squares fits
    of its (35) to (37) (steel, coated carbide) over f 0.05 to 0.4 mm, d 0.8 to 3 mm, V 60 to 180 m/min. Left out: ploughing, wear.
    """

    group = "process"

    ports = {
        "force": "cutting_force", "thrust_force": "radial_force", "feed_force": "longitudinal_force", "depth": "depth_of_cut",
        "feed": "feed", "in_cut": "in_contact",
    }  # fmt: skip

    depth_of_cut = Input("m", doc="actual depth of cut")
    feed = Input("m", doc="actual feed per revolution")
    in_contact = Input("1", default=1.0, doc="1 while tool and part touch")
    wear_factor = Input("1", default=1.0, doc="factor by which wear raises the forces")

    cutting_pressure = Parameter("Pa", 2.2e9, low=0.0, doc="cutting force per area of the chip")
    thrust_pressure = Parameter("Pa", 1.56e9, low=0.0, doc="thrust force per area of the chip")
    lead_angle = Parameter("rad", 1.014, low=0.0, high=1.5707963267948966, doc="lead angle of the edge")

    cutting_force = Output("N", doc="cutting force, along the cutting speed")
    longitudinal_force = Output("N", doc="longitudinal thrust force, against the feed")
    radial_force = Output("N", doc="radial thrust force, away from the part")

    @staticmethod
    def output(
        depth_of_cut: float, feed: float, in_contact: float, wear_factor: float, cutting_pressure: float, thrust_pressure: float,
        lead_angle: float,
    ) -> tuple[float, float, float]:  # fmt: skip
        """Equations (12), (13), (16) to (18)."""
        if in_contact < ON or depth_of_cut <= 0.0 or feed <= 0.0:
            return 0.0, 0.0, 0.0
        area = wear_factor * feed * depth_of_cut
        thrust = thrust_pressure * area
        return cutting_pressure * area, thrust * math.sin(lead_angle), thrust * math.cos(lead_angle)


MILLIMETRES = 1.0e3
METRES_PER_MINUTE = 60.0
"""How many there are to a metre and to a metre per second."""
SQUARE_MILLIMETRE = 1.0e-6


class NonlinearForce(Component):
    """Gives the forces on the insert from pressures that are powers of feed, depth of cut and cutting speed.

        F_C = P_C a,  P_C = K_C f^alpha_C d^beta_C V^gamma_C;   F_T = P_T a likewise;   a = f d
        F_lon = F_T sin(psi),  F_rad = F_T cos(psi)

    f and d count in mm and V in m/min inside the powers, so K is the pressure at 1 mm, 1 mm and 1 m/min. Without contact, feed or speed
    all forces are 0.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (12) to (18). The cutting pressure is its (38) with V in m/min
    (with km/min, as printed, the force is eight times its own (35)); the thrust pressure is a least-squares fit, in logarithms, of its
    (36) and (37) over f 0.05 to 0.4 mm, d 0.8 to 3 mm, V 60 to 180 m/min. Left out: ploughing, wear, chip-thickness memory.
    """

    group = "process"

    ports = {
        "force": "cutting_force", "thrust_force": "radial_force", "feed_force": "longitudinal_force", "depth": "depth_of_cut",
        "feed": "feed", "speed": "cutting_speed", "in_cut": "in_contact",
    }  # fmt: skip

    depth_of_cut = Input("m", doc="actual depth of cut")
    feed = Input("m", doc="actual feed per revolution")
    cutting_speed = Input("m/s", doc="actual cutting speed")
    in_contact = Input("1", default=1.0, doc="1 while tool and part touch")
    wear_factor = Input("1", default=1.0, doc="factor by which wear raises the forces")

    cutting_pressure = Parameter("Pa", 7.705e9, low=0.0, doc="K_C: cutting force per area of the chip at 1 mm, 1 mm, 1 m/min")
    cutting_feed_exponent = Parameter("1", -0.109, low=-2.0, high=2.0, doc="alpha_C")
    cutting_depth_exponent = Parameter("1", -0.123, low=-2.0, high=2.0, doc="beta_C")
    cutting_speed_exponent = Parameter("1", -0.273, low=-2.0, high=2.0, doc="gamma_C")
    thrust_pressure = Parameter("Pa", 18.05e9, low=0.0, doc="K_T: thrust force per area of the chip at 1 mm, 1 mm, 1 m/min")
    thrust_feed_exponent = Parameter("1", 0.273, low=-2.0, high=2.0, doc="alpha_T")
    thrust_depth_exponent = Parameter("1", -0.168, low=-2.0, high=2.0, doc="beta_T")
    thrust_speed_exponent = Parameter("1", -0.420, low=-2.0, high=2.0, doc="gamma_T")
    lead_angle = Parameter("rad", 1.014, low=0.0, high=1.5707963267948966, doc="lead angle of the edge")
    slowest_cutting_speed = Parameter("m/s", 0.01, low=1e-6, doc="cutting speed below which no force is given")

    cutting_force = Output("N", doc="cutting force, along the cutting speed")
    longitudinal_force = Output("N", doc="longitudinal thrust force, against the feed")
    radial_force = Output("N", doc="radial thrust force, away from the part")

    @staticmethod
    def output(
        depth_of_cut: float, feed: float, cutting_speed: float, in_contact: float, wear_factor: float, cutting_pressure: float,
        cutting_feed_exponent: float, cutting_depth_exponent: float, cutting_speed_exponent: float, thrust_pressure: float,
        thrust_feed_exponent: float, thrust_depth_exponent: float, thrust_speed_exponent: float, lead_angle: float,
        slowest_cutting_speed: float,
    ) -> tuple[float, float, float]:  # fmt: skip
        """Equations (12) to (18), P a with the area among the powers: F_C = K_C f^(1 + alpha_C) d^(1 + beta_C) V^gamma_C.

        One logarithm of each variable serves both forces, to base 2, which Python gives five times sooner.
        """
        if in_contact < ON or depth_of_cut <= 0.0 or feed <= 0.0 or cutting_speed < slowest_cutting_speed:
            return 0.0, 0.0, 0.0
        log_feed = math.log2(feed * MILLIMETRES)
        log_depth = math.log2(depth_of_cut * MILLIMETRES)
        log_speed = math.log2(cutting_speed * METRES_PER_MINUTE)
        power = (1.0 + cutting_feed_exponent) * log_feed + (1.0 + cutting_depth_exponent) * log_depth + cutting_speed_exponent * log_speed
        cutting = wear_factor * cutting_pressure * SQUARE_MILLIMETRE * math.exp2(power)
        power = (1.0 + thrust_feed_exponent) * log_feed + (1.0 + thrust_depth_exponent) * log_depth + thrust_speed_exponent * log_speed
        thrust = wear_factor * thrust_pressure * SQUARE_MILLIMETRE * math.exp2(power)
        return cutting, thrust * math.sin(lead_angle), thrust * math.cos(lead_angle)


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

    ports = {"cutting_torque": "torque", "cutting_power": "power"}

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
        cutting_force: float, longitudinal_force: float, radial_force: float, part_radius: float, x_velocity: float, z_velocity: float,
        spindle_speed: float, free_end: float, slowest_feed: float, slowest_spindle: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
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
        return (longitudinal_force * feed_x + across_x, longitudinal_force * feed_z - across_z, torque, torque * spindle_speed)


class CuttingProcess(Component):
    """Gives the three forces of a turning cut, the spindle angle, and the time since entry:  Fc = kc b h (h / 1 mm)^-m.

        h = f sin(kappa),   b = d / sin(kappa),   Fp = thrust_ratio Fc,   Ff = feed_ratio Fc

    Fc is what arrives at ``acting_force``: wire ``main_force`` to it, and what changes the main force on that wire changes all three. With
    exponent m = 0 the law is linear. The tool cuts while feed, depth and speed are above zero.

    Source: O. Kienzle, VDI-Z 94 (1952); Y. Altintas, Manufacturing Automation, 2nd ed. (2012), section 2.3. kc of a medium steel, the
    ratios are assumed. Left out: edge force, the build-up over the first turn, nose radius, wear, temperature, vibration.
    """

    group = "process"

    ports = {
        "force": "main_force", "thrust_force": "thrust_force", "feed_force": "feed_force", "feed": "feed", "depth": "depth",
        "speed": "speed", "angle": "angle", "spindle_speed": "spindle_speed", "in_cut": "in_cut", "cutting_time": "cutting_time",
    }  # fmt: skip

    feed = Input("m", doc="feed per turn")
    depth = Input("m", doc="depth of cut")
    speed = Input("m/s", doc="cutting speed")
    acting_force = Input("N", doc="main force that acts, of which thrust and feed force are shares")

    specific_force = Parameter("N/m^2", 1.8e9, low=0.0, doc="kc1.1: force per area of a chip 1 mm thick")
    exponent = Parameter("1", 0.0, low=0.0, high=0.99, doc="m: how the specific force falls with the thickness; 0 linear")
    thrust_ratio = Parameter("1", 0.4, low=-5.0, high=5.0, doc="thrust force over main force")
    feed_ratio = Parameter("1", 0.5, low=-5.0, high=5.0, doc="feed force over main force")
    approach_angle = Parameter("rad", 1.5707963267948966, low=0.1, high=1.5707963267948966, doc="kappa: angle of the cutting edge")
    radius = Parameter("m", 0.02, low=1e-4, doc="radius of the part, which makes the angle of the speed")

    turned = State("rad", doc="spindle angle")
    since_entry = State("s", doc="time since the tool entered; falls back outside the cut")

    main_force = Output("N", doc="Fc, along the cutting speed")
    thrust_force = Output("N", doc="Fp, along the depth")
    feed_force = Output("N", doc="Ff, along the feed")
    angle = Output("rad", doc="spindle angle since the start")
    spindle_speed = Output("rad/s", doc="spindle speed")
    in_cut = Output("1", doc="1 in the cut, else 0")
    cutting_time = Output("s", doc="time since the tool entered")

    @staticmethod
    def derivative(spindle_speed: float, in_cut: float, since_entry: float, step: float) -> tuple[float, float]:
        """The turning, and the clock that a tool out of the cut sets back within a few steps."""
        return spindle_speed, 1.0 if in_cut > ON else -since_entry / step

    @staticmethod
    def output(turned: float, speed: float, radius: float, since_entry: float) -> tuple[float, float, float]:
        return turned, speed / radius, since_entry

    @staticmethod
    def output_in_cut(feed: float, depth: float, speed: float) -> float:
        return 1.0 if feed > 0.0 and depth > 0.0 and speed > 0.0 else 0.0

    @staticmethod
    def output_main_force(in_cut: float, feed: float, depth: float, specific_force: float, exponent: float, approach_angle: float) -> float:
        """Kienzle's law."""
        if in_cut < ON:
            return 0.0
        thickness = feed * math.sin(approach_angle)
        return specific_force * feed * depth * math.pow(thickness / 1e-3, -exponent)

    @staticmethod
    def output_thrust_force(acting_force: float, thrust_ratio: float) -> float:
        return thrust_ratio * acting_force

    @staticmethod
    def output_feed_force(acting_force: float, feed_ratio: float) -> float:
        return feed_ratio * acting_force
