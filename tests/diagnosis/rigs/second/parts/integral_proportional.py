"""A controller that a lesson of the rigs brings along: a P position loop around an I-P velocity loop."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.hookspecs import hookimpl


class IntegralProportional(Component):
    """Gives an axis' voltage:  w = kp (r - q),   u = kv/Ti sum((w - v) T) - kv v,   kept within the limit.

    Only the integral sees what is asked for. v is the difference of two-point means of q. A sample that would push the command further
    beyond its limit is not added to the sum.
    Source: G. Ellis, Control System Design Guide, 4th ed. (2012), chapter 6 (pseudo-derivative feedback). Left out: feed forward.
    """

    ports = {"measured": "measured", "drive": "reference", "reading": "voltage"}

    reference = Input("m", doc="position asked for")
    measured = Input("m", doc="measured position")

    position_gain = Parameter("1/s", 30.0, low=0.0, doc="kp")
    velocity_gain = Parameter("V*s/m", 40.0, low=0.0, doc="kv")
    integral_rate = Parameter("1/s", 50.0, low=0.0, doc="1/Ti")
    limit = Parameter("V", 10.0, low=0.0, doc="largest command")

    held = DiscreteState("V", doc="command of this sample")
    total = DiscreteState("V", doc="command of the integral part")
    before = DiscreteState("m", doc="measured position of this sample")
    mean = DiscreteState("m", doc="mean of the last two")

    voltage = Output("V", doc="command voltage")

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
        if (command > limit and grown > 0.0) or (command < -limit and grown < 0.0):
            command, grown = command - grown, 0.0
        if command > limit:
            command = limit
        if command < -limit:
            command = -limit
        return command, total + grown, measured, now

    @staticmethod
    def output(held: float) -> float:
        """Hold over the sample."""
        return held


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [IntegralProportional]
