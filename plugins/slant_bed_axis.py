"""Kind 3 of the user-written parts: a model of the x axis. A cross slide on a slanted bed, which its own weight pulls down."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.hookspecs import hookimpl

GRAVITY = 9.80665
"""Standard gravity [m/s^2], CGPM 1901."""


class SlantBedAxis(Component):
    """Gives speed and position of a slide on an inclined bed:  tau dv/dt + v = K V - Kd (F + m g sin(slant)),  dx/dt = v.

    Positive motion leads up the slope. It takes the place of the x axis of a lathe. Without an integral in the controller the slide hangs
    lower by Kd m g sin(slant)/(K Kp).
    Source: J. Liu, R. G. Landers (2004), equation (9), with the weight as a disturbance; a bed of 45 degrees is usual on CNC lathes, mass
    and Kd are assumed. Left out: counterweight, dry friction.
    """

    ports = {"effort": "force", "flow": "velocity", "displacement": "position", "drive": "voltage"}

    voltage = Input("V", doc="voltage to the amplifier")
    force = Input("N", default=0.0, doc="force on the slide, positive against positive motion")

    gain = Parameter("m/(s*V)", 0.01878, low=0.0, doc="speed of the slide per volt")
    time_constant = Parameter("s", 0.0243, low=1e-4, doc="time constant of the speed")
    disturbance_gain = Parameter("m/(s*N)", 3e-6, low=0.0, doc="speed lost per newton")
    mass = Parameter("kg", 80.0, low=0.0, doc="mass of slide and turret")
    slant = Parameter("rad", 0.7853981633974483, low=0.0, high=1.5707963267948966, doc="angle of the bed from level")

    speed = State("m/s", doc="speed of the slide")
    travel = State("m", doc="position of the slide")

    position = Output("m", doc="actual position of the slide")
    velocity = Output("m/s", doc="actual speed of the slide")

    @staticmethod
    def derivative(
        speed: float,
        voltage: float,
        force: float,
        gain: float,
        time_constant: float,
        disturbance_gain: float,
        mass: float,
        slant: float,
    ) -> tuple[float, float]:
        """Lag and weight."""
        load = force + mass * GRAVITY * math.sin(slant)
        return (gain * voltage - disturbance_gain * load - speed) / time_constant, speed

    @staticmethod
    def output(travel: float, speed: float) -> tuple[float, float]:
        """The states as they are."""
        return travel, speed


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [SlantBedAxis]
