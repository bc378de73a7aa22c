"""The roughness a round tool nose leaves on the turned part."""

from __future__ import annotations

import math
from typing import Any

from lathesim.component import Component, DiscreteState, Input, Memory, Output, Parameter


class SurfaceFinish(Component):
    """Gives the average roughness R_a = f^2/(32 r) of the surface just cut, and keeps it along z.

    f is the feed per revolution, r the nose radius. ``along_z`` holds the roughness of each cell of the part, the last cut counting,
    from ``face`` over ``length``. Out of contact the roughness is 0.
    Source: G. Boothroyd, W. A. Knight, Fundamentals of Machining and Machine Tools (1989); J. Liu, R. G. Landers (2004), equation (33).
    Left out: built-up edge, vibration, tool wear, feeds larger than the nose radius.
    """

    group = "tool and part"

    feed = Input("m", doc="feed per revolution")
    in_contact = Input("1", doc="1 while tool and part touch in a block run at feed")
    z_position = Input("m", doc="actual z position of the tool tip")

    nose_radius = Parameter("m", 0.8e-3, low=1e-6, doc="corner radius of the tool")
    face = Parameter("m", 0.015, doc="z position of the end of the stock with smaller z")
    length = Parameter("m", 0.060, low=1e-6, doc="length of the stock")

    along_z = Memory("m", 600, doc="roughness of each cell")
    held = DiscreteState("m", doc="roughness of this sample")

    roughness = Output("m", doc="average roughness R_a of the surface being cut")

    @staticmethod
    def update(feed: float, in_contact: float, z_position: float, nose_radius: float, face: float, length: float, along_z: Any) -> float:
        """Equation (33), noted down where the tool is."""
        if in_contact < 0.5:
            return 0.0
        roughness = feed * feed / (32.0 * nose_radius)
        place = (z_position - face) / length * len(along_z)
        if 0.0 <= place < len(along_z):
            along_z[math.floor(place)] = roughness
        return roughness

    @staticmethod
    def output(held: float) -> float:
        """Hold over the sample."""
        return held
