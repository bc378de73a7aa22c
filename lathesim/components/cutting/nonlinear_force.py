"""Cutting forces with pressures that fall with feed, depth and speed."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output, Parameter

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
        "force": "cutting_force",
        "thrust_force": "radial_force",
        "feed_force": "longitudinal_force",
        "depth": "depth_of_cut",
        "feed": "feed",
        "speed": "cutting_speed",
        "in_cut": "in_contact",
    }

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
        depth_of_cut: float,
        feed: float,
        cutting_speed: float,
        in_contact: float,
        wear_factor: float,
        cutting_pressure: float,
        cutting_feed_exponent: float,
        cutting_depth_exponent: float,
        cutting_speed_exponent: float,
        thrust_pressure: float,
        thrust_feed_exponent: float,
        thrust_depth_exponent: float,
        thrust_speed_exponent: float,
        lead_angle: float,
        slowest_cutting_speed: float,
    ) -> tuple[float, float, float]:
        """Equations (12) to (18), P a with the area among the powers: F_C = K_C f^(1 + alpha_C) d^(1 + beta_C) V^gamma_C.

        One logarithm of each variable serves both forces, to base 2, which Python gives five times sooner.
        """
        if in_contact < 0.5 or depth_of_cut <= 0.0 or feed <= 0.0 or cutting_speed < slowest_cutting_speed:
            return 0.0, 0.0, 0.0
        log_feed = math.log2(feed * MILLIMETRES)
        log_depth = math.log2(depth_of_cut * MILLIMETRES)
        log_speed = math.log2(cutting_speed * METRES_PER_MINUTE)
        cutting = (
            wear_factor
            * cutting_pressure
            * SQUARE_MILLIMETRE
            * math.exp2(
                (1.0 + cutting_feed_exponent) * log_feed + (1.0 + cutting_depth_exponent) * log_depth + cutting_speed_exponent * log_speed
            )
        )
        thrust = (
            wear_factor
            * thrust_pressure
            * SQUARE_MILLIMETRE
            * math.exp2(
                (1.0 + thrust_feed_exponent) * log_feed + (1.0 + thrust_depth_exponent) * log_depth + thrust_speed_exponent * log_speed
            )
        )
        return cutting, thrust * math.sin(lead_angle), thrust * math.cos(lead_angle)
