"""A force controller that undoes the power of the feed in the force."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.components.process_control.programmed_feed import NO_COMMAND

MILLIMETRE = 1.0e-3
KILOMETRE_PER_MINUTE = 1000.0 / 60.0


def process_gain(force_gain: float, depth_exponent: float, speed_exponent: float, depth: float, speed: float) -> float:
    """Return theta = K d^beta V^gamma: the measured quantity at 1 mm feed; d in mm, V in km/min inside the powers."""
    return force_gain * math.pow(depth / MILLIMETRE, depth_exponent) * math.pow(speed / KILOMETRE_PER_MINUTE, speed_exponent)


def feed_within(feed: float, smallest: float, largest: float) -> float:
    """Return a feed [m] kept within its limits."""
    if feed > largest:
        return largest
    if feed < smallest:
        return smallest
    return feed


class NonlinearProcessController(Component):
    """Gives the feed that brings a force (or torque, or power) to its reference, by integral control of u = f^alpha.

        model F = theta f^alpha,  theta = K d^beta V^gamma;   du/dt = Ki (F_r - F),  Ki = 1/(tau theta);   f = u^(1/alpha)

    As F is proportional to u, the loop is linear with the time constant tau where the model is right. It acts in blocks run at feed,
    beginning with the programmed feed; the feed, and with it u, stays within its limits. f and d count in mm, V in km/min.
    Source: R. G. Landers, A. G. Ulsoy, Model-Based Machining Force Control, ASME J. Dyn. Sys. Meas. Control 122 (2000); J. Liu,
    R. G. Landers (2004), equations (25), (26), (38). Left out: a model of the dynamics between feed and force.
    """

    group = "controllers"

    ports = {"measured": "measured"}

    measured = Input("{signal}", doc="measured force, torque or power")
    programmed_feed = Input("m", doc="feed per revolution of the interpolator")
    cutting_block = Input("1", doc="1 in blocks run at feed")

    reference = Parameter("{signal}", 500.0, low=0.0, doc="wanted force, torque or power")
    force_gain = Parameter("{signal}", 7705.0, low=1e-6, doc="estimated K: what is measured at 1 mm feed, 1 mm depth, 1 km/min")
    feed_exponent = Parameter("1", 0.891, low=0.05, high=3.0, doc="estimated alpha")
    depth_exponent = Parameter("1", 0.877, low=-3.0, high=3.0, doc="estimated beta")
    speed_exponent = Parameter("1", -0.273, low=-3.0, high=3.0, doc="estimated gamma")
    depth_of_cut = Parameter("m", 0.002, low=1e-6, high=0.1, doc="estimated depth of cut")
    cutting_speed = Parameter("m/s", 1.5707963267948966, low=1e-3, high=100.0, doc="estimated cutting speed")
    time_constant = Parameter("s", 0.4, low=1e-3, doc="wanted time constant of the closed loop")
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
        force_gain: float,
        feed_exponent: float,
        depth_exponent: float,
        speed_exponent: float,
        depth_of_cut: float,
        cutting_speed: float,
        time_constant: float,
        smallest_feed: float,
        largest_feed: float,
        held_feed: float,
        sample_period: float,
    ) -> float:
        """Equation (26), one sample."""
        if cutting_block < 0.5:
            return NO_COMMAND
        if held_feed < 0.0:
            return feed_within(programmed_feed, smallest_feed, largest_feed)
        theta = process_gain(force_gain, depth_exponent, speed_exponent, depth_of_cut, cutting_speed)
        control = math.pow(held_feed / MILLIMETRE, feed_exponent) + sample_period * (reference - measured) / (time_constant * theta)
        if control <= 0.0:
            return smallest_feed
        if math.log(control) / feed_exponent > math.log(largest_feed / MILLIMETRE):
            return largest_feed
        return feed_within(MILLIMETRE * math.pow(control, 1.0 / feed_exponent), smallest_feed, largest_feed)

    @staticmethod
    def output(held_feed: float) -> float:
        """Hold over the sample."""
        return held_feed
