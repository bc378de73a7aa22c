"""A linear axis from its motor: amplifier with tachometer loop, DC motor, leadscrew, table."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.components.drives.motor_laws import dry_friction, motor_current


class AnalyticalAxis(Component):
    """Gives speed and position of a table, and current and torque of its motor, from the voltage of the amplifier.

        I = (Ka (V - Kmtach w) - Kv w)/R, kept between the current limits                                    (6)
        J dw/dt + B w = Kt I - Tf - Kl Tb - Kl p (Tfa + F),   dx/dt = v = Kl p w                               (7, 8)
        J = Jm + Kl^2 Jl + Kl^2 p^2 m,   B = Bm + Kl^2 Bl + Kl^2 p^2 Ba   (printed as Bl^2 p^2 Ba)

    Tf, Tb, Tfa are dry friction of motor, screw and table (Tfa is a force). Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004),
    equations (6) to (8); the values are assumed, consistent with the measured lag of its Example 1 (K = 18.3 mm/s/V, tau = 16 ms).
    Left out: motor inductance, elasticity, backlash, friction that depends on speed other than linearly. Amplifier and motor stand here
    and nowhere else, so that an effect on ``voltage`` acts on current, torque and motion alike. ``drive_force`` is what the motor brings to
    the table, (Kt I - B w)/(Kl p), before dry friction and disturbance.
    """

    group = "axes"

    ports = {
        "effort": "force",
        "flow": "velocity",
        "displacement": "position",
        "drive": "voltage",
        "inertia": "equivalent_mass",
        "resistance": "table_viscous",
        "back_emf": "back_emf",
        "current": "current",
        "applied": "drive_force",
    }

    voltage = Input("V", doc="voltage to the amplifier")
    force = Input("N", default=0.0, doc="force on the table, positive against positive motion")

    resistance = Parameter("ohm", 1.0, low=1e-3, doc="resistance of the armature")
    amplifier_gain = Parameter("1", 20.0, low=0.0, doc="gain of the amplifier")
    torque_constant = Parameter("N*m/A", 0.25, low=0.0, doc="motor torque per ampere")
    voltage_constant = Parameter("V*s/rad", 0.25, low=0.0, doc="motor voltage per speed")
    tachometer_gain = Parameter("V*s/rad", 0.03, low=0.0, doc="gain of the motor's tachometer in the velocity loop")
    largest_current = Parameter("A", 25.0, low=0.0, doc="upper limit of the current")
    smallest_current = Parameter("A", -25.0, high=0.0, doc="lower limit of the current")
    gear = Parameter("1", 1.0, low=1e-6, doc="screw turns per motor turn")
    lead = Parameter("m/rad", 7.957747154594767e-4, low=1e-9, doc="table travel per radian of the screw")
    motor_inertia = Parameter("kg*m^2", 2.2e-3, low=1e-12, doc="inertia of the motor")
    screw_inertia = Parameter("kg*m^2", 6e-4, low=0.0, doc="inertia of the screw")
    mass = Parameter("kg", 150.0, low=0.0, doc="moving mass of the table")
    motor_viscous = Parameter("N*m*s/rad", 1e-3, low=0.0, doc="viscous friction of the motor")
    screw_viscous = Parameter("N*m*s/rad", 1e-3, low=0.0, doc="viscous friction of the screw")
    table_viscous = Parameter("N*s/m", 200.0, low=0.0, doc="viscous friction of the table")
    motor_coulomb = Parameter("N*m", 0.0, low=0.0, doc="dry friction of the motor")
    screw_coulomb = Parameter("N*m", 0.0, low=0.0, doc="dry friction of the screw")
    table_coulomb = Parameter("N", 0.0, low=0.0, doc="dry friction of the table")

    motor_speed = State("rad/s", doc="angular speed of the motor")
    travel = State("m", doc="table position")

    position = Output("m", doc="actual position of the table")
    velocity = Output("m/s", doc="actual speed of the table")
    motor_velocity = Output("rad/s", doc="actual angular speed of the motor")
    equivalent_mass = Output("kg", doc="all inertia as a mass moving with the table, J/(Kl p)^2")
    current = Output("A", doc="current of the motor")
    torque = Output("N*m", doc="torque of the motor")
    power = Output("W", doc="mechanical power of the motor")
    drive_force = Output("N", doc="net force of the drive at the table, before dry friction and disturbance")
    back_emf = Output("V*s/m", doc="voltage to the amplifier that a speed of the table takes up")

    @staticmethod
    def derivative(
        motor_speed: float,
        voltage: float,
        force: float,
        resistance: float,
        amplifier_gain: float,
        torque_constant: float,
        voltage_constant: float,
        tachometer_gain: float,
        largest_current: float,
        smallest_current: float,
        gear: float,
        lead: float,
        motor_inertia: float,
        screw_inertia: float,
        mass: float,
        motor_viscous: float,
        screw_viscous: float,
        table_viscous: float,
        motor_coulomb: float,
        screw_coulomb: float,
        table_coulomb: float,
        step: float,
    ) -> tuple[float, float]:
        """Equations (6) to (8), reduced to the motor's shaft."""
        ratio = gear * lead
        inertia = motor_inertia + gear * gear * screw_inertia + ratio * ratio * mass
        viscous = motor_viscous + gear * gear * screw_viscous + ratio * ratio * table_viscous
        current = motor_current(
            voltage, motor_speed, resistance, amplifier_gain, voltage_constant, tachometer_gain, largest_current, smallest_current
        )
        applied = torque_constant * current - viscous * motor_speed - ratio * force
        level = motor_coulomb + gear * screw_coulomb + ratio * table_coulomb
        friction = dry_friction(applied, motor_speed, level, inertia, step)
        return (applied - friction) / inertia, ratio * motor_speed

    @staticmethod
    def output(
        travel: float, motor_speed: float, gear: float, lead: float, motor_inertia: float, screw_inertia: float, mass: float
    ) -> tuple[float, float, float, float]:
        """Position, equation (8), and what the drive weighs at the table."""
        ratio = gear * lead
        inertia = motor_inertia + gear * gear * screw_inertia + ratio * ratio * mass
        return travel, ratio * motor_speed, motor_speed, inertia / (ratio * ratio)

    @staticmethod
    def output_current(
        voltage: float,
        motor_speed: float,
        resistance: float,
        amplifier_gain: float,
        voltage_constant: float,
        tachometer_gain: float,
        largest_current: float,
        smallest_current: float,
    ) -> float:
        """Equation of the current."""
        return motor_current(
            voltage, motor_speed, resistance, amplifier_gain, voltage_constant, tachometer_gain, largest_current, smallest_current
        )

    @staticmethod
    def output_torque(
        voltage: float,
        motor_speed: float,
        resistance: float,
        amplifier_gain: float,
        voltage_constant: float,
        tachometer_gain: float,
        largest_current: float,
        smallest_current: float,
        torque_constant: float,
    ) -> float:
        """What the current gives."""
        return torque_constant * motor_current(
            voltage, motor_speed, resistance, amplifier_gain, voltage_constant, tachometer_gain, largest_current, smallest_current
        )

    @staticmethod
    def output_power(
        voltage: float,
        motor_speed: float,
        resistance: float,
        amplifier_gain: float,
        voltage_constant: float,
        tachometer_gain: float,
        largest_current: float,
        smallest_current: float,
        torque_constant: float,
    ) -> float:
        """Torque times speed."""
        torque = torque_constant * motor_current(
            voltage, motor_speed, resistance, amplifier_gain, voltage_constant, tachometer_gain, largest_current, smallest_current
        )
        return torque * motor_speed

    @staticmethod
    def output_drive_force(
        voltage: float,
        motor_speed: float,
        resistance: float,
        amplifier_gain: float,
        voltage_constant: float,
        tachometer_gain: float,
        largest_current: float,
        smallest_current: float,
        torque_constant: float,
        gear: float,
        lead: float,
        motor_viscous: float,
        screw_viscous: float,
        table_viscous: float,
    ) -> float:
        """The driving part of the equation of motion."""
        current = motor_current(
            voltage, motor_speed, resistance, amplifier_gain, voltage_constant, tachometer_gain, largest_current, smallest_current
        )
        ratio = gear * lead
        viscous = motor_viscous + gear * gear * screw_viscous + ratio * ratio * table_viscous
        return (torque_constant * current - viscous * motor_speed) / ratio

    @staticmethod
    def output_back_emf(amplifier_gain: float, voltage_constant: float, tachometer_gain: float, gear: float, lead: float) -> float:
        """Both loops of the speed; without an amplifier there is none."""
        return (tachometer_gain + voltage_constant / amplifier_gain) / (gear * lead) if amplifier_gain > 0.0 else 0.0
