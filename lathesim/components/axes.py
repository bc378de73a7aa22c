"""Feed axes and rotary tables: a command in, a position out."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.components.drives import at_the_motor, dry_friction, motor_current


class TableMotion:
    """Position and speed of a table as its states."""

    speed = State("m/s", doc="table speed")
    travel = State("m", doc="table position")

    position = Output("m", doc="actual position of the table")
    velocity = Output("m/s", doc="actual speed of the table")

    @staticmethod
    def output(travel: float, speed: float) -> tuple[float, float]:
        return travel, speed


class EmpiricalAxis(TableMotion, Component):
    """Gives speed and position of a table from the voltage of its amplifier:  tau dv/dt + v = K V - Kd F,  dx/dt = v.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equation (9); gain and time constant fitted to its Table 1.
    Left out: Coulomb friction, saturation of the current, backlash, elasticity. With ``disturbance_gain`` 0 no force moves the table;
    a drive whose motor is known has Kd = (Kl p)^2/D, see AnalyticalAxis.

    Written as a mass m that a drive pushes, the equation is  m dv/dt = (K V - v)/Kd - F  with m = tau/Kd: ``equivalent_mass`` and
    ``drive_force`` are these two, so that dry friction holds the table exactly. Without a disturbance gain both are zero.
    """

    group = "axes"

    ports = {
        "effort": "force", "flow": "velocity", "displacement": "position", "drive": "voltage", "inertia": "equivalent_mass",
        "applied": "drive_force",
    }  # fmt: skip

    voltage = Input("V", doc="voltage to the amplifier")
    force = Input("N", default=0.0, doc="force on the table, positive against positive motion")

    gain = Parameter("m/(s*V)", 0.01878, low=0.0, doc="table speed per volt")
    time_constant = Parameter("s", 0.0243, low=1e-6, doc="time constant of the speed")
    disturbance_gain = Parameter("m/(s*N)", 0.0, low=0.0, doc="speed lost per newton")

    equivalent_mass = Output("kg", doc="what the drive weighs at the table, tau/Kd")
    drive_force = Output("N", doc="net force of the drive at the table, before friction and disturbance")

    @staticmethod
    def derivative(
        speed: float, voltage: float, force: float, gain: float, time_constant: float, disturbance_gain: float
    ) -> tuple[float, float]:
        """Equation (9), solved for the acceleration."""
        return (gain * voltage - disturbance_gain * force - speed) / time_constant, speed

    @staticmethod
    def output_equivalent_mass(time_constant: float, disturbance_gain: float) -> float:
        """The time constant as a mass."""
        return time_constant / disturbance_gain if disturbance_gain > 0.0 else 0.0

    @staticmethod
    def output_drive_force(voltage: float, speed: float, gain: float, disturbance_gain: float) -> float:
        """Equation (9) as a force."""
        return (gain * voltage - speed) / disturbance_gain if disturbance_gain > 0.0 else 0.0


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
        "effort": "force", "flow": "velocity", "displacement": "position", "drive": "voltage", "inertia": "equivalent_mass",
        "resistance": "table_viscous", "back_emf": "back_emf", "current": "current", "applied": "drive_force",
        "dry_friction": "table_coulomb",
    }  # fmt: skip

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

    output_current = staticmethod(motor_current)

    @staticmethod
    def derivative(
        motor_speed: float, torque: float, force: float, gear: float, lead: float, motor_inertia: float, screw_inertia: float, mass: float,
        motor_viscous: float, screw_viscous: float, table_viscous: float, motor_coulomb: float, screw_coulomb: float,
        table_coulomb: float, step: float,
    ) -> tuple[float, float]:  # fmt: skip
        """Equations (7) and (8), reduced to the motor's shaft."""
        ratio = gear * lead
        inertia = at_the_motor(at_the_motor(motor_inertia, gear, screw_inertia), ratio, mass)
        viscous = at_the_motor(at_the_motor(motor_viscous, gear, screw_viscous), ratio, table_viscous)
        applied = torque - viscous * motor_speed - ratio * force
        level = motor_coulomb + gear * screw_coulomb + ratio * table_coulomb
        return (applied - dry_friction(applied, motor_speed, level, inertia, step)) / inertia, ratio * motor_speed

    @staticmethod
    def output(travel: float, motor_speed: float, gear: float, lead: float) -> tuple[float, float, float]:
        """Position, equation (8), and the state as it is."""
        return travel, gear * lead * motor_speed, motor_speed

    @staticmethod
    def output_equivalent_mass(gear: float, lead: float, motor_inertia: float, screw_inertia: float, mass: float) -> float:
        ratio = gear * lead
        return at_the_motor(at_the_motor(motor_inertia, gear, screw_inertia), ratio, mass) / (ratio * ratio)

    @staticmethod
    def output_torque(current: float, torque_constant: float) -> float:
        return torque_constant * current

    @staticmethod
    def output_power(torque: float, motor_velocity: float) -> float:
        return torque * motor_velocity

    @staticmethod
    def output_drive_force(
        torque: float, motor_velocity: float, gear: float, lead: float, motor_viscous: float, screw_viscous: float, table_viscous: float
    ) -> float:
        """The driving part of the equation of motion."""
        ratio = gear * lead
        viscous = at_the_motor(at_the_motor(motor_viscous, gear, screw_viscous), ratio, table_viscous)
        return (torque - viscous * motor_velocity) / ratio

    @staticmethod
    def output_back_emf(amplifier_gain: float, voltage_constant: float, tachometer_gain: float, gear: float, lead: float) -> float:
        """Both loops of the speed; without an amplifier there is none."""
        return (tachometer_gain + voltage_constant / amplifier_gain) / (gear * lead) if amplifier_gain > 0.0 else 0.0


