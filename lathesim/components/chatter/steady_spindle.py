"""A spindle that holds its speed, or varies it on purpose."""

from __future__ import annotations

import math

from lathesim.component import Component, Output, Parameter


class SteadySpindle(Component):
    """Gives speed and angle of a spindle that nothing slows down:  n (1 + a sin(2 pi f t)),  its angle the exact integral.

    Varying the speed keeps the waves of two turns from settling in step: the way to cut above the limit of a steady speed. Source: E.
    Stone, S. Ahmed, A. Askari, H. Tat, Investigations of process damping forces in metal cutting (2005), and textbooks on sinusoidal
    spindle speed variation. Left out: drive and inertia; AnalyticalSpindle has both.
    """

    group = "spindle"

    target = Parameter("rad/s", 104.71975511965977, low=0.0, doc="mean speed")
    variation = Parameter("1", 0.0, low=0.0, high=0.9, doc="amplitude of the speed over the mean")
    variation_frequency = Parameter("Hz", 1.0, low=1e-6, doc="how often the speed swings")

    speed = Output("rad/s", doc="speed of the spindle")
    angle = Output("rad", doc="angle turned since the start")

    @staticmethod
    def output(time: float, target: float, variation: float, variation_frequency: float) -> tuple[float, float]:
        w = 2.0 * math.pi * variation_frequency
        if variation == 0.0:
            return target, target * time
        return target * (1.0 + variation * math.sin(w * time)), target * (time + variation * (1.0 - math.cos(w * time)) / w)
