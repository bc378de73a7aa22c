"""A hammer that taps the tool."""

from __future__ import annotations

import math

from lathesim.component import Component, Output, Parameter


class ImpactHammer(Component):
    """Gives the force of a hit, a half sine  F = peak sin(pi (t - start)/contact),  and of a second one where the hammer bounces.

    Source: D. J. Ewins, Modal Testing (2000), section 3.6. Left out: the mass of the hammer, which moves with the tool while they touch,
    and the hand.
    """

    group = "tool and part"

    start = Parameter("s", 0.01, low=0.0, doc="when the hammer meets the tool")
    contact = Parameter("s", 4e-4, low=1e-6, doc="how long hammer and tool touch")
    peak = Parameter("N", 800.0, low=0.0, doc="largest force")
    bounce = Parameter("1", 0.0, low=0.0, high=1.0, doc="force of a second hit over that of the first; 0 for none")
    bounce_delay = Parameter("s", 0.01, low=0.0, doc="from the first hit to the second")

    force = Output("N", doc="force on the tool")

    @staticmethod
    def output(time: float, start: float, contact: float, peak: float, bounce: float, bounce_delay: float) -> float:
        force = 0.0
        s = (time - start) / contact
        if 0.0 < s < 1.0:
            force = peak * math.sin(math.pi * s)
        s = (time - start - bounce_delay) / contact
        if bounce > 0.0 and 0.0 < s < 1.0:
            force += bounce * peak * math.sin(math.pi * s)
        return force
