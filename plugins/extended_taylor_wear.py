"""Kind 9 of the user-written parts: a tool wear model. Taylor's law with feed and depth of cut in it."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.hookspecs import hookimpl

MILLIMETRE = 1.0e-3
METRE_PER_MINUTE = 1.0 / 60.0
MINUTE = 60.0


class ExtendedTaylorWear(Component):
    """Gives flank wear and used-up life of the edge by the extended Taylor law:  V t^n f^a d^b = C,  d(used)/dt = 1/t.

    V in m/min, t in min, f and d in mm. It takes the place of the tool wear of a lathe; wire ``feed`` and ``depth_of_cut`` to it.
    Source: M. P. Groover, Fundamentals of Modern Manufacturing, chapter on cutting-tool technology (expanded Taylor equation);
    exponents assumed, of usual size: speed counts more than feed, feed more than depth. C gives a minute of life at 350 m/min, 0.2 mm
    and 2 mm. Left out: running-in, crater wear, breakage.
    """

    cutting_speed = Input("m/s", doc="actual cutting speed")
    feed = Input("m", doc="actual feed per revolution")
    depth_of_cut = Input("m", doc="actual depth of cut")
    in_contact = Input("1", doc="1 while the tool cuts")

    constant = Parameter("m/s", 350.0 * 0.3090 / 60.0, low=1e-3, doc="C: speed with a life of one minute at 1 mm feed and 1 mm depth")
    time_exponent = Parameter("1", 0.25, low=0.02, high=2.0, doc="n")
    feed_exponent = Parameter("1", 0.8, low=0.0, high=2.0, doc="a")
    depth_exponent = Parameter("1", 0.163, low=0.0, high=2.0, doc="b")
    wear_at_end_of_life = Parameter("m", 0.3e-3, low=0.0, doc="flank wear at the end of life")
    force_growth = Parameter("1/m", 0.0, low=0.0, doc="share by which forces grow per flank wear")

    used = DiscreteState("1", doc="used-up share of the edge's life")

    used_life = Output("1", doc="used-up share of the edge's life, 1 at its end")
    flank_wear = Output("m", doc="flank wear of the edge")
    force_factor = Output("1", doc="factor by which wear raises the cutting forces")

    @staticmethod
    def update(
        cutting_speed: float,
        feed: float,
        depth_of_cut: float,
        in_contact: float,
        constant: float,
        time_exponent: float,
        feed_exponent: float,
        depth_exponent: float,
        used: float,
        sample_period: float,
    ) -> float:
        """One sample of wear."""
        if in_contact < 0.5 or cutting_speed <= 1e-3 or feed <= 1e-9 or depth_of_cut <= 1e-9:
            return used
        load = math.log(cutting_speed / constant)
        load += feed_exponent * math.log(feed / MILLIMETRE) + depth_exponent * math.log(depth_of_cut / MILLIMETRE)
        rate = load / time_exponent
        if rate > 60.0:
            rate = 60.0
        return used + sample_period / MINUTE * math.exp(rate)

    @staticmethod
    def output(used: float, wear_at_end_of_life: float, force_growth: float) -> tuple[float, float, float]:
        """Wear in proportion to the used life."""
        wear = wear_at_end_of_life * used
        return used, wear, 1.0 + force_growth * wear


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [ExtendedTaylorWear]
