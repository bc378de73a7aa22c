"""A linear axis as a measured first-order lag from voltage to speed."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State


class EmpiricalAxis(Component):
    """Gives speed and position of a table from the voltage of its amplifier:  tau dv/dt + v = K V - Kd F,  dx/dt = v.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equation (9); gain and time constant fitted to its Table 1.
    Left out: Coulomb friction, saturation of the current, backlash, elasticity. With ``disturbance_gain`` 0 no force moves the table;
    a drive whose motor is known has Kd = (Kl p)^2/D, see AnalyticalAxis.

    Written as a mass m that a drive pushes, the equation is  m dv/dt = (K V - v)/Kd - F  with m = tau/Kd: ``equivalent_mass`` and
    ``drive_force`` are these two, so that dry friction holds the table exactly. Without a disturbance gain both are zero.
    """

    group = "axes"

    ports = {
        "effort": "force",
        "flow": "velocity",
        "displacement": "position",
        "drive": "voltage",
        "inertia": "equivalent_mass",
        "applied": "drive_force",
    }

    voltage = Input("V", doc="voltage to the amplifier")
    force = Input("N", default=0.0, doc="force on the table, positive against positive motion")

    gain = Parameter("m/(s*V)", 0.01878, low=0.0, doc="table speed per volt")
    time_constant = Parameter("s", 0.0243, low=1e-6, doc="time constant of the speed")
    disturbance_gain = Parameter("m/(s*N)", 0.0, low=0.0, doc="speed lost per newton")

    speed = State("m/s", doc="table speed")
    travel = State("m", doc="table position")

    position = Output("m", doc="actual position of the table")
    velocity = Output("m/s", doc="actual speed of the table")
    equivalent_mass = Output("kg", doc="what the drive weighs at the table, tau/Kd")
    drive_force = Output("N", doc="net force of the drive at the table, before friction and disturbance")

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

    @staticmethod
    def output_equivalent_mass(time_constant: float, disturbance_gain: float) -> float:
        """The time constant as a mass."""
        return time_constant / disturbance_gain if disturbance_gain > 0.0 else 0.0

    @staticmethod
    def output_drive_force(voltage: float, speed: float, gain: float, disturbance_gain: float) -> float:
        """Equation (9) as a force."""
        return (gain * voltage - speed) / disturbance_gain if disturbance_gain > 0.0 else 0.0
