"""The converter from a number of the controller to a voltage."""

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
