"""A position loop small enough to check by hand: a sine reference, a proportional controller, a first-order axis."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter, State
from lathesim.engine.assembly import Assembly, Part, Wire

AMPLITUDE = 2.0


def sine(time: float) -> float:
    return AMPLITUDE * math.sin(time)


class Reference(Component):
    """A sine with noise on it."""

    now = DiscreteState("m", doc="reference of this sample")
    reference = Output("m", doc="reference position")
    noise = Noise(doc="noise of the reference")
    roughness = Parameter("m", 1e-3, doc="standard deviation of the noise")

    @staticmethod
    def update(time: float, noise: float, roughness: float) -> float:
        return sine(time) + roughness * noise

    @staticmethod
    def output(now: float) -> float:
        return now


class Proportional(Component):
    """u = gain (reference - measured)."""

    held = DiscreteState("V", doc="voltage of this sample")
    voltage = Output("V", doc="command voltage")
    reference = Input("m", doc="reference position")
    measured = Input("m", doc="measured position")
    gain = Parameter("V/m", 5.0, low=0.0, doc="proportional gain")

    @staticmethod
    def update(reference: float, measured: float, gain: float) -> float:
        return gain * (reference - measured)

    @staticmethod
    def output(held: float) -> float:
        return held


class Axis(Component):
    """lag dv/dt + v = gain u, dx/dt = v."""

    velocity = State("m/s", doc="velocity")
    travel = State("m", doc="position")
    voltage = Input("V", doc="command voltage")
    position = Output("m", doc="position")
    gain = Parameter("m/(s*V)", 1.0, doc="speed per volt")
    lag = Parameter("s", 0.1, low=0.0, doc="time constant")

    @staticmethod
    def derivative(velocity: float, voltage: float, gain: float, lag: float) -> tuple[float, float]:
        return (gain * voltage - velocity) / lag, velocity

    @staticmethod
    def output(travel: float) -> float:
        return travel


PARTS = (Part("source", Reference), Part("controller", Proportional), Part("axis", Axis))
WIRES = (
    Wire("controller.reference", "source.reference"),
    Wire("controller.measured", "axis.position"),
    Wire("axis.voltage", "controller.voltage"),
)


def loop(step: float = 0.0005) -> Assembly:
    return Assembly(PARTS, WIRES, 0.005, step)
