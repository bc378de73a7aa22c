"""An accelerometer on the tool, with its charge amplifier and anti-aliasing filter."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter, State

_NARROW, _WIDE = 0.3826834323650898, 0.9238795325112867
"""Damping ratios of the two pairs of poles of a Butterworth filter of fourth order: the sines of 22.5 and 67.5 degrees."""


class Accelerometer(Component):
    """Gives the acceleration of the place where it sits, low-passed against aliasing, with noise, and clipped at its range.

    The filter is of fourth order (Butterworth), so that two channels of the same bandwidth differ by nothing but what they measure. Source:
    D. J. Ewins, Modal Testing (2000), section 3.5. Left out: its mass, its own resonance, drift.
    """

    group = "converters"

    ports = {"measured": "measured", "reading": "reading"}

    measured = Input("m/s^2", doc="what is measured")

    bandwidth = Parameter("Hz", 4000.0, low=0.1, doc="corner frequency of the filter")
    noise = Parameter("m/s^2", 0.0, low=0.0, doc="standard deviation of the white noise")
    range = Parameter("m/s^2", 1e9, low=0.0, doc="largest reading; what is beyond is clipped")

    first = State("m/s^2", doc="output of the first half of the filter")
    first_rate = State("(m/s^2)/s", doc="its rate")
    second = State("m/s^2", doc="output of the filter")
    second_rate = State("(m/s^2)/s", doc="its rate")
    chance = Noise(doc="white noise of the channel")
    held = DiscreteState("m/s^2", doc="reading of this sample")

    reading = Output("m/s^2", doc="what was read")

    @staticmethod
    def derivative(
        measured: float, bandwidth: float, first: float, first_rate: float, second: float, second_rate: float
    ) -> tuple[float, float, float, float]:
        w = 2.0 * math.pi * bandwidth
        return (
            first_rate,
            w * (w * (measured - first) - 2.0 * _WIDE * first_rate),
            second_rate,
            w * (w * (first - second) - 2.0 * _NARROW * second_rate),
        )

    @staticmethod
    def update(second: float, noise: float, range: float, chance: float) -> float:
        reading = second + noise * chance
        return min(max(reading, -range), range)

    @staticmethod
    def output(held: float) -> float:
        return held
