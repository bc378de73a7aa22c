"""Spindles: a command in, a speed and an angle out."""

from __future__ import annotations

import math

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.components.drives import at_the_motor, dry_friction, motor_current


class EmpiricalSpindle(Component):
    """Gives the speed of the spindle from the voltage of its amplifier:  tau dw/dt + w = K V - Kd T.

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equation (4). Gain 249 rpm/V and time constant 0.21 s follow from the
    analytical set (assumed), Kd = Ks^2/D from the same. Left out: dry friction, saturation of the current.
    """

    group = "spindle"

    ports = {"effort": "torque", "flow": "speed", "spindle_speed": "speed", "displacement": "angle", "drive": "voltage"}

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
        return rotation, turned


class AnalyticalSpindle(Component):
    """Gives the speed of the spindle, and current and torque of its motor, from the voltage of the amplifier.

        I = (Ka (V - Kmtach w_m) - Kv w_m)/R, kept between the current limits                                (1)
        (Jm + Ks^2 Js) dw_m/dt + (Bm + Ks^2 Bs) w_m = Kt I - Tf - Ks (Tfs + Td)                                (2)
        w = Ks w_m                                                                                             (3)

    Source: J. Liu, R. G. Landers, Int. J. Eng. Educ. 20 (2004), equations (1) to (3); the values are assumed (249 rpm/V, 0.21 s).
    Left out: inductance, belt and gear elasticity. Amplifier and motor stand here and nowhere else; ``drive_torque`` is what the motor
    brings to the spindle, (Kt I - (Bm + Ks^2 Bs) w_m)/Ks, before dry friction and load.
    """

    group = "spindle"

    ports = {
        "effort": "torque", "flow": "speed", "spindle_speed": "speed", "displacement": "angle", "drive": "voltage",
        "inertia": "equivalent_inertia", "resistance": "spindle_viscous", "back_emf": "back_emf", "current": "current",
        "applied": "drive_torque", "dry_friction": "spindle_coulomb",
    }  # fmt: skip

    voltage = Input("V", doc="voltage to the amplifier")
    torque = Input("N*m", default=0.0, doc="torque on the spindle, positive against positive rotation")

    resistance = Parameter("ohm", 0.4, low=1e-3, doc="resistance of the armature")
    amplifier_gain = Parameter("1", 20.0, low=0.0, doc="gain of the amplifier")
    torque_constant = Parameter("N*m/A", 0.5, low=0.0, doc="motor torque per ampere")
    voltage_constant = Parameter("V*s/rad", 0.5, low=0.0, doc="motor voltage per speed")
    tachometer_gain = Parameter("V*s/rad", 0.0122, low=0.0, doc="gain of the motor's tachometer in the velocity loop")
    largest_current = Parameter("A", 200.0, low=0.0, doc="upper limit of the current")
    smallest_current = Parameter("A", -200.0, high=0.0, doc="lower limit of the current")
    gear = Parameter("1", 1.0, low=1e-6, doc="spindle turns per motor turn")
    motor_inertia = Parameter("kg*m^2", 0.05, low=1e-12, doc="inertia of the motor")
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
    current = Output("A", doc="current of the motor")
    motor_torque = Output("N*m", doc="torque of the motor")
    power = Output("W", doc="mechanical power of the motor")
    drive_torque = Output("N*m", doc="net torque of the drive at the spindle, before dry friction and load")
    back_emf = Output("V*s/rad", doc="voltage to the amplifier that a speed of the spindle takes up")

    output_current = staticmethod(motor_current)

    @staticmethod
    def derivative(
        rotation: float, motor_torque: float, torque: float, gear: float, motor_inertia: float, spindle_inertia: float,
        motor_viscous: float, spindle_viscous: float, motor_coulomb: float, spindle_coulomb: float, step: float,
    ) -> tuple[float, float]:  # fmt: skip
        """Equations (2) and (3)."""
        inertia = at_the_motor(motor_inertia, gear, spindle_inertia)
        applied = motor_torque - at_the_motor(motor_viscous, gear, spindle_viscous) * rotation - gear * torque
        friction = dry_friction(applied, rotation, motor_coulomb + gear * spindle_coulomb, inertia, step)
        return (applied - friction) / inertia, gear * rotation

    @staticmethod
    def output(rotation: float, turned: float, gear: float) -> tuple[float, float, float]:
        """Equation (3), and the states as they are."""
        return gear * rotation, turned, rotation

    @staticmethod
    def output_equivalent_inertia(gear: float, motor_inertia: float, spindle_inertia: float) -> float:
        return motor_inertia / (gear * gear) + spindle_inertia

    @staticmethod
    def output_motor_torque(current: float, torque_constant: float) -> float:
        return torque_constant * current

    @staticmethod
    def output_power(motor_torque: float, motor_velocity: float) -> float:
        return motor_torque * motor_velocity

    @staticmethod
    def output_drive_torque(motor_torque: float, motor_velocity: float, gear: float, motor_viscous: float, spindle_viscous: float) -> float:
        """The driving part of the equation of motion."""
        return (motor_torque - at_the_motor(motor_viscous, gear, spindle_viscous) * motor_velocity) / gear

    @staticmethod
    def output_back_emf(amplifier_gain: float, voltage_constant: float, tachometer_gain: float, gear: float) -> float:
        """Both loops of the speed; without an amplifier there is none."""
        return (tachometer_gain + voltage_constant / amplifier_gain) / gear if amplifier_gain > 0.0 else 0.0


