"""A controller that a lesson of the rigs brings along: PID with the derivative of what is measured."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.hookspecs import hookimpl


class MeasuredDerivative(Component):
    """Gives an axis' voltage:  u = Kp e + Ki sum(e T) - Kd (q_k - q_(k-1))/T,  e = r - q,  kept within the limit.

    A sample that would push the command further beyond its limit is not added to the sum. Source: K. J. Astrom, T. Hagglund, PID
    Controllers (1995), section 3.4. Left out: a filter on the derivative.
    """

    ports = {"measured": "measured", "drive": "reference", "reading": "voltage"}

    reference = Input("m", doc="position asked for")
    measured = Input("m", doc="measured position")

    proportional = Parameter("V/m", 100.0, low=0.0, doc="Kp")
    integral = Parameter("V/(m*s)", 0.0, low=0.0, doc="Ki")
    derivative_gain = Parameter("V*s/m", 0.0, low=0.0, doc="Kd")
    limit = Parameter("V", 10.0, low=0.0, doc="largest command")

    held = DiscreteState("V", doc="command of this sample")
    total = DiscreteState("V", doc="command of the integral part")
    before = DiscreteState("m", doc="measured position of this sample")

    voltage = Output("V", doc="command voltage")

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
        if (command > limit and grown > 0.0) or (command < -limit and grown < 0.0):
            command, grown = command - grown, 0.0
        if command > limit:
            command = limit
        if command < -limit:
            command = -limit
        return command, total + grown, measured

    @staticmethod
    def output(held: float) -> float:
        """Hold over the sample."""
        return held


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [MeasuredDerivative]
