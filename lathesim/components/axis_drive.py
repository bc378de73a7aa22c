"""What the amplifier drives through the motor of an axis: current, torque, net force at the table."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter


class AxisDrive(Component):
    """Gives the current of an AnalyticalAxis, and the net force its drive brings to the table before any disturbance.

        I = (Ka (V - Kmtach w) - Kv w)/R, within its limits;   F = (Kt I - B w)/(Kl p),  B = Bm + Kl^2 Bl + Kl^2 p^2 Ba

    It stands beside the axis: wire its parameters from those of the axis, so that both always agree, and ``force`` to the axis'
    ``drive_force``. Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (6) and (7). Left out: inductance.
    """

    group = "axes"

    ports = {"drive": "voltage", "applied": "force"}

    voltage = Input("V", doc="voltage to the amplifier")
    motor_speed = Input("rad/s", doc="angular speed of the motor")

    resistance = Parameter("ohm", 1.0, low=1e-3, doc="resistance of the armature")
    amplifier_gain = Parameter("1", 20.0, low=0.0, doc="gain of the amplifier")
    torque_constant = Parameter("N*m/A", 0.25, low=0.0, doc="motor torque per ampere")
    voltage_constant = Parameter("V*s/rad", 0.25, low=0.0, doc="motor voltage per speed")
    tachometer_gain = Parameter("V*s/rad", 0.03, low=0.0, doc="gain of the motor's tachometer in the velocity loop")
    largest_current = Parameter("A", 25.0, low=0.0, doc="upper limit of the current")
    smallest_current = Parameter("A", -25.0, high=0.0, doc="lower limit of the current")
    gear = Parameter("1", 1.0, low=1e-6, doc="screw turns per motor turn")
    lead = Parameter("m/rad", 7.957747154594767e-4, low=1e-9, doc="table travel per radian of the screw")
    motor_viscous = Parameter("N*m*s/rad", 1e-3, low=0.0, doc="viscous friction of the motor")
    screw_viscous = Parameter("N*m*s/rad", 1e-3, low=0.0, doc="viscous friction of the screw")
    table_viscous = Parameter("N*s/m", 200.0, low=0.0, doc="viscous friction of the table")

    current = Output("A", doc="current of the motor")
    torque = Output("N*m", doc="torque of the motor")
    force = Output("N", doc="net force of the drive at the table, before friction and disturbance")
    power = Output("W", doc="mechanical power of the motor")

    @staticmethod
    def output(
        voltage: float,
        motor_speed: float,
        resistance: float,
        amplifier_gain: float,
        torque_constant: float,
        voltage_constant: float,
        tachometer_gain: float,
        largest_current: float,
        smallest_current: float,
        gear: float,
        lead: float,
        motor_viscous: float,
        screw_viscous: float,
        table_viscous: float,
    ) -> tuple[float, float, float, float]:
        """Equation (6) and the driving part of (7)."""
        ratio = gear * lead
        viscous = motor_viscous + gear * gear * screw_viscous + ratio * ratio * table_viscous
        current = (amplifier_gain * (voltage - tachometer_gain * motor_speed) - voltage_constant * motor_speed) / resistance
        if current > largest_current:
            current = largest_current
        if current < smallest_current:
            current = smallest_current
        torque = torque_constant * current
        return current, torque, (torque - viscous * motor_speed) / ratio, torque * motor_speed
