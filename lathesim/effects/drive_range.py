"""What an amplifier cannot do: too small a command, too large a one, too fast a one."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.identification import Identification


def _limited(value: float, level: float) -> float:
    if value > level:
        return level
    if value < -level:
        return -level
    return value


class AmplifierDeadZone(Effect):
    """An amplifier that gives nothing for a small command, and lacks that much of a large one.

    u_out = u_in - clip(u_in, -half_width, half_width)
    """

    catalogue, family, site = 18, "drive range", "drive"
    neutral = {"half_width": 0.0}
    identification = Identification(
        typical={"half_width": (0.02, 0.5)},
        typical_rotary={"half_width": (0.02, 0.5)},
    )
    fingerprint = "The force is flat around zero command and wrong by a constant beside it: a function of the command, not of the velocity."
    confused_with = ("CoulombFriction, which follows the sign of the velocity",)
    experiment = "Hold still against a force that varies slowly through zero."
    source = "Tao, Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, Wiley 1996, ch. 2. Range assumed."

    incoming = Input("{signal}", doc="command")
    outgoing = Output("{signal}", doc="command that acts")
    half_width = Parameter("{signal}", 0.0, low=0.0, doc="largest command without an answer")

    @staticmethod
    def output(incoming: float, half_width: float) -> float:
        if half_width == 0.0:
            return incoming
        return incoming - _limited(incoming, half_width)


class DriveSaturation(Effect):
    """A drive that gives no more than a level: voltage or current limit.

    u_out = clip(u_in, -level, level),   or   u_in / (1 + (|u_in| / level)^n)^(1/n),   n = 1 / softness,   where it gives way gradually
    """

    catalogue, family, site = 20, "drive range", "drive"
    neutral = {"level": 1e9}
    identification = Identification(
        typical={"level": (0.5, 10.0), "softness": (0.0, 1.0)},
        typical_rotary={"level": (0.5, 10.0), "softness": (0.0, 1.0)},
        extended=("softness",),
    )
    fingerprint = "Flat tops, and only in large or fast moves."
    confused_with = ("DriveGainError",)
    experiment = "Play the same move within and beyond the range."
    source = "Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 5.3. Range assumed."

    incoming = Input("{signal}", doc="command")
    outgoing = Output("{signal}", doc="command that acts")
    level = Parameter("{signal}", 1e9, low=0.0, doc="largest size of the command that acts")
    softness = Parameter("1", 0.0, low=0.0, high=2.0, doc="how gradually the limit is reached: 0 at once, 0.5 as a root of squares")

    @staticmethod
    def output(incoming: float, level: float, softness: float) -> float:
        if softness == 0.0 or level == 0.0:
            return _limited(incoming, level)
        # below a hundredth the powers leave the range of numbers, and the corner is sharp
        power = 1.0 / max(softness, 0.01)
        share = abs(incoming) / level
        if share > 1.0:
            return incoming / share / math.pow(1.0 + math.pow(1.0 / share, power), 1.0 / power)
        return incoming / math.pow(1.0 + math.pow(share, power), 1.0 / power)


class CurrentLimit(Effect):
    """A motor that gets no more than a current: the amplifier's limit, or its fuse against a hot winding.

    u_out = clip(u_in - E v, -level, level) + E v

    E is the back EMF of the host, in volts of the command per velocity, that of a tachometer's loop included; ``level`` is the command that
    drives the largest current at rest. Where no speed takes up voltage it is the same as DriveSaturation.
    """

    catalogue, family, site = 20, "drive range", "drive"
    neutral = {"level": 1e9}
    identification = Identification(
        typical={"level": (0.05, 5.0)},
        typical_rotary={"level": (0.05, 5.0)},
        as_simulated=True,
    )
    fingerprint = "Flat tops of the current while the speed still grows: slopes of the speed that are all alike."
    confused_with = ("DriveSaturation", "DriveGainError")
    experiment = "Accelerate harder and harder: the current stops growing at one size, whatever the speed is."
    source = (
        "Krishnan, Electric Motor Drives, Prentice Hall 2001, sec. 3.10; level times gain over resistance is the current. Range assumed."
    )

    incoming = Input("{signal}", doc="command")
    flow = Input("{flow}", doc="velocity of the motor")
    back_emf = Input("{signal}/({flow})", doc="back EMF per velocity")
    outgoing = Output("{signal}", doc="command that drives the current that flows")
    level = Parameter("{signal}", 1e9, low=0.0, doc="command that drives the largest current at rest")

    @staticmethod
    def output(incoming: float, flow: float, back_emf: float, level: float) -> float:
        """What is left of the command after the back EMF, limited."""
        induced = back_emf * flow
        driving = incoming - induced
        # as it came where nothing is limited: with the back EMF taken out and put in again it would be another number
        if -level <= driving <= level:
            return incoming
        return _limited(driving, level) + induced


class SlewLimit(Effect):
    """A drive that changes no faster than a rate.

    |du_out/dt| <= rate, judged once a sample
    """

    catalogue, family, site = 20, "drive range", "drive"
    neutral = {"rate": 1e12}
    identification = Identification(
        typical={"rate": (10.0, 10000.0)},
        typical_rotary={"rate": (10.0, 10000.0)},
    )
    fingerprint = "Ramps of one slope where the command jumps."
    confused_with = ("MotorInductance", "CurrentLoopLag")
    experiment = "Steps of two sizes: the slope is the same for a slew limit and grows with the step for a lag."
    source = "Kester (ed.), The Data Conversion Handbook, Newnes 2005, ch. 7. Range assumed."

    incoming = Input("{signal}", doc="command")
    outgoing = Output("{signal}", doc="command that acts")
    held = DiscreteState("{signal}", doc="command that acts at the sample instant")
    rate = Parameter("({signal})/s", 1e12, low=0.0, doc="fastest change")

    @staticmethod
    def update(incoming: float, held: float, rate: float, sample_period: float, time: float) -> float:
        if time > 0.0:
            return held + _limited(incoming - held, rate * sample_period)
        return incoming

    @staticmethod
    def output(incoming: float, held: float, rate: float) -> float:
        if rate >= 1e12:
            return incoming
        return held
