"""Converters between numbers and voltages."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Output, Parameter


def nearest_level(voltage: float, low: float, high: float, bits: float) -> float:
    """Return the level low + k q nearest to a voltage, with q = (high - low)/(2^bits - 1) and k from 0 to 2^bits - 1."""
    steps = math.pow(2.0, bits) - 1.0
    quantum = (high - low) / steps
    if voltage <= low or quantum <= 0.0:
        return low
    if voltage >= high:
        return high
    if math.isnan(voltage):
        return voltage
    return low + math.floor((voltage - low) / quantum + 0.5) * quantum


class DAConverter(Component):
    """Gives the voltage held for one sample: the command saturated and rounded to the nearest level.

    The levels are V_min + k q, q = (V_max - V_min)/(2^n - 1), k from 0 to 2^n - 1. With a symmetric range zero volts is not a level, so
    an axis at rest is never quite without voltage.
    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), section Spindle; 8 bits fitted to its Table 1.
    Left out: offset, settling, differential nonlinearity.
    """

    group = "converters"

    ports = {"drive": "command", "measured": "command", "reading": "voltage"}

    command = Input("V", doc="voltage asked for")

    smallest_voltage = Parameter("V", -10.0, doc="lower end of the range")
    largest_voltage = Parameter("V", 10.0, doc="upper end of the range")
    bits = Parameter("1", 8.0, low=1.0, high=32.0, doc="number of bits")

    held = DiscreteState("V", doc="voltage of this sample")

    voltage = Output("V", doc="voltage of the converter")

    @staticmethod
    def update(command: float, smallest_voltage: float, largest_voltage: float, bits: float) -> float:
        """Saturate and quantise."""
        return nearest_level(command, smallest_voltage, largest_voltage, bits)

    @staticmethod
    def output(held: float) -> float:
        """Hold over the sample."""
        return held


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
