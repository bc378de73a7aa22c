"""A force controller designed on the force linearized about a nominal feed."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState
from lathesim.components.process_control.nonlinear_process_controller import (
    MILLIMETRE,
    NonlinearProcessController,
    feed_within,
    process_gain,
)
from lathesim.components.process_control.programmed_feed import NO_COMMAND


def nominal_feed(share: float, exponent: float) -> float:
    """Return the feed [m] at which theta f^exponent is ``share`` theta, at most 1 m."""
    logarithm = math.log(share) / exponent
    return MILLIMETRE * math.exp(logarithm if logarithm < 6.9 else 6.9)


class LinearizationProcessController(NonlinearProcessController):
    """Gives the feed that brings a force (or torque, or power) to its reference, by integral control of the feed itself.

        d(Delta f)/dt = Ki (F_r - F),  f = f_0 + Delta f;   f_0 = (F_r/theta)^(1/alpha),  Ki = 1/(tau k),  k = alpha theta f_0^(alpha-1)

    k is the slope of the model F = theta f^alpha at the nominal feed f_0, which gives the reference force; away from it the loop is
    faster or slower than tau. Otherwise as NonlinearProcessController.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (25), (27), (28).
    """

    held_feed = DiscreteState("m", -1.0, doc="commanded feed of this sample; below zero: none", shown=False)

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
        """Equations (27) and (28), one sample."""
        if cutting_block < 0.5:
            return NO_COMMAND
        if held_feed < 0.0:
            return feed_within(programmed_feed, smallest_feed, largest_feed)
        theta = process_gain(force_gain, depth_exponent, speed_exponent, depth_of_cut, cutting_speed)
        nominal = smallest_feed if reference <= 0.0 else nominal_feed(reference / theta, feed_exponent)
        nominal = feed_within(nominal, smallest_feed, largest_feed)
        slope = feed_exponent * theta * math.pow(nominal / MILLIMETRE, feed_exponent - 1.0)
        feed = held_feed + MILLIMETRE * sample_period * (reference - measured) / (time_constant * slope)
        return feed_within(feed, smallest_feed, largest_feed)
