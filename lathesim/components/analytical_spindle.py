"""A spindle from its motor: amplifier with tachometer loop, DC motor, gear, spindle."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.components.analytical_axis import dry_friction


class AnalyticalSpindle(Component):
    """Gives the speed of the spindle from the voltage of its amplifier, through current, torque and friction.

        I = (Ka (V - Kmtach w_m) - Kv w_m)/R, kept between the current limits                                (1)
        (Jm + Ks^2 Js) dw_m/dt + (Bm + Ks^2 Bs) w_m = Kt I - Tf - Ks (Tfs + Td)                                (2)
        w = Ks w_m                                                                                             (3)

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (1) to (3); the values are assumed (249 rpm/V, 0.21 s).
    Left out: inductance, belt and gear elasticity. SpindleDrive gives the current.
    """

    group = "spindle"

    ports = {
        "effort": "torque",
        "flow": "speed",
        "displacement": "angle",
        "drive": "voltage",
        "inertia": "equivalent_inertia",
        "applied": "drive_torque",
    }

    voltage = Input("V", doc="voltage to the amplifier")
    torque = Input("N*m", default=0.0, doc="torque on the spindle, positive against positive rotation")
    drive_torque = Input("N*m", default=float("nan"), doc="net torque of the drive, from SpindleDrive; only passed on to effects")

    resistance = Parameter("ohm", 0.4, low=1e-3, doc="resistance of the armature")
    amplifier_gain = Parameter("1", 20.0, low=0.0, doc="gain of the amplifier")
    torque_constant = Parameter("N*m/A", 0.5, low=0.0, doc="motor torque per ampere")
    voltage_constant = Parameter("V*s/rad", 0.5, low=0.0, doc="motor voltage per speed")
    tachometer_gain = Parameter("V*s/rad", 0.0122, low=0.0, doc="gain of the motor's tachometer in the velocity loop")
    largest_current = Parameter("A", 200.0, low=0.0, doc="upper limit of the current")
    smallest_current = Parameter("A", -200.0, high=0.0, doc="lower limit of the current")
    gear = Parameter("1", 1.0, low=1e-6, doc="spindle turns per motor turn")
    motor_inertia = Parameter("kg*m^2", 0.05, low=1e-9, doc="inertia of the motor")
    spindle_inertia = Parameter("kg*m^2", 0.15, low=0.0, doc="inertia of spindle, chuck and part")
    motor_viscous = Parameter("N*m*s/rad", 0.01, low=0.0, doc="viscous friction of the motor")
    spindle_viscous = Parameter("N*m*s/rad", 0.02, low=0.0, doc="viscous friction of the spindle")
    motor_coulomb = Parameter("N*m", 0.0, low=0.0, doc="dry friction of the motor")
    spindle_coulomb = Parameter("N*m", 0.0, low=0.0, doc="dry friction of the spindle")

    rotation = State("rad/s", doc="motor speed")
    turned = State("rad", doc="angle the spindle has turned since the start")

    speed = Output("rad/s", doc="actual spindle speed")
    angle = Output("rad", doc="angle turned since the start")
    motor_velocity = Output("rad/s", doc="actual motor speed")
    equivalent_inertia = Output("kg*m^2", doc="all inertia as seen at the spindle")

    @staticmethod
    def derivative(
        rotation: float,
        voltage: float,
        torque: float,
        resistance: float,
        amplifier_gain: float,
        torque_constant: float,
        voltage_constant: float,
        tachometer_gain: float,
        largest_current: float,
        smallest_current: float,
        gear: float,
        motor_inertia: float,
        spindle_inertia: float,
        motor_viscous: float,
        spindle_viscous: float,
        motor_coulomb: float,
        spindle_coulomb: float,
        step: float,
    ) -> tuple[float, float]:
        """Equations (1) to (3)."""
        inertia = motor_inertia + gear * gear * spindle_inertia
        viscous = motor_viscous + gear * gear * spindle_viscous
        current = (amplifier_gain * (voltage - tachometer_gain * rotation) - voltage_constant * rotation) / resistance
        if current > largest_current:
            current = largest_current
        if current < smallest_current:
            current = smallest_current
        applied = torque_constant * current - viscous * rotation - gear * torque
        friction = dry_friction(applied, rotation, motor_coulomb + gear * spindle_coulomb, inertia, step)
        return (applied - friction) / inertia, gear * rotation

    @staticmethod
    def output(
        rotation: float, turned: float, gear: float, motor_inertia: float, spindle_inertia: float
    ) -> tuple[float, float, float, float]:
        """Equation (3), and what the drive weighs at the spindle."""
        return gear * rotation, turned, rotation, motor_inertia / (gear * gear) + spindle_inertia
