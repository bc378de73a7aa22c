"""What the amplifier drives through the motor of the spindle: current, torque, power."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter


class SpindleDrive(Component):
    """Gives the current of an AnalyticalSpindle, and the net torque its drive brings to the spindle before any disturbance.

        I = (Ka (V - Kmtach w_m) - Kv w_m)/R, within its limits;   T = (Kt I - (Bm + Ks^2 Bs) w_m)/Ks

    It stands beside the spindle: wire its parameters from those of the spindle, so that both always agree, and ``net_torque`` to the
    spindle's ``drive_torque``. Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (1), (2). Left out: inductance.
    """

    group = "spindle"

    ports = {"drive": "voltage", "applied": "net_torque"}

    voltage = Input("V", doc="voltage to the amplifier")
    motor_speed = Input("rad/s", doc="angular speed of the motor")

    resistance = Parameter("ohm", 0.4, low=1e-3, doc="resistance of the armature")
    amplifier_gain = Parameter("1", 20.0, low=0.0, doc="gain of the amplifier")
    torque_constant = Parameter("N*m/A", 0.5, low=0.0, doc="motor torque per ampere")
    voltage_constant = Parameter("V*s/rad", 0.5, low=0.0, doc="motor voltage per speed")
    tachometer_gain = Parameter("V*s/rad", 0.0122, low=0.0, doc="gain of the motor's tachometer in the velocity loop")
    largest_current = Parameter("A", 200.0, low=0.0, doc="upper limit of the current")
    smallest_current = Parameter("A", -200.0, high=0.0, doc="lower limit of the current")
    gear = Parameter("1", 1.0, low=1e-6, doc="spindle turns per motor turn")
    motor_viscous = Parameter("N*m*s/rad", 0.01, low=0.0, doc="viscous friction of the motor")
    spindle_viscous = Parameter("N*m*s/rad", 0.02, low=0.0, doc="viscous friction of the spindle")

    current = Output("A", doc="current of the motor")
    torque = Output("N*m", doc="torque of the motor")
    net_torque = Output("N*m", doc="net torque of the drive at the spindle, before friction and disturbance")
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
        motor_viscous: float,
        spindle_viscous: float,
    ) -> tuple[float, float, float, float]:
        """Equation (1) and the driving part of (2)."""
        viscous = motor_viscous + gear * gear * spindle_viscous
        current = (amplifier_gain * (voltage - tachometer_gain * motor_speed) - voltage_constant * motor_speed) / resistance
        if current > largest_current:
            current = largest_current
        if current < smallest_current:
            current = smallest_current
        torque = torque_constant * current
        return current, torque, (torque - viscous * motor_speed) / gear, torque * motor_speed
