"""A controller that a lesson of the rigs brings along: the position loop of a rotary table."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.hookspecs import hookimpl


class AngleController(Component):
    """Gives the voltage of a rotary table, once a sample:  u = Kp (r - q),  kept within the limit.

    Source: Y. Koren, Computer Control of Manufacturing Systems (1983), chapter 6. Left out: integral and derivative.
    """

    ports = {"measured": "measured", "drive": "reference", "reading": "voltage"}

    reference = Input("rad", doc="angle asked for")
    measured = Input("rad", doc="measured angle")

    proportional = Parameter("V/rad", 50.0, low=0.0, doc="Kp")
    limit = Parameter("V", 10.0, low=0.0, doc="largest command")

    held = DiscreteState("V", doc="command of this sample")

    voltage = Output("V", doc="command voltage")

    @staticmethod
    def update(reference: float, measured: float, proportional: float, limit: float) -> float:
        """One sample."""
        command = proportional * (reference - measured)
        if command > limit:
            return limit
        if command < -limit:
            return -limit
        return command

    @staticmethod
    def output(held: float) -> float:
        """Hold over the sample."""
        return held


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [AngleController]
