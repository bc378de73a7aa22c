"""Force that repeats with the turn of the motor and keeps its sign when the motion turns round."""

from __future__ import annotations

import math

from lathesim.component import Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.identification import Identification


class TorqueRipple(Effect):
    """Ripple of the motor force with its angle, a part of it in proportion to the drive.

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
    experiment = "Constant speed at three speeds, plotted over orders of the motor; the same with a larger load."
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
        return incoming - size * math.sin(2.0 * math.pi * displacement / period + phase)


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
        return incoming + amplitude * math.sin(angle + phase) + second * math.sin(2.0 * angle + second_phase)
