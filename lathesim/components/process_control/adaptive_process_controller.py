"""A force controller that estimates the gain of the process while it cuts."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.components.process_control.nonlinear_process_controller import MILLIMETRE, feed_within
from lathesim.components.process_control.programmed_feed import NO_COMMAND


class AdaptiveProcessController(Component):
    """Gives the feed that brings a force (or torque, or power) to its reference, with the gain of the process estimated on line.

        model F = theta f;   recursive least squares with forgetting factor lambda and covariance P:
            k = P f/(lambda + f P f),  theta <- theta + k (F - theta f),  P <- (1 - k f) P/lambda;  P <- P_reset where P < P_min
        f <- f + (1 - p)/theta (F_r - F)

    p is the wanted closed-loop pole in discrete time: the error shrinks by p each sample. Below the contact threshold there is nothing to
    learn and nothing to control: estimate, covariance and feed stay as they are; without this the air cut drives the feed to its limit.
    theta has a floor. It acts in blocks run at feed, beginning with the programmed feed. f counts in mm.
    Source: A. G. Ulsoy, Y. Koren, Applications of Adaptive Control to Machine Tool Process Control, IEEE Control Systems Magazine 9
    (1989); least squares: K. J. Astrom, B. Wittenmark, Adaptive Control (1995), chapter 2; J. Liu, R. G. Landers (2004), (31) and (32),
    where (32) is misprinted, it means the rate of the feed. Left out: dynamics between feed and force.
    """

    group = "controllers"

    ports = {"measured": "measured"}

    measured = Input("{signal}", doc="measured force, torque or power")
    programmed_feed = Input("m", doc="feed per revolution of the interpolator")
    cutting_block = Input("1", doc="1 in blocks run at feed")

    reference = Parameter("{signal}", 500.0, low=0.0, doc="wanted force, torque or power")
    pole = Parameter("1", 0.9875778004938814, low=0.0, high=0.99999, doc="wanted pole of the closed loop, exp(-T/tau)")
    start_estimate = Parameter("{signal}", 1000.0, low=1e-9, doc="initial estimate of theta: what is measured at 1 mm feed")
    smallest_estimate = Parameter("{signal}", 1000.0, low=1e-9, doc="floor of the estimate")
    forgetting_factor = Parameter("1", 1.0, low=0.5, high=1.0, doc="lambda: weight of the past, 1 forgets nothing")
    reset_covariance = Parameter("1", 10.0, low=1e-9, doc="covariance at the start and after a reset")
    smallest_covariance = Parameter("1", 10.0, low=0.0, doc="covariance below which it is reset")
    contact_threshold = Parameter("{signal}", 50.0, low=0.0, doc="measured value below which the tool counts as out of the cut")
    smallest_feed = Parameter("m", 1e-7, low=1e-12, high=0.1, doc="smallest commanded feed")
    largest_feed = Parameter("m", 5e-4, low=1e-12, high=0.1, doc="largest commanded feed")

    held_feed = DiscreteState("m", -1.0, doc="commanded feed of this sample; below zero: none", shown=False)
    held_estimate = DiscreteState("{signal}", doc="estimate of theta")
    held_covariance = DiscreteState("1", doc="covariance of the estimate; 0: not begun")

    feed_command = Output("m", doc="commanded feed per revolution; below zero: none")
    estimate = Output("{signal}", doc="estimate of theta: what is measured at 1 mm feed")
    covariance = Output("1", doc="covariance of the estimate")

    @staticmethod
    def update(
        measured: float,
        programmed_feed: float,
        cutting_block: float,
        reference: float,
        pole: float,
        start_estimate: float,
        smallest_estimate: float,
        forgetting_factor: float,
        reset_covariance: float,
        smallest_covariance: float,
        contact_threshold: float,
        smallest_feed: float,
        largest_feed: float,
        held_feed: float,
        held_estimate: float,
        held_covariance: float,
    ) -> tuple[float, float, float]:
        """One sample of estimation, then of control."""
        if held_covariance <= 0.0:
            held_estimate = start_estimate if start_estimate > smallest_estimate else smallest_estimate
            held_covariance = reset_covariance
        if cutting_block < 0.5:
            return NO_COMMAND, held_estimate, held_covariance
        if held_feed < 0.0:
            return feed_within(programmed_feed, smallest_feed, largest_feed), held_estimate, held_covariance
        if measured < contact_threshold or measured <= 0.0:
            return held_feed, held_estimate, held_covariance
        feed = held_feed / MILLIMETRE
        gain = held_covariance * feed / (forgetting_factor + feed * held_covariance * feed)
        estimate = held_estimate + gain * (measured - held_estimate * feed)
        if estimate < smallest_estimate:
            estimate = smallest_estimate
        covariance = (1.0 - gain * feed) * held_covariance / forgetting_factor
        if covariance < smallest_covariance or covariance <= 0.0:
            covariance = reset_covariance
        change = MILLIMETRE * (1.0 - pole) / estimate * (reference - measured)
        return feed_within(held_feed + change, smallest_feed, largest_feed), estimate, covariance

    @staticmethod
    def output(held_feed: float, held_estimate: float, held_covariance: float) -> tuple[float, float, float]:
        """Hold over the sample."""
        return held_feed, held_estimate, held_covariance
