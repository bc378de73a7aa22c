"""A linear axis from its motor: amplifier with tachometer loop, DC motor, leadscrew, table."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State


def dry_friction(applied: float, speed: float, level: float, inertia: float, step: float) -> float:
    """Give the Coulomb friction that acts against ``speed``, in the unit of ``level``.

    The friction that would bring the motion to rest within one integration step, ``applied + inertia speed/step``, but never more than
    ``level``. Sliding: exactly ``level`` against the motion. Standing and pushed by less than ``level``: exactly the push, so the body
    rests without creeping. Between them a line, as wide as one step can decide, so that RK4 does not chatter as it does with sign().
    """
    wanted = applied + inertia * speed / step
    if wanted > level:
        return level
    if wanted < -level:
        return -level
    return wanted


class AnalyticalAxis(Component):
    """Gives speed and position of a table from the voltage of its amplifier, through current, torque and friction.

        I = (Ka (V - Kmtach w) - Kv w)/R, kept between the current limits                                    (6)
        J dw/dt + B w = Kt I - Tf - Kl Tb - Kl p (Tfa + F),   dx/dt = v = Kl p w                               (7, 8)
        J = Jm + Kl^2 Jl + Kl^2 p^2 m,   B = Bm + Kl^2 Bl + Kl^2 p^2 Ba   (printed as Bl^2 p^2 Ba)

    Tf, Tb, Tfa are dry friction of motor, screw and table (Tfa is a force). Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004),
    equations (6) to (8); the values are assumed, consistent with the measured lag of its Example 1 (K = 18.3 mm/s/V, tau = 16 ms).
    Left out: motor inductance, elasticity, backlash, friction that depends on speed other than linearly. The current is not an output
    here, as it follows the voltage at once and would close a loop through the controller: AxisDrive beside it gives current and force.
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
    drive_force = Input("N", default=float("nan"), doc="net force of the drive, from AxisDrive; only passed on to effects")

    resistance = Parameter("ohm", 1.0, low=1e-3, doc="resistance of the armature")
    amplifier_gain = Parameter("1", 20.0, low=0.0, doc="gain of the amplifier")
    torque_constant = Parameter("N*m/A", 0.25, low=0.0, doc="motor torque per ampere")
    voltage_constant = Parameter("V*s/rad", 0.25, low=0.0, doc="motor voltage per speed")
    tachometer_gain = Parameter("V*s/rad", 0.03, low=0.0, doc="gain of the motor's tachometer in the velocity loop")
    largest_current = Parameter("A", 25.0, low=0.0, doc="upper limit of the current")
    smallest_current = Parameter("A", -25.0, high=0.0, doc="lower limit of the current")
    gear = Parameter("1", 1.0, low=1e-6, doc="screw turns per motor turn")
    lead = Parameter("m/rad", 7.957747154594767e-4, low=1e-9, doc="table travel per radian of the screw")
    motor_inertia = Parameter("kg*m^2", 2.2e-3, low=1e-9, doc="inertia of the motor")
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
        current = (amplifier_gain * (voltage - tachometer_gain * motor_speed) - voltage_constant * motor_speed) / resistance
        if current > largest_current:
            current = largest_current
        if current < smallest_current:
            current = smallest_current
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
