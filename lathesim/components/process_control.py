"""Controllers of the cutting process: they choose the feed from the force."""

from __future__ import annotations

import math
from typing import ClassVar

from lathesim.component import ON, Component, DiscreteState, Input, Output, Parameter
from lathesim.elementary import within

_ONE_METRE = 6.9
"""Logarithm of a feed of 1 m in mm."""
_LARGEST_CHANGE = 20.0
"""Logarithm of a change of the feed beyond which it stands at its limit anyway."""

NO_COMMAND = -1.0
"""Feed [m] that tells the interpolator that nothing is commanded."""


class ProgrammedFeed(Component):
    """Gives no feed command, so the part program's feed holds. It keeps the place of a process controller in a machine.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), Example 2, case I.
    """

    group = "controllers"

    measured = Input("{signal}", doc="measured force, torque or power")
    programmed_feed = Input("m", doc="feed per revolution of the interpolator")
    cutting_block = Input("1", doc="1 in blocks run at feed")

    feed_command = Output("m", doc="commanded feed per revolution; below zero: none")

    @staticmethod
    def output() -> float:
        return NO_COMMAND


MILLIMETRE = 1.0e-3
KILOMETRE_PER_MINUTE = 1000.0 / 60.0


def process_gain(force_gain: float, depth_exponent: float, speed_exponent: float, depth: float, speed: float) -> float:
    """Return theta = K d^beta V^gamma: the measured quantity at 1 mm feed; d in mm, V in km/min inside the powers."""
    return force_gain * math.pow(depth / MILLIMETRE, depth_exponent) * math.pow(speed / KILOMETRE_PER_MINUTE, speed_exponent)


class CommandedFeed:
    """What the controllers share that choose the feed once a sample."""

    ports: ClassVar[dict[str, str]] = {"measured": "measured"}

    held_feed = DiscreteState("m", -1.0, doc="commanded feed of this sample; below zero: none", shown=False)

    @staticmethod
    def output(held_feed: float) -> float:
        return held_feed


class NonlinearProcessController(CommandedFeed, ProgrammedFeed):  # type: ignore[misc]  # a law's arguments are its own
    """Gives the feed that brings a force (or torque, or power) to its reference, by integral control of u = f^alpha.

        model F = theta f^alpha,  theta = K d^beta V^gamma;   du/dt = Ki (F_r - F),  Ki = 1/(tau theta);   f = u^(1/alpha)

    As F is proportional to u, the loop is linear with the time constant tau where the model is right. It acts in blocks run at feed,
    beginning with the programmed feed; the feed, and with it u, stays within its limits. f and d count in mm, V in km/min.
    Source: R. G. Landers, A. G. Ulsoy, Model-Based Machining Force Control, ASME J. Dyn. Sys. Meas. Control 122 (2000); J. Liu,
    R. G. Landers (2004), equations (25), (26), (38). Left out: a model of the dynamics between feed and force.
    """

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

    @staticmethod
    def update(
        measured: float, programmed_feed: float, cutting_block: float, reference: float, force_gain: float, feed_exponent: float,
        depth_exponent: float, speed_exponent: float, depth_of_cut: float, cutting_speed: float, time_constant: float, smallest_feed: float,
        largest_feed: float, held_feed: float, sample_period: float,
    ) -> float:  # fmt: skip
        """Equation (26), one sample."""
        if cutting_block < ON:
            return NO_COMMAND
        if held_feed < 0.0:
            return within(programmed_feed, smallest_feed, largest_feed)
        theta = process_gain(force_gain, depth_exponent, speed_exponent, depth_of_cut, cutting_speed)
        control = math.pow(held_feed / MILLIMETRE, feed_exponent) + sample_period * (reference - measured) / (time_constant * theta)
        if control <= 0.0:
            return smallest_feed
        if math.log(control) / feed_exponent > math.log(largest_feed / MILLIMETRE):
            return largest_feed
        return within(MILLIMETRE * math.pow(control, 1.0 / feed_exponent), smallest_feed, largest_feed)


def nominal_feed(share: float, exponent: float) -> float:
    """Return the feed [m] at which theta f^exponent is ``share`` theta, at most 1 m."""
    logarithm = math.log(share) / exponent
    return MILLIMETRE * math.exp(logarithm if logarithm < _ONE_METRE else _ONE_METRE)


