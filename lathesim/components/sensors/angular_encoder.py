"""The encoder of a spindle or motor, with the speed a controller makes of its counts."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Output, Parameter


class AngularEncoder(Component):
    """Gives an angle in whole counts and its backward difference:  reading = r floor(a/r + 1/2),  rate = (reading_k - reading_{k-1})/T.

    Source: G. Ellis, Control System Design Guide, 4th ed. (2012), chapter 14 (resolution of a difference: r/T); the default of 10 000
    counts a turn is that of the motor bench HSM150 (2023). Left out: eccentricity, interpolation error, lost counts.
    """

    group = "converters"

    ports = {"measured": "measured", "reading": "angle", "rate": "rate", "resolution": "resolution"}

    measured = Input("rad", doc="actual angle")

    resolution = Parameter("rad", 6.283185307179586e-4, low=0.0, doc="angle of one count; 0 measures exactly")
    start_rate = Parameter("rad/s", 0.0, doc="rate given at the first sample")

    counted = DiscreteState("rad", doc="angle of this sample")
    difference = DiscreteState("rad/s", doc="rate of this sample")

    angle = Output("rad", doc="measured angle")
    rate = Output("rad/s", doc="measured rate")

    @staticmethod
    def update(
        measured: float, counted: float, resolution: float, start_rate: float, sample_period: float, time: float
    ) -> tuple[float, float]:
        """Round to the nearest count, then take the difference."""
        now = measured
        if resolution > 0.0 and abs(measured) < 1e15 * resolution:
            now = resolution * math.floor(measured / resolution + 0.5)
        if time <= 0.0:
            return now, start_rate
        return now, (now - counted) / sample_period

    @staticmethod
    def output(counted: float, difference: float) -> tuple[float, float]:
        """Hold over the sample."""
        return counted, difference
