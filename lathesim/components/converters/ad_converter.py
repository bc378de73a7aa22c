"""The converter from a sensor's voltage to a number in the unit of what is measured."""

from __future__ import annotations

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.components.converters.da_converter import nearest_level


class ADConverter(Component):
    """Gives a sensor's voltage as the computer sees it, saturated, rounded to V_min + k q, and divided by the sensor's gain.

    q = (V_max - V_min)/(2^n - 1). Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), section Spindle; 12 bits assumed.
    Left out: offset, conversion time, aliasing filter.
    """

    group = "converters"

    ports = {"measured": "voltage", "reading": "reading", "bits": "bits"}

    voltage = Input("V", doc="voltage of the sensor")

    smallest_voltage = Parameter("V", -10.0, doc="lower end of the range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the range")
    bits = Parameter("1", 12.0, low=1.0, high=32.0, doc="number of bits")
    sensor_gain = Parameter("V/({signal})", 1.0, doc="volts of the sensor per unit of what it measures")

    held = DiscreteState("V", doc="level of this sample")

    reading = Output("{signal}", doc="measured value")
    level = Output("V", doc="voltage of the level")

    @staticmethod
    def update(voltage: float, smallest_voltage: float, largest_voltage: float, bits: float) -> float:
        """Saturate and quantise."""
        return nearest_level(voltage, smallest_voltage, largest_voltage, bits)

    @staticmethod
    def output(held: float, sensor_gain: float) -> tuple[float, float]:
        """Back into the unit of what is measured; a sensor without gain reads 0."""
        return (held / sensor_gain if sensor_gain != 0.0 else 0.0), held
