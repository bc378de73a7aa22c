"""What an amplifier cannot do, and the ripple of a motor."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import Effect, Identification, OnCommand
from lathesim.elementary import sin, within

_WITHOUT_LIMIT = 1e12
"""Rate of a command that no drive reaches."""


class AmplifierDeadZone(OnCommand, Effect):
    """An amplifier that ignores a small command and subtracts its dead zone from a larger one.

    u_out = u_in - clip(u_in, -half_width, half_width)
    """

    catalogue, family, site = 18, "drive range", "drive"
    neutral = {"half_width": 0.0}
    identification = Identification(typical={"half_width": (0.02, 0.5)})
    fingerprint = "The force is flat around zero command and wrong by a constant beside it: a function of the command, not of the velocity."
    confused_with = ("CoulombFriction, which follows the sign of the velocity",)
    experiment = "Hold still against a force that varies slowly through zero."
    source = "Tao, Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, Wiley 1996, ch. 2. Range assumed."

    half_width = Parameter("{signal}", 0.0, low=0.0, doc="largest command without an answer")

    @staticmethod
    def output(incoming: float, half_width: float) -> float:
        return incoming if half_width == 0.0 else incoming - within(incoming, -half_width, half_width)


class DriveSaturation(OnCommand, Effect):
    """A drive that gives no more than a level: voltage or current limit.

    u_out = clip(u_in, -level, level),   or   u_in / (1 + (|u_in| / level)^n)^(1/n),   n = 1 / softness,   where it gives way gradually
    """

    catalogue, family, site = 20, "drive range", "drive"
    neutral = {"level": 1e9}
    identification = Identification(typical={"level": (0.5, 10.0), "softness": (0.0, 1.0)}, extended=("softness",))
    fingerprint = "Flat tops, and only in large or fast moves."
    confused_with = ("DriveGainError",)
    experiment = "Play the same move within and beyond the range."
    source = "Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 5.3. Range assumed."

    level = Parameter("{signal}", 1e9, low=0.0, doc="largest size of the command that acts")
    softness = Parameter("1", 0.0, low=0.0, high=2.0, doc="how gradually the limit is reached: 0 at once, 0.5 as a root of squares")

    @staticmethod
    def output(incoming: float, level: float, softness: float) -> float:
        if softness == 0.0 or level == 0.0:
            return within(incoming, -level, level)
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
    identification = Identification(typical={"level": (0.05, 5.0)}, as_simulated=True)
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
        return incoming if -level <= driving <= level else within(driving, -level, level) + induced


class SlewLimit(OnCommand, Effect):
    """A drive whose output changes no faster than a given rate.

    |du_out/dt| <= rate

    The command is held over a sample, so that what acts climbs or falls towards it in one line from where the last sample left it.
    Left out: a command that moves within a sample is followed from its value at the sample instant.
    """

    catalogue, family, site = 20, "drive range", "drive"
    neutral = {"rate": _WITHOUT_LIMIT}
    identification = Identification(typical={"rate": (10.0, 10000.0)})
    fingerprint = "Ramps of one slope where the command jumps."
    confused_with = ("MotorInductance", "CurrentLoopLag", "TransportDelay")
    experiment = "Steps of two sizes: the slope is the same for a slew limit and grows with the step for a lag."
    source = "Kester (ed.), The Data Conversion Handbook, Newnes 2005, ch. 7. Range assumed."

    reached = DiscreteState("{signal}", doc="what acts at the sample instant")
    wanted = DiscreteState("{signal}", doc="command since the sample instant")
    sampled = DiscreteState("s", doc="time of the sample instant")
    rate = Parameter("({signal})/s", 1e12, low=0.0, doc="fastest change")

    @staticmethod
    def update(
        incoming: float, reached: float, wanted: float, rate: float, sample_period: float, time: float
    ) -> tuple[float, float, float]:
        if time > 0.0:
            return reached + within(wanted - reached, -rate * sample_period, rate * sample_period), incoming, time
        return incoming, incoming, time

    @staticmethod
    def output(incoming: float, reached: float, sampled: float, rate: float, time: float) -> float:
        largest = rate * (time - sampled)
        return incoming if rate >= _WITHOUT_LIMIT else reached + within(incoming - reached, -largest, largest)


class TorqueRipple(Effect):
    """Ripple of the motor force over its angle, a part of it proportional to the drive force.

    F_out = F_in - (amplitude + share applied) sin(2 pi q / period + phase)
    """

    catalogue, family, site = 21, "once per turn", "effort"
    neutral = {"amplitude": 0.0, "share": 0.0}
    identification = Identification(
        typical={"amplitude": (0.5, 30.0), "share": (0.0, 0.05), "period": (0.0002, 0.02), "phase": (-math.pi, math.pi)},
        typical_rotary={"amplitude": (0.0005, 1.0), "share": (0.0, 0.05), "period": (0.02, 2.0 * math.pi), "phase": (-math.pi, math.pi)},
        nuisance=("phase",),
    )
    fingerprint = "A line of the missing force that stays in position, with the same sign in both directions, and grows with the drive."
    confused_with = ("Cogging", "PositionDependentFriction", "PeriodicPitchError", "EncoderEccentricity")
    experiment = "Three constant speeds, plotted over orders of the motor; the same with a larger load."
    source = "Krishnan, Electric Motor Drives, Prentice Hall 2001, ch. 9; 1 to 5 % of rated, orders 1, 2, 6 ... 24. Range assumed."

    incoming = Input("{signal}", doc="disturbance before the ripple")
    applied = Input("{signal}", default=0.0, doc="driving force or torque on the host")
    displacement = Input("{displacement}", doc="position of the host")
    outgoing = Output("{signal}", doc="disturbance with the ripple")
    amplitude = Parameter("{signal}", 0.0, doc="ripple whatever the drive")
    share = Parameter("1", 0.0, low=-1.0, high=1.0, doc="ripple per driving force")
    period = Parameter("{displacement}", 0.005, low=1e-6, doc="travel after which it repeats: the lead over the order")
    phase = Parameter("rad", 0.0, doc="phase at position zero")

    @staticmethod
    def output(incoming: float, applied: float, displacement: float, amplitude: float, share: float, period: float, phase: float) -> float:
        if amplitude == 0.0 and share == 0.0:
            return incoming
        size = amplitude if share == 0.0 else amplitude + share * applied
        return incoming - size * sin(2.0 * math.pi * displacement / period + phase)


class Cogging(Effect):
    """Force of the magnets on the teeth, which is there with the power off.

    F_out = F_in + amplitude sin(2 pi q / period + phase) + second sin(4 pi q / period + second_phase)
    """

    catalogue, family, site = 22, "once per turn", "effort"
    neutral = {"amplitude": 0.0, "second": 0.0}
    identification = Identification(
        typical={
            "amplitude": (0.5, 30.0),
            "second": (0.0, 10.0),
            "period": (0.0002, 0.04),
            "phase": (-math.pi, math.pi),
            "second_phase": (-math.pi, math.pi),
        },
        typical_rotary={
            "amplitude": (0.0005, 1.0),
            "second": (0.0, 0.5),
            "period": (0.02, 2.0 * math.pi),
            "phase": (-math.pi, math.pi),
            "second_phase": (-math.pi, math.pi),
        },
        nuisance=("phase", "second_phase"),
        extended=("second", "second_phase"),
    )
    fingerprint = "A line of the missing force that stays in position, with the same sign both ways, and does not depend on the drive."
    confused_with = ("TorqueRipple", "PositionDependentFriction")
    experiment = "Drive the axis back with the power off: cogging is still there."
    source = "Hanselman, Brushless Permanent Magnet Motor Design, 2nd ed. 2003, ch. 7; 0.5 to 3 % of rated. Range assumed."

    incoming = Input("{signal}", doc="disturbance before the cogging")
    displacement = Input("{displacement}", doc="position of the host")
    outgoing = Output("{signal}", doc="disturbance with the cogging")
    amplitude = Parameter("{signal}", 0.0, doc="size of the first harmonic")
    second = Parameter("{signal}", 0.0, doc="size of the second harmonic")
    period = Parameter("{displacement}", 0.005, low=1e-6, doc="travel from one tooth to the next")
    phase = Parameter("rad", 0.0, doc="phase of the first harmonic at position zero")
    second_phase = Parameter("rad", 0.0, doc="phase of the second harmonic at position zero")

    @staticmethod
    def output(
        incoming: float, displacement: float, amplitude: float, second: float, period: float, phase: float, second_phase: float
    ) -> float:
        if amplitude == 0.0 and second == 0.0:
            return incoming
        angle = 2.0 * math.pi * displacement / period
        return incoming + amplitude * sin(angle + phase) + second * sin(2.0 * angle + second_phase)