class LinearizationProcessController(NonlinearProcessController):
    """Gives the feed that brings a force (or torque, or power) to its reference, by integral control of the feed itself.

        d(Delta f)/dt = Ki (F_r - F),  f = f_0 + Delta f;   f_0 = (F_r/theta)^(1/alpha),  Ki = 1/(tau k),  k = alpha theta f_0^(alpha-1)

    k is the slope of the model F = theta f^alpha at the nominal feed f_0, which gives the reference force; away from it the loop is
    faster or slower than tau. Otherwise as NonlinearProcessController.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (25), (27), (28).
    """

    @staticmethod
    def update(
        measured: float, programmed_feed: float, cutting_block: float, reference: float, force_gain: float, feed_exponent: float,
        depth_exponent: float, speed_exponent: float, depth_of_cut: float, cutting_speed: float, time_constant: float, smallest_feed: float,
        largest_feed: float, held_feed: float, sample_period: float,
    ) -> float:  # fmt: skip
        """Equations (27) and (28), one sample."""
        if cutting_block < ON:
            return NO_COMMAND
        if held_feed < 0.0:
            return within(programmed_feed, smallest_feed, largest_feed)
        theta = process_gain(force_gain, depth_exponent, speed_exponent, depth_of_cut, cutting_speed)
        nominal = smallest_feed if reference <= 0.0 else nominal_feed(reference / theta, feed_exponent)
        nominal = within(nominal, smallest_feed, largest_feed)
        slope = feed_exponent * theta * math.pow(nominal / MILLIMETRE, feed_exponent - 1.0)
        feed = held_feed + MILLIMETRE * sample_period * (reference - measured) / (time_constant * slope)
        return within(feed, smallest_feed, largest_feed)


class LogTransformProcessController(CommandedFeed, ProgrammedFeed):  # type: ignore[misc]  # a law's arguments are its own
    """Gives the feed that brings a force (or torque, or power) to its reference, by integral control of ln f.

        model ln F = ln theta + alpha ln f;   d(ln f)/dt = Ki (ln F_r - ln F),  Ki = 1/(tau alpha)

    In logarithms the loop is linear for every theta, so neither depth nor speed need be known. But ln F needs a force above zero: in the
    air, or where the true force vanishes, the controller is unstable, and the run ends there with the feed no longer a number, unless
    ``smallest_measured`` puts a floor under F. It acts in blocks run at feed, beginning with the programmed feed.
    Source: L. Harder, Cutting Force Control in Turning, PhD thesis, KTH Stockholm (1995); J. Liu, R. G. Landers (2004), (29), (30).
    """

    breaks_where: ClassVar[str] = "ln F is required of a force that is not above zero, while smallest_measured is 0"
    reference = Parameter("{signal}", 500.0, low=1e-9, doc="wanted force, torque or power")
    feed_exponent = Parameter("1", 0.891, low=0.05, high=3.0, doc="estimated alpha")
    time_constant = Parameter("s", 0.4, low=1e-3, doc="wanted time constant of the closed loop")
    smallest_measured = Parameter("{signal}", 0.0, low=0.0, doc="floor under the measured value in the logarithm; 0: none")
    smallest_feed = Parameter("m", 1e-7, low=1e-12, high=0.1, doc="smallest commanded feed")
    largest_feed = Parameter("m", 5e-4, low=1e-12, high=0.1, doc="largest commanded feed")

    @staticmethod
    def update(
        measured: float, programmed_feed: float, cutting_block: float, reference: float, feed_exponent: float, time_constant: float,
        smallest_measured: float, smallest_feed: float, largest_feed: float, held_feed: float, sample_period: float,
    ) -> float:  # fmt: skip
        """Equation (30), one sample."""
        if cutting_block < ON:
            return NO_COMMAND
        if held_feed < 0.0:
            return within(programmed_feed, smallest_feed, largest_feed)
        force = measured if measured > smallest_measured else smallest_measured
        if force <= 0.0:
            return math.nan
        change = sample_period * (math.log(reference) - math.log(force)) / (time_constant * feed_exponent)
        if change > _LARGEST_CHANGE:
            return largest_feed
        return within(held_feed * math.exp(change), smallest_feed, largest_feed)


class AdaptiveProcessController(CommandedFeed, ProgrammedFeed):
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

    held_estimate = DiscreteState("{signal}", doc="estimate of theta")
    held_covariance = DiscreteState("1", doc="covariance of the estimate; 0: not begun")

    estimate = Output("{signal}", doc="estimate of theta: what is measured at 1 mm feed")
    covariance = Output("1", doc="covariance of the estimate")

    @staticmethod
    def update(
        measured: float, programmed_feed: float, cutting_block: float, reference: float, pole: float, start_estimate: float,
        smallest_estimate: float, forgetting_factor: float, reset_covariance: float, smallest_covariance: float, contact_threshold: float,
        smallest_feed: float, largest_feed: float, held_feed: float, held_estimate: float, held_covariance: float,
    ) -> tuple[float, float, float]:  # fmt: skip
        if held_covariance <= 0.0:
            held_estimate = start_estimate if start_estimate > smallest_estimate else smallest_estimate
            held_covariance = reset_covariance
        if cutting_block < ON:
            return NO_COMMAND, held_estimate, held_covariance
        if held_feed < 0.0:
            return within(programmed_feed, smallest_feed, largest_feed), held_estimate, held_covariance
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
        return within(held_feed + change, smallest_feed, largest_feed), estimate, covariance

    @staticmethod
    def output(held_feed: float, held_estimate: float, held_covariance: float) -> tuple[float, float, float]:  # type: ignore[override]  # a law's arguments are its own
        return held_feed, held_estimate, held_covariance
