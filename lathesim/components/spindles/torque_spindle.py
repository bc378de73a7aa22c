"""A spindle turned by a torque."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State


class TorqueSpindle(Component):
    """Gives speed and angle of an inertia turned against viscous friction:  J dw/dt = T_drive - b w - T.

    Source: Newton's law; the defaults are the data sheet of the motor bench HSM150 (University bench, 2023): J 1.2e-4 kg m^2,
    b 7.03e-5 N m s. Left out: dry friction, elasticity, the drive's own dynamics.
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

    rotation = State("rad/s", doc="spindle speed")
    turned = State("rad", doc="angle turned")

    speed = Output("rad/s", doc="spindle speed")
    angle = Output("rad", doc="angle turned since the start")

    @staticmethod
    def derivative(rotation: float, torque: float, disturbance: float, inertia: float, viscous: float) -> tuple[float, float]:
        """Newton's law."""
        return (torque - viscous * rotation - disturbance) / inertia, rotation

    @staticmethod
    def output(rotation: float, turned: float) -> tuple[float, float]:
        """The states as they are."""
        return rotation, turned
