"""Controllers that a lesson of the rigs brings along, because no lesson finds them in the program."""

from __future__ import annotations

from typing import ClassVar

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.elementary import within
from lathesim.hookspecs import hookimpl


class HeldCommand:
    """What these controllers share: what they are asked for and measure, and a command that they hold over the sample."""

    ports: ClassVar[dict[str, str]] = {"measured": "measured", "drive": "reference", "reading": "voltage"}

    reference = Input("m", doc="position asked for")
    measured = Input("m", doc="measured position")

    held = DiscreteState("V", doc="command of this sample")

    voltage = Output("V", doc="command voltage")

    @staticmethod
    def output(held: float) -> float:
        """Hold over the sample."""
        return held


def kept_within(command: float, grown: float, limit: float) -> tuple[float, float]:
    """Return the command within its limit, and by how much its sum grows: not at all where that pushes it further beyond."""
    if (command > limit and grown > 0.0) or (command < -limit and grown < 0.0):
        command, grown = command - grown, 0.0
    return within(command, -limit, limit), grown


class AngleController(HeldCommand, Component):
    """Gives the voltage of a rotary table, once a sample:  u = Kp (r - q),  kept within the limit.

    Source: Y. Koren, Computer Control of Manufacturing Systems (1983), chapter 6. Left out: integral and derivative.
    """

    reference = Input("rad", doc="angle asked for")
    measured = Input("rad", doc="measured angle")

    proportional = Parameter("V/rad", 50.0, low=0.0, doc="Kp")
    limit = Parameter("V", 10.0, low=0.0, doc="largest command")

    @staticmethod
    def update(reference: float, measured: float, proportional: float, limit: float) -> float:
        """One sample."""
        return within(proportional * (reference - measured), -limit, limit)


class FeedforwardCascade(HeldCommand, Component):
    """Gives an axis' voltage:  w = kp (r - q) + share dr/dt,   u = kv (w - v) + kv/Ti sum((w - v) T),   kept within the limit.

    v is the difference of two-point means of q. A sample that would push the command further beyond its limit is not added to the sum.
    Source: G. Ellis, Control System Design Guide, 4th ed. (2012), chapter 8. Left out: acceleration fed forward.
    """

    position_gain = Parameter("1/s", 30.0, low=0.0, doc="kp")
    velocity_gain = Parameter("V*s/m", 300.0, low=0.0, doc="kv")
    integral_rate = Parameter("1/s", 0.0, low=0.0, doc="1/Ti")
    share = Parameter("1", 1.0, low=0.0, high=2.0, doc="share of the velocity that is fed forward")
    limit = Parameter("V", 10.0, low=0.0, doc="largest command")

    total = DiscreteState("V", doc="command of the integral part")
    before = DiscreteState("m", doc="measured position of this sample")
    mean = DiscreteState("m", doc="mean of the last two")
    asked = DiscreteState("m", doc="reference of this sample")

    @staticmethod
    def update(
        reference: float,
        measured: float,
        position_gain: float,
        velocity_gain: float,
        integral_rate: float,
        share: float,
        limit: float,
        total: float,
        before: float,
        mean: float,
        asked: float,
        sample_period: float,
        time: float,
    ) -> tuple[float, float, float, float, float]:
        """Both loops."""
        if time <= 0.0:
            before, mean, asked = measured, measured, reference
        now = 0.5 * (measured + before)
        error = position_gain * (reference - measured) + (share * (reference - asked) - (now - mean)) / sample_period
        grown = velocity_gain * integral_rate * sample_period * error
        command = velocity_gain * error + total + grown
        command, grown = kept_within(command, grown, limit)
        return command, total + grown, measured, now, reference


class IntegralProportional(HeldCommand, Component):
    """Gives an axis' voltage:  w = kp (r - q),   u = kv/Ti sum((w - v) T) - kv v,   kept within the limit.

    Only the integral sees what is asked for. v is the difference of two-point means of q. A sample that would push the command further
    beyond its limit is not added to the sum.
    Source: G. Ellis, Control System Design Guide, 4th ed. (2012), chapter 6 (pseudo-derivative feedback). Left out: feed forward.
    """

    position_gain = Parameter("1/s", 30.0, low=0.0, doc="kp")
    velocity_gain = Parameter("V*s/m", 40.0, low=0.0, doc="kv")
    integral_rate = Parameter("1/s", 50.0, low=0.0, doc="1/Ti")
    limit = Parameter("V", 10.0, low=0.0, doc="largest command")

    total = DiscreteState("V", doc="command of the integral part")
    before = DiscreteState("m", doc="measured position of this sample")
    mean = DiscreteState("m", doc="mean of the last two")

    @staticmethod
    def update(
        reference: float,
        measured: float,
        position_gain: float,
        velocity_gain: float,
        integral_rate: float,
        limit: float,
        total: float,
        before: float,
        mean: float,
        sample_period: float,
        time: float,
    ) -> tuple[float, float, float, float]:
        """Both loops."""
        if time <= 0.0:
            before, mean = measured, measured
        now = 0.5 * (measured + before)
        speed = (now - mean) / sample_period
        grown = velocity_gain * integral_rate * sample_period * (position_gain * (reference - measured) - speed)
        command = total + grown - velocity_gain * speed
        command, grown = kept_within(command, grown, limit)
        return command, total + grown, measured, now


class MeasuredDerivative(HeldCommand, Component):
    """Gives an axis' voltage:  u = Kp e + Ki sum(e T) - Kd (q_k - q_(k-1))/T,  e = r - q,  kept within the limit.

    A sample that would push the command further beyond its limit is not added to the sum. Source: K. J. Astrom, T. Hagglund, PID
    Controllers (1995), section 3.4. Left out: a filter on the derivative.
    """

    proportional = Parameter("V/m", 100.0, low=0.0, doc="Kp")
    integral = Parameter("V/(m*s)", 0.0, low=0.0, doc="Ki")
    derivative_gain = Parameter("V*s/m", 0.0, low=0.0, doc="Kd")
    limit = Parameter("V", 10.0, low=0.0, doc="largest command")

    total = DiscreteState("V", doc="command of the integral part")
    before = DiscreteState("m", doc="measured position of this sample")

    @staticmethod
    def update(
        reference: float,
        measured: float,
        proportional: float,
        integral: float,
        derivative_gain: float,
        limit: float,
        total: float,
        before: float,
        sample_period: float,
        time: float,
    ) -> tuple[float, float, float]:
        """One sample."""
        moved = 0.0 if time <= 0.0 else measured - before
        error = reference - measured
        grown = integral * error * sample_period
        command = proportional * error - derivative_gain * moved / sample_period + total + grown
        command, grown = kept_within(command, grown, limit)
        return command, total + grown, measured


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the parts to the simulator."""
    return [AngleController, FeedforwardCascade, IntegralProportional, MeasuredDerivative]
