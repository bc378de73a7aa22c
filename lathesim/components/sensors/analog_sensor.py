"""An analog sensor: something measured to a voltage."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter


class AnalogSensor(Component):
    """Gives a voltage proportional to what it measures:  V = g s + b + r n,  n a standard normal number per sample.

    As an analog dynamometer it measures a cutting force, as a torque or power meter the load of the spindle; an ADConverter with
    ``sensor_gain`` wired from ``gain`` turns the voltage back.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), section Process control; 2 mV/N is assumed (10 V at 5 kN).
    Left out: bandwidth, drift, crosstalk, saturation (the converter saturates).
    """

    group = "converters"

    ports = {"measured": "measured", "reading": "voltage", "gain": "gain"}

    measured = Input("{signal}", doc="what is measured")

    gain = Parameter("V/({signal})", 0.002, doc="volts per unit of what is measured")
    bias = Parameter("V", 0.0, doc="constant offset")
    noise = Parameter("V", 0.0, low=0.0, doc="standard deviation of the white noise")

    chance = Noise(doc="white noise of the sensor")
    held = DiscreteState("V", doc="voltage of this sample")

    voltage = Output("V", doc="voltage of the sensor")

    @staticmethod
    def update(measured: float, gain: float, bias: float, noise: float, chance: float) -> float:
        """Signal and noise."""
        return gain * measured + bias + noise * chance

    @staticmethod
    def output(held: float) -> float:
        """Hold over the sample."""
        return held