class TorqueSpindle(Component):
    """Gives speed and angle of an inertia turned against viscous friction and gravity:  J dw/dt = T_drive - b w - G sin(a - a0) - T.

    G is the weight of the rotating body times the distance of its centre of gravity from the shaft, as for an arm or a part clamped off
    centre; a0 is the angle at which it hangs at rest. Source: Newton's law; L. Meirovitch, Fundamentals of Vibrations (2001), section 1.9
    (pendulum). The defaults are the data sheet of the motor bench HSM150 (University bench, 2023): J 1.2e-4 kg m^2, b 7.03e-5 N m s, and
    a shaft in balance. Left out: dry friction, elasticity, the drive's own dynamics.
    """

    group = "spindle"

    ports = {
        "effort": "disturbance", "flow": "speed", "spindle_speed": "speed", "displacement": "angle", "drive": "torque", "applied": "torque",
        "pushing": "pushing", "inertia": "inertia", "resistance": "viscous",
    }  # fmt: skip

    torque = Input("N*m", doc="torque of the drive on the spindle")
    disturbance = Input("N*m", default=0.0, doc="torque on the spindle, positive against positive rotation")

    inertia = Parameter("kg*m^2", 1.2e-4, low=1e-12, doc="inertia of all that turns")
    viscous = Parameter("N*m*s/rad", 7.03e-5, low=0.0, doc="viscous friction")
    gravity = Parameter("N*m", 0.0, low=0.0, doc="torque of gravity on a horizontal arm: weight times distance from the shaft")
    lowest = Parameter("rad", 0.0, doc="angle at which it hangs at rest")

    rotation = State("rad/s", doc="spindle speed")
    turned = State("rad", doc="angle turned")

    speed = Output("rad/s", doc="spindle speed")
    angle = Output("rad", doc="angle turned since the start")
    pushing = Output("N*m", doc="torque of drive and gravity, which dry friction at rest balances")

    @staticmethod
    def derivative(
        rotation: float, turned: float, torque: float, disturbance: float, inertia: float, viscous: float, gravity: float, lowest: float
    ) -> tuple[float, float]:
        """Newton's law; zero gravity adds nothing, not even rounding."""
        pull = gravity * math.sin(turned - lowest) if gravity > 0.0 else 0.0
        return (torque - viscous * rotation - disturbance - pull) / inertia, rotation

    @staticmethod
    def output(rotation: float, turned: float) -> tuple[float, float]:
        return rotation, turned

    @staticmethod
    def output_pushing(turned: float, torque: float, gravity: float, lowest: float) -> float:
        return torque - gravity * math.sin(turned - lowest) if gravity > 0.0 else torque


class SteadySpindle(Component):
    """Gives speed and angle of a spindle that nothing slows down:  n (1 + a sin(2 pi f t)),  its angle the exact integral.

    Varying the speed keeps the waves of two turns from settling in step: the way to cut above the limit of a steady speed. Source: E.
    Stone, S. Ahmed, A. Askari, H. Tat, Investigations of process damping forces in metal cutting (2005), and textbooks on sinusoidal
    spindle speed variation. Left out: drive and inertia; AnalyticalSpindle has both.
    """

    group = "spindle"

    ports = {"spindle_speed": "speed"}

    target = Parameter("rad/s", 104.71975511965977, low=0.0, doc="mean speed")
    variation = Parameter("1", 0.0, low=0.0, high=0.9, doc="amplitude of the speed over the mean")
    variation_frequency = Parameter("Hz", 1.0, low=1e-6, doc="how often the speed swings")

    speed = Output("rad/s", doc="speed of the spindle")
    angle = Output("rad", doc="angle turned since the start")

    @staticmethod
    def output(time: float, target: float, variation: float, variation_frequency: float) -> tuple[float, float]:
        w = 2.0 * math.pi * variation_frequency
        if variation == 0.0:
            return target, target * time
        return target * (1.0 + variation * math.sin(w * time)), target * (time + variation * (1.0 - math.cos(w * time)) / w)
