"""Remedies against what grows warm: screw and spindle."""

from __future__ import annotations

import math

from lathesim.component import Input, Parameter, State
from lathesim.effects.remedies.remedy import Remedy


class GrowthModel(Remedy):
    """Takes the growth of a screw away:  out = in - share strain (1 - exp(-(t + warmed_before)/time_constant)) (in - fixed_end).

    Source: ISO 230-3; J. Mayr et al., Thermal issues in machine tools, CIRP Annals 61 (2012). Left out: another duty than the one learned.
    """

    site = "drive"
    answers = ("ThermalScrewGrowth",)
    limits = ("duty",)
    cannot = "Another duty than the one learned grows otherwise."
    follows = {"strain": "the strain", "time_constant": "its time constant"}

    strain = Parameter("1", 0.0, low=-0.01, high=0.01, doc="thermal strain of the warm screw")
    time_constant = Parameter("s", 1800.0, low=1e-3, doc="time to 63 % of the growth")
    fixed_end = Parameter("{signal}", 0.0, doc="position of the fixed bearing")
    warmed_before = Parameter("s", 0.0, low=0.0, doc="how long it has been warming up")

    @staticmethod
    def output(
        incoming: float, time: float, share: float, strain: float, time_constant: float, fixed_end: float, warmed_before: float
    ) -> float:
        """Take the growth away."""
        if share == 0.0:
            return incoming
        return incoming - share * strain * (1.0 - math.exp(-(time + warmed_before) / time_constant)) * (incoming - fixed_end)


class SpindleGrowthModel(Remedy):
    """Takes the growth of a spindle away, from the speeds it ran at:  out = in - share growth w,  T dw/dt = |n|/full_speed - w.

    Source: ISO 230-3 (thermal distortion by rotating spindles).
    """

    site = "drive"
    answers = ("SpindleGrowth",)
    limits = ("duty",)
    cannot = "Another duty than the one learned grows otherwise."
    follows = {"growth": "the growth", "time_constant": "its time constant"}

    spindle_speed = Input("rad/s", doc="spindle speed")
    warmth = State("1", doc="1 after long running at full speed")
    growth = Parameter("{signal}", 0.0, doc="growth after long running at full speed")
    time_constant = Parameter("s", 1800.0, low=1e-3, doc="time to 63 % of the growth")
    full_speed = Parameter("rad/s", 300.0, low=1e-3, doc="speed the growth is given for")

    @staticmethod
    def derivative(spindle_speed: float, warmth: float, time_constant: float, full_speed: float) -> float:
        """Warm up."""
        return (abs(spindle_speed) / full_speed - warmth) / time_constant

    @staticmethod
    def output(incoming: float, warmth: float, share: float, growth: float) -> float:
        """Take the growth away."""
        if share == 0.0:
            return incoming
        return incoming - share * growth * warmth
