"""Cutting forces proportional to the area of the chip."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output, Parameter


class LinearForce(Component):
    """Gives the forces on the insert from constant pressures on the chip:  F_C = P_C a,  F_T = P_T a,  a = f d.

    F_lon = F_T sin(psi), F_rad = F_T cos(psi) with the lead angle psi. Without contact all are 0.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (12), (13), (16) to (18); the pressures are least-squares fits
    of its (35) to (37) (steel, coated carbide) over f 0.05 to 0.4 mm, d 0.8 to 3 mm, V 60 to 180 m/min. Left out: ploughing, wear.
    """

    group = "process"

    ports = {
        "force": "cutting_force",
        "thrust_force": "radial_force",
        "feed_force": "longitudinal_force",
        "depth": "depth_of_cut",
        "feed": "feed",
        "in_cut": "in_contact",
    }

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
        depth_of_cut: float,
        feed: float,
        in_contact: float,
        wear_factor: float,
        cutting_pressure: float,
        thrust_pressure: float,
        lead_angle: float,
    ) -> tuple[float, float, float]:
        """Equations (12), (13), (16) to (18)."""
        if in_contact < 0.5 or depth_of_cut <= 0.0 or feed <= 0.0:
            return 0.0, 0.0, 0.0
        area = wear_factor * feed * depth_of_cut
        thrust = thrust_pressure * area
        return cutting_pressure * area, thrust * math.sin(lead_angle), thrust * math.cos(lead_angle)
