"""The linear encoder of an axis."""

from __future__ import annotations

import math

from lathesim.component import Component, DiscreteState, Input, Output, Parameter


class LinearEncoder(Component):
    """Gives the position of a table in whole counts:  reading = r floor(x/r + 1/2), once a sample.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), section Axes; the resolution of 1 um is assumed.
    Left out: interpolation error within a period of the scale, lost counts, offset of the read head.
    """

    group = "converters"

    ports = {"measured": "measured", "reading": "position", "resolution": "resolution"}

    measured = Input("m", doc="actual position of the table")

    resolution = Parameter("m", 1e-6, low=0.0, doc="length of one count; 0 measures exactly")

    counted = DiscreteState("m", doc="position of this sample")

    position = Output("m", doc="measured position")

    @staticmethod
    def update(measured: float, resolution: float) -> float:
        """Round to the nearest count."""
        if resolution <= 0.0 or not abs(measured) < 1e15 * resolution:
            return measured
        return resolution * math.floor(measured / resolution + 0.5)

    @staticmethod
    def output(counted: float) -> float:
        """Hold over the sample."""
        return counted