class ForceAxis(TableMotion, Component):
    """Gives speed and position of a mass pushed against viscous friction:  m dv/dt = F_drive - b v - F.

    Source: Y. Koren, Computer Control of Manufacturing Systems, McGraw-Hill (1983), chapter 4 (load of a feed drive); mass and friction
    are assumed, of the size of a small lathe's cross slide. Left out: dry friction, elasticity, the drive's own dynamics.
    """

    group = "axes"

    ports = {
        "effort": "disturbance", "flow": "velocity", "displacement": "position", "drive": "force", "applied": "force", "inertia": "mass",
        "resistance": "viscous",
    }  # fmt: skip

    force = Input("N", doc="force of the drive on the table")
    disturbance = Input("N", default=0.0, doc="force on the table, positive against positive motion")

    mass = Parameter("kg", 95.0, low=1e-9, doc="moving mass")
    viscous = Parameter("N*s/m", 200.0, low=0.0, doc="viscous friction")

    @staticmethod
    def derivative(speed: float, force: float, disturbance: float, mass: float, viscous: float) -> tuple[float, float]:
        return (force - viscous * speed - disturbance) / mass, speed


_WITHOUT_BOUND = 1e12


class LedMotion:
    """The laws of a table that is led, along a line as about an axis."""

    @staticmethod
    def output_velocity(reference_velocity: float) -> float:
        return reference_velocity

    @staticmethod
    def output_inertia() -> float:
        return _WITHOUT_BOUND


class LedAxis(LedMotion, Component):
    """Gives position and motor current of a table that follows its reference at once:  x = x_ref,  i = (m a + b v + F) / K.

    It turns the equation of motion round, for logs that are too slow to integrate (a servo settles within one of their samples): velocity
    and acceleration are given, the current follows. Source: Y. Koren, Computer Control of Manufacturing Systems, McGraw-Hill (1983),
    chapter 4 (load of a feed drive); mass and friction are assumed. Left out: the lag of the servo, dry friction, elasticity.
    """

    group = "axes"

    ports = {
        "effort": "disturbance", "flow": "velocity", "displacement": "position", "reference": "reference",
        "reference_rate": "reference_velocity", "reference_acceleration": "acceleration", "inertia": "inertia", "current": "current",
    }  # fmt: skip

    reference = Input("m", doc="commanded position")
    reference_velocity = Input("m/s", doc="commanded velocity")
    acceleration = Input("m/s^2", default=0.0, doc="commanded acceleration")
    disturbance = Input("N", default=0.0, doc="force on the table, positive against positive motion")

    mass = Parameter("kg", 95.0, low=0.0, doc="moving mass")
    viscous = Parameter("N*s/m", 200.0, low=0.0, doc="viscous friction")
    force_constant = Parameter("N/A", 35.0, low=1e-9, doc="force per current")

    position = Output("m", doc="position of the table")
    velocity = Output("m/s", doc="velocity of the table")
    current = Output("A", doc="current of the motor")
    inertia = Output("kg", doc="inertia that a force meets: without bound, as no force changes a motion that is given")

    @staticmethod
    def output_position(reference: float) -> float:
        return reference

    @staticmethod
    def output_current(
        reference_velocity: float, acceleration: float, disturbance: float, mass: float, viscous: float, force_constant: float
    ) -> float:
        """The equation of motion, solved for the drive."""
        return (mass * acceleration + viscous * reference_velocity + disturbance) / force_constant


class LedRotaryTable(LedMotion, Component):
    """Gives angle and motor current of a table that follows its reference without lag:  a = a_ref,  i = (J da^2/dt^2 + b da/dt + T) / K.

    The rotary counterpart of :class:`LedAxis`, for logs that are too slow to integrate: angular velocity and acceleration are inputs, the
    current follows. Source: Y. Koren, Computer Control of Manufacturing Systems, McGraw-Hill (1983), chapter 4 (load of a feed drive);
    inertia and friction are assumed. Left out: the lag of the servo, dry friction, elasticity, gravity.
    """

    group = "axes"

    ports = {
        "effort": "disturbance", "flow": "velocity", "displacement": "angle", "reference": "reference",
        "reference_rate": "reference_velocity", "reference_acceleration": "acceleration", "inertia": "inertia", "current": "current",
    }  # fmt: skip

    reference = Input("rad", doc="commanded angle")
    reference_velocity = Input("rad/s", doc="commanded angular velocity")
    acceleration = Input("rad/s^2", default=0.0, doc="commanded angular acceleration")
    disturbance = Input("N*m", default=0.0, doc="torque on the table, positive against positive motion")

    turned_inertia = Parameter("kg*m^2", 0.5, low=0.0, doc="inertia of all rotating parts, referred to the table")
    viscous = Parameter("N*m*s/rad", 2.0, low=0.0, doc="viscous friction")
    torque_constant = Parameter("N*m/A", 10.0, low=1e-12, doc="torque at the table per current")

    angle = Output("rad", doc="angle of the table")
    velocity = Output("rad/s", doc="angular velocity of the table")
    current = Output("A", doc="current of the motor")
    inertia = Output("kg*m^2", doc="inertia against a torque: without bound, because no torque changes a prescribed motion")

    @staticmethod
    def output_angle(reference: float) -> float:
        return reference

    @staticmethod
    def output_current(
        reference_velocity: float, acceleration: float, disturbance: float, turned_inertia: float, viscous: float, torque_constant: float
    ) -> float:
        """The equation of motion, solved for the drive."""
        return (turned_inertia * acceleration + viscous * reference_velocity + disturbance) / torque_constant
