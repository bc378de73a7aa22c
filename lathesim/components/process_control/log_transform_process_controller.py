"""A force controller that works with the logarithms of force and feed."""

from __future__ import annotations

import math
from typing import ClassVar

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.components.process_control.nonlinear_process_controller import feed_within
from lathesim.components.process_control.programmed_feed import NO_COMMAND


class LogTransformProcessController(Component):
    """Gives the feed that brings a force (or torque, or power) to its reference, by integral control of ln f.

        model ln F = ln theta + alpha ln f;   d(ln f)/dt = Ki (ln F_r - ln F),  Ki = 1/(tau alpha)

    In logarithms the loop is linear for every theta, so neither depth nor speed need be known. But ln F needs a force above zero: in the
    air, or where the true force vanishes, the controller is unstable, and the run ends there with the feed no longer a number, unless
    ``smallest_measured`` puts a floor under F. It acts in blocks run at feed, beginning with the programmed feed.
    Source: L. Harder, Cutting Force Control in Turning, PhD thesis, KTH Stockholm (1995); J. Liu, R. G. Landers (2004), (29), (30).
    """

    group = "controllers"

    breaks_where: ClassVar[str] = "ln F is asked of a force that is not above zero, while smallest_measured is 0"
    ports = {"measured": "measured"}

    measured = Input("{signal}", doc="measured force, torque or power")
    programmed_feed = Input("m", doc="feed per revolution of the interpolator")
    cutting_block = Input("1", doc="1 in blocks run at feed")

    reference = Parameter("{signal}", 500.0, low=1e-9, doc="wanted force, torque or power")
    feed_exponent = Parameter("1", 0.891, low=0.05, high=3.0, doc="estimated alpha")
    time_constant = Parameter("s", 0.4, low=1e-3, doc="wanted time constant of the closed loop")
    smallest_measured = Parameter("{signal}", 0.0, low=0.0, doc="floor under the measured value in the logarithm; 0: none")
    smallest_feed = Parameter("m", 1e-7, low=1e-12, high=0.1, doc="smallest commanded feed")
    largest_feed = Parameter("m", 5e-4, low=1e-12, high=0.1, doc="largest commanded feed")

    held_feed = DiscreteState("m", -1.0, doc="commanded feed of this sample; below zero: none", shown=False)

    feed_command = Output("m", doc="commanded feed per revolution; below zero: none")

    @staticmethod
    def update(
        measured: float,
        programmed_feed: float,
        cutting_block: float,
        reference: float,
        feed_exponent: float,
        time_constant: float,
        smallest_measured: float,
        smallest_feed: float,
        largest_feed: float,
        held_feed: float,
        sample_period: float,
    ) -> float:
        """Equation (30), one sample."""
        if cutting_block < 0.5:
            return NO_COMMAND
        if held_feed < 0.0:
            return feed_within(programmed_feed, smallest_feed, largest_feed)
        force = measured if measured > smallest_measured else smallest_measured
        if force <= 0.0:
            return math.nan
        change = sample_period * (math.log(reference) - math.log(force)) / (time_constant * feed_exponent)
        if change > 20.0:
            return largest_feed
        return feed_within(held_feed * math.exp(change), smallest_feed, largest_feed)

    @staticmethod
    def output(held_feed: float) -> float:
        """Hold over the sample."""
        return held_feed
