"""The multi-oscillatory position controller: one proportional part, and oscillatory elements in a chain."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State


class MultiOscillatoryController(Component):
    """Gives the speed asked for from the position error and what the oscillatory elements add:

        e = reference - measured,   v = kv (kp e + added)

    Source: A. Tiwari et al., Learning digital emulators for closed architecture machine tool controllers, J. Manuf. Syst. 68 (2023),
    equation (1); element i is taken with gain i alone. Left out: limits of the speed.
    """

    group = "controllers"
    ports = {"measured": "measured", "drive": "reference", "reading": "speed", "loop_gain": "loop_gain", "error": "error"}

    reference = Input("m", doc="position asked for")
    measured = Input("m", doc="position as it arrives")
    added = Input("m", default=0.0, doc="sum of the oscillatory elements")

    proportional = Parameter("1", 1.0, low=0.0, doc="kp (p23): share of the error itself")
    loop_gain = Parameter("1/s", 20.0, low=0.0, doc="kv (p24): speed asked for per error")

    error = Output("m", doc="position error, which the oscillatory elements take")
    speed = Output("m/s", doc="speed asked for")

    @staticmethod
    def output_error(reference: float, measured: float) -> float:
        """The error."""
        return reference - measured

    @staticmethod
    def output_speed(reference: float, measured: float, added: float, proportional: float, loop_gain: float) -> float:
        """The speed."""
        return loop_gain * (proportional * (reference - measured) + added)


class OscillatoryElement(Component):
    """Gives the sum of the elements before it and of its own answer to the position error:

        Y(s) = g w s / (s^2 + 2 z w s + w^2) E(s)

    It answers to what swings near w and to nothing that stays constant.

    Source: as :class:`MultiOscillatoryController`, equation (1).
    """

    group = "controllers"

    error = Input("m", doc="position error")
    before = Input("m", default=0.0, doc="sum of the elements before this one")

    frequency = Parameter("rad/s", 15.0, low=1e-6, doc="w: where it answers most")
    damping = Parameter("1", 0.4, low=0.0, doc="z: damping ratio")
    gain = Parameter("1", 0.02, low=0.0, doc="g: weight of the element")

    swing = State("m*s^2", doc="twice integrated error of the element")
    rate = State("m*s", doc="its rate")

    added = Output("m", doc="sum up to this element")

    @staticmethod
    def derivative(error: float, swing: float, rate: float, frequency: float, damping: float) -> tuple[float, float]:
        """An oscillator driven by the error."""
        return rate, error - 2.0 * damping * frequency * rate - frequency * frequency * swing

    @staticmethod
    def output(before: float, rate: float, frequency: float, gain: float) -> float:
        """Add to the chain."""
        return before + gain * frequency * rate
