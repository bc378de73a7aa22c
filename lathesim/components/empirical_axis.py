"""A linear axis as a measured first-order lag from voltage to speed."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State


class EmpiricalAxis(Component):
    """Gives speed and position of a table from the voltage of its amplifier:  tau dv/dt + v = K V - Kd F,  dx/dt = v.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equation (9); gain and time constant fitted to its Table 1.
    Left out: Coulomb friction, saturation of the current, backlash, elasticity. With ``disturbance_gain`` 0 no force moves the table;
    a drive whose motor is known has Kd = (Kl p)^2/D, see AnalyticalAxis.
    """

    group = "axes"

    ports = {"effort": "force", "flow": "velocity", "displacement": "position", "drive": "voltage"}

    voltage = Input("V", doc="voltage to the amplifier")
    force = Input("N", default=0.0, doc="force on the table, positive against positive motion")

    gain = Parameter("m/(s*V)", 0.01878, low=0.0, doc="table speed per volt")
    time_constant = Parameter("s", 0.0243, low=1e-6, doc="time constant of the speed")
    disturbance_gain = Parameter("m/(s*N)", 0.0, low=0.0, doc="speed lost per newton")

    speed = State("m/s", doc="table speed")
    travel = State("m", doc="table position")

    position = Output("m", doc="actual position of the table")
    velocity = Output("m/s", doc="actual speed of the table")

    @staticmethod
    def derivative(
        speed: float, voltage: float, force: float, gain: float, time_constant: float, disturbance_gain: float
    ) -> tuple[float, float]:
        """Equation (9), solved for the acceleration."""
        return (gain * voltage - disturbance_gain * force - speed) / time_constant, speed

    @staticmethod
    def output(travel: float, speed: float) -> tuple[float, float]:
        """The states as they are."""
        return travel, speed
