"""The tachometer of the spindle, with its noises."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter


class Tachometer(Component):
    """Gives a voltage proportional to speed with white noise, bias and ripple:  V = Kt w + b + s n + r sin(N a).

    n is a standard normal number per sample, a the angle of the spindle, N the ripples per turn.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), section Spindle; gain assumed (10 V at 6250 rpm).
    Left out: nonlinearity, temperature. Noise is new at every sample and held over it.
    """

    group = "converters"

    ports = {"measured": "speed", "reading": "voltage", "gain": "gain"}

    speed = Input("rad/s", doc="actual speed of the spindle")
    angle = Input("rad", default=0.0, doc="angle of the spindle, which times the ripple")

    gain = Parameter("V*s/rad", 0.015278874536821952, doc="volts per speed")
    noise = Parameter("V", 0.0, low=0.0, doc="standard deviation of the white noise")
    bias = Parameter("V", 0.0, doc="constant offset")
    ripple = Parameter("V", 0.0, low=0.0, doc="amplitude of the ripple")
    ripples = Parameter("1", 8.0, low=0.0, doc="ripples per turn")

    chance = Noise(doc="white noise of the tachometer")
    held = DiscreteState("V", doc="voltage of this sample")

    voltage = Output("V", doc="voltage of the tachometer")

    @staticmethod
    def update(speed: float, angle: float, gain: float, noise: float, bias: float, ripple: float, ripples: float, chance: float) -> float:
        """Signal and noises."""
        return gain * speed + bias + noise * chance + ripple * math.sin(ripples * angle)

    @staticmethod
    def output(held: float) -> float:
        """Hold over the sample."""
        return held
