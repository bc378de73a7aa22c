"""A spindle as a measured first-order lag from voltage to speed."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State


class EmpiricalSpindle(Component):
    """Gives the speed of the spindle from the voltage of its amplifier:  tau dw/dt + w = K V - Kd T.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equation (4). Gain 249 rpm/V and time constant 0.21 s follow from the
    analytical set (assumed), Kd = Ks^2/D from the same. Left out: dry friction, saturation of the current.
    """

    group = "spindle"

    ports = {"effort": "torque", "flow": "speed", "displacement": "angle", "drive": "voltage"}

    voltage = Input("V", doc="voltage to the amplifier")
    torque = Input("N*m", default=0.0, doc="torque on the spindle, positive against positive rotation")

    gain = Parameter("rad/(s*V)", 26.09, low=0.0, doc="spindle speed per volt")
    time_constant = Parameter("s", 0.21, low=1e-6, doc="time constant of the speed")
    disturbance_gain = Parameter("rad/(s*N*m)", 1.0436, low=0.0, doc="speed lost per newton metre")

    rotation = State("rad/s", doc="spindle speed")
    turned = State("rad", doc="angle turned since the start")

    speed = Output("rad/s", doc="actual spindle speed")
    angle = Output("rad", doc="angle turned since the start")

    @staticmethod
    def derivative(
        rotation: float, voltage: float, torque: float, gain: float, time_constant: float, disturbance_gain: float
    ) -> tuple[float, float]:
        """Equation (4), solved for the acceleration."""
        return (gain * voltage - disturbance_gain * torque - rotation) / time_constant, rotation

    @staticmethod
    def output(rotation: float, turned: float) -> tuple[float, float]:
        """The states as they are."""
        return rotation, turned
