"""A machine of any number of like axes, to see how the cost grows with the machine."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Output, Parameter
from lathesim.components.axes import EmpiricalAxis
from lathesim.components.sensors import DAConverter, LinearEncoder
from lathesim.components.servo_controllers import PositionController
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.wiring import Plan, wire

SAMPLE_PERIOD = 0.005
STEP = 0.0005


class SweptReference(Component):
    """Gives a reference that swings:  r = amplitude sin(frequency t)."""

    now = DiscreteState("m", doc="reference of this sample")
    reference = Output("m", doc="reference position")
    amplitude = Parameter("m", 0.05, doc="amplitude of the swing")
    frequency = Parameter("rad/s", 1.0, doc="angular frequency of the swing")

    @staticmethod
    def update(time: float, amplitude: float, frequency: float) -> float:
        """The sine of this instant."""
        return amplitude * math.sin(frequency * time)

    @staticmethod
    def output(now: float) -> float:
        """Hold over the sample."""
        return now


def axes_plan(axes: int) -> Plan:
    """Return ``axes`` position loops (encoder, controller, converter, table) that follow one reference; position and error are recorded."""
    parts = [Part("source", SweptReference)]
    wires = []
    for number in range(1, axes + 1):
        encoder, controller, dac, axis = (f"{kind}{number}" for kind in ("encoder", "controller", "dac", "axis"))
        parts += [Part(encoder, LinearEncoder), Part(controller, PositionController), Part(dac, DAConverter), Part(axis, EmpiricalAxis)]
        wires += [
            Wire(f"{encoder}.measured", f"{axis}.position"),
            Wire(f"{controller}.reference", "source.reference"),
            Wire(f"{controller}.measured", f"{encoder}.position"),
            Wire(f"{dac}.command", f"{controller}.voltage"),
            Wire(f"{axis}.voltage", f"{dac}.voltage"),
        ]
    channels = [name for number in range(1, axes + 1) for name in (f"axis{number}.position", f"controller{number}.error")]
    return wire(Assembly(tuple(parts), tuple(wires), SAMPLE_PERIOD, STEP, record=tuple(channels)))
