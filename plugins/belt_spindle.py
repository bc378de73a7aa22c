"""Kind 1 of the user-written parts: a spindle model. Motor and spindle joined by a belt that gives."""

from __future__ import annotations

from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.hookspecs import hookimpl


class BeltSpindle(Component):
    """Gives the speed of a spindle behind a belt:

        tau dw_m/dt + w_m = K V - Kd S r,   J_s dw/dt = S - T - b w,   S = k twist + c (r w_m - w),   d(twist)/dt = r w_m - w

    S is the torque of the belt at the spindle, r the spindle turns per motor turn. It takes the place of the spindle of a lathe.
    Source: two-mass drive, G. Ellis, Control System Design Guide (2012), chapter on compliance and resonance; the values are assumed, the
    belt swings at about 30 Hz. Left out: slip, dry friction, saturation of the current.
    """

    ports = {"effort": "torque", "flow": "speed", "displacement": "angle", "drive": "voltage", "inertia": "spindle_inertia"}

    voltage = Input("V", doc="voltage to the amplifier")
    torque = Input("N*m", default=0.0, doc="torque on the spindle, positive against positive rotation")

    gain = Parameter("rad/(s*V)", 26.09, low=0.0, doc="motor speed per volt")
    time_constant = Parameter("s", 0.05, low=1e-4, doc="time constant of the motor alone")
    disturbance_gain = Parameter("rad/(s*N*m)", 1.0436, low=0.0, doc="motor speed lost per newton metre")
    ratio = Parameter("1", 1.0, low=0.05, high=20.0, doc="spindle turns per motor turn")
    spindle_inertia = Parameter("kg*m^2", 0.15, low=1e-3, doc="inertia of spindle, chuck and part")
    spindle_viscous = Parameter("N*m*s/rad", 0.02, low=0.0, doc="viscous friction of the spindle")
    belt_stiffness = Parameter("N*m/rad", 1500.0, low=1.0, doc="torque of the belt per angle")
    belt_damping = Parameter("N*m*s/rad", 2.0, low=0.0, doc="damping of the belt")

    motor = State("rad/s", doc="motor speed")
    rotation = State("rad/s", doc="spindle speed")
    twist = State("rad", doc="angle by which the motor is ahead, at the spindle")
    turned = State("rad", doc="angle turned since the start")

    speed = Output("rad/s", doc="actual spindle speed")
    angle = Output("rad", doc="angle turned since the start")
    belt_torque = Output("N*m", doc="torque of the belt on the spindle")

    @staticmethod
    def derivative(
        motor: float,
        rotation: float,
        twist: float,
        voltage: float,
        torque: float,
        gain: float,
        time_constant: float,
        disturbance_gain: float,
        ratio: float,
        spindle_inertia: float,
        spindle_viscous: float,
        belt_stiffness: float,
        belt_damping: float,
    ) -> tuple[float, float, float, float]:
        """Motor, spindle and belt."""
        ahead = ratio * motor - rotation
        belt = belt_stiffness * twist + belt_damping * ahead
        motor_rate = (gain * voltage - disturbance_gain * belt * ratio - motor) / time_constant
        return motor_rate, (belt - torque - spindle_viscous * rotation) / spindle_inertia, ahead, rotation

    @staticmethod
    def output(
        motor: float, rotation: float, twist: float, turned: float, ratio: float, belt_stiffness: float, belt_damping: float
    ) -> tuple[float, float, float]:
        """Speed, angle and what the belt carries."""
        return rotation, turned, belt_stiffness * twist + belt_damping * (ratio * motor - rotation)


@hookimpl
def register_components() -> list[type[Component]]:
    """Hand the part to the simulator."""
    return [BeltSpindle]
