"""A spindle turned by a torque."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output, Parameter, State


class TorqueSpindle(Component):
    """Gives speed and angle of an inertia turned against viscous friction and gravity:  J dw/dt = T_drive - b w - G sin(a - a0) - T.

    G is the weight of the rotating body times the distance of its centre of gravity from the shaft, as for an arm or a part clamped off
    centre; a0 is the angle at which it hangs at rest. Source: Newton's law; L. Meirovitch, Fundamentals of Vibrations (2001), section 1.9
    (pendulum). The defaults are the data sheet of the motor bench HSM150 (University bench, 2023): J 1.2e-4 kg m^2, b 7.03e-5 N m s, and
    a shaft in balance. Left out: dry friction, elasticity, the drive's own dynamics.
    """

    group = "spindle"

    ports = {
        "effort": "disturbance",
        "flow": "speed",
        "displacement": "angle",
        "drive": "torque",
        "applied": "torque",
        "inertia": "inertia",
        "resistance": "viscous",
    }

    torque = Input("N*m", doc="torque of the drive on the spindle")
    disturbance = Input("N*m", default=0.0, doc="torque on the spindle, positive against positive rotation")

    inertia = Parameter("kg*m^2", 1.2e-4, low=1e-12, doc="inertia of all that turns")
    viscous = Parameter("N*m*s/rad", 7.03e-5, low=0.0, doc="viscous friction")
    gravity = Parameter("N*m", 0.0, low=0.0, doc="torque of gravity on a horizontal arm: weight times distance from the shaft")
    lowest = Parameter("rad", 0.0, doc="angle at which it hangs at rest")

    rotation = State("rad/s", doc="spindle speed")
    turned = State("rad", doc="angle turned")

    speed = Output("rad/s", doc="spindle speed")
    angle = Output("rad", doc="angle turned since the start")

    @staticmethod
    def derivative(
        rotation: float, turned: float, torque: float, disturbance: float, inertia: float, viscous: float, gravity: float, lowest: float
    ) -> tuple[float, float]:
        """Newton's law; zero gravity adds nothing, not even rounding."""
        pull = gravity * math.sin(turned - lowest) if gravity > 0.0 else 0.0
        return (torque - viscous * rotation - disturbance - pull) / inertia, rotation

    @staticmethod
    def output(rotation: float, turned: float) -> tuple[float, float]:
        """The states as they are."""
        return rotation, turned
