"""Turning as a process by itself: feed, depth and speed to forces."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output, Parameter, State


class CuttingProcess(Component):
    """Gives the three forces of a turning cut, the spindle angle, and the time since entry:  Fc = kc b h (h / 1 mm)^-m.

        h = f sin(kappa),   b = d / sin(kappa),   Fp = thrust_ratio Fc,   Ff = feed_ratio Fc

    Fc is what arrives at ``acting_force``: wire ``main_force`` to it, and what changes the main force on that wire changes all three. With
    exponent m = 0 the law is linear. The tool cuts while feed, depth and speed are above zero.

    Source: O. Kienzle, VDI-Z 94 (1952); Y. Altintas, Manufacturing Automation, 2nd ed. (2012), section 2.3. kc of a medium steel, the
    ratios are assumed. Left out: edge force, the build-up over the first turn, nose radius, wear, temperature, vibration.
    """

    group = "process"

    ports = {
        "force": "main_force",
        "thrust_force": "thrust_force",
        "feed_force": "feed_force",
        "feed": "feed",
        "depth": "depth",
        "speed": "speed",
        "angle": "angle",
        "spindle_speed": "spindle_speed",
        "in_cut": "in_cut",
        "cutting_time": "cutting_time",
    }

    feed = Input("m", doc="feed per turn")
    depth = Input("m", doc="depth of cut")
    speed = Input("m/s", doc="cutting speed")
    acting_force = Input("N", doc="main force that acts, of which thrust and feed force are shares")

    specific_force = Parameter("N/m^2", 1.8e9, low=0.0, doc="kc1.1: force per area of a chip 1 mm thick")
    exponent = Parameter("1", 0.0, low=0.0, high=0.99, doc="m: how the specific force falls with the thickness; 0 linear")
    thrust_ratio = Parameter("1", 0.4, low=-5.0, high=5.0, doc="thrust force over main force")
    feed_ratio = Parameter("1", 0.5, low=-5.0, high=5.0, doc="feed force over main force")
    approach_angle = Parameter("rad", 1.5707963267948966, low=0.1, high=1.5707963267948966, doc="kappa: angle of the cutting edge")
    radius = Parameter("m", 0.02, low=1e-4, doc="radius of the part, which makes the angle of the speed")

    turned = State("rad", doc="spindle angle")
    since_entry = State("s", doc="time since the tool entered; falls back outside the cut")

    main_force = Output("N", doc="Fc, along the cutting speed")
    thrust_force = Output("N", doc="Fp, along the depth")
    feed_force = Output("N", doc="Ff, along the feed")
    angle = Output("rad", doc="spindle angle since the start")
    spindle_speed = Output("rad/s", doc="spindle speed")
    in_cut = Output("1", doc="1 in the cut, else 0")
    cutting_time = Output("s", doc="time since the tool entered")

    @staticmethod
    def derivative(feed: float, depth: float, speed: float, radius: float, since_entry: float, step: float) -> tuple[float, float]:
        """The turning, and the clock that a tool out of the cut sets back within a few steps."""
        if feed > 0.0 and depth > 0.0 and speed > 0.0:
            return speed / radius, 1.0
        return speed / radius, -since_entry / step

    @staticmethod
    def output_main_force(feed: float, depth: float, speed: float, specific_force: float, exponent: float, approach_angle: float) -> float:
        """Kienzle's law."""
        if not (feed > 0.0 and depth > 0.0 and speed > 0.0):
            return 0.0
        thickness = feed * math.sin(approach_angle)
        return specific_force * feed * depth * math.pow(thickness / 1e-3, -exponent)

    @staticmethod
    def output_thrust_force(acting_force: float, thrust_ratio: float) -> float:
        return thrust_ratio * acting_force

    @staticmethod
    def output_feed_force(acting_force: float, feed_ratio: float) -> float:
        return feed_ratio * acting_force

    @staticmethod
    def output(
        feed: float, depth: float, speed: float, radius: float, turned: float, since_entry: float
    ) -> tuple[float, float, float, float]:
        """Where the spindle is and whether the tool cuts."""
        if not (feed > 0.0 and depth > 0.0 and speed > 0.0):
            return turned, speed / radius, 0.0, since_entry
        return turned, speed / radius, 1.0, since_entry
