"""Kind 7 of the user-written parts: a force process model. The one of Example 2 of Liu and Landers (2004)."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output
from lathesim.hookspecs import hookimpl

MILLIMETRE = 1.0e-3
METRE_PER_MINUTE = 1.0 / 60.0


def at_least_zero(force: float) -> float:
    """A fitted force below zero means that the fit does not hold there."""
    return force if force > 0.0 else 0.0


class SandovalForce(Component):
    """Gives the forces on the insert as measured for a steel part and a coated carbide tool, f and d in mm, V in m/min:

        F_C   = 2864.63 d^0.69 f^0.75 - 4.28 V
        F_lon = 1907.00 d^0.74 f^0.79 - 3.08 V
        F_rad = 1464.28 d^0.08 f^1.09 + 0.02 V

    The first turns negative below a depth of about 0.6 mm at small feeds: there the forces are 0.
    Source: J. E. Sandoval, R. G. Landers, A. G. Ulsoy, Reconfigurable CNC Lathe Simulation System (2001), as printed in J. Liu,
    R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (35) to (37). Left out: wear, ploughing.
    """

    depth_of_cut = Input("m", doc="actual depth of cut")
    feed = Input("m", doc="actual feed per revolution")
    cutting_speed = Input("m/s", doc="actual cutting speed")
    in_contact = Input("1", default=1.0, doc="1 while tool and part touch")
    wear_factor = Input("1", default=1.0, doc="factor by which wear raises the forces")

    cutting_force = Output("N", doc="cutting force, along the cutting speed")
    longitudinal_force = Output("N", doc="longitudinal thrust force, against the feed")
    radial_force = Output("N", doc="radial thrust force, away from the part")

    @staticmethod
    def output(depth_of_cut: float, feed: float, cutting_speed: float, in_contact: float, wear_factor: float) -> tuple[float, float, float]:
        """Equations (35) to (37)."""
        if in_contact < 0.5 or depth_of_cut <= 0.0 or feed <= 0.0:
            return 0.0, 0.0, 0.0
        depth = math.log(depth_of_cut / MILLIMETRE)
        feed_log = math.log(feed / MILLIMETRE)
        speed = cutting_speed / METRE_PER_MINUTE
        cutting = 2864.63 * math.exp(0.69 * depth + 0.75 * feed_log) - 4.28 * speed
        longitudinal = 1907.00 * math.exp(0.74 * depth + 0.79 * feed_log) - 3.08 * speed
        radial = 1464.28 * math.exp(0.08 * depth + 1.09 * feed_log) + 0.02 * speed
        return wear_factor * at_least_zero(cutting), wear_factor * at_least_zero(longitudinal), wear_factor * radial


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [SandovalForce]
