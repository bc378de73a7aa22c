"""Spindle: runout, unbalance, belts that slip, speed that falls under load, bearings that grow warm."""

from __future__ import annotations

import math

from lathesim.component import Input, Output, Parameter, State
from lathesim.effects.effect import SHAPE, SHAPE_RANGES, Effect, Identification, harmonic_parameters, harmonics
from lathesim.elementary import cos


class Runout(Effect):
    """A work-piece that runs off centre, or out of round: the depth of cut varies with the spindle angle.

    F_out = F_in (1 + eccentricity (cos a + second and third harmonic) / depth),   a = order angle + phase

    Order 1 is runout, 2 an oval part, 3 one bent by three jaws. A harmonic is sine sin(n a) + cosine cos(n a), both given as shares of the
    eccentricity. It sits on a cutting force that is proportional to the depth.
    """

    catalogue, family, site = 34, "spindle-synchronous", "force"
    stage = 2
    neutral = {"eccentricity": 0.0}
    identification = Identification(
        typical={"eccentricity": (2e-6, 100e-6), "order": (1.0, 3.0), "phase": (-math.pi, math.pi), **SHAPE_RANGES},
        nuisance=("phase",),
        extended=SHAPE,
    )
    fingerprint = "The force varies once per spindle turn by an amount that does not grow with the speed."
    confused_with = ("InterruptedCut", "an oval part, 2 per turn, or one bent by three jaws", "RegenerativeChatter", "Unbalance")
    experiment = "Three speeds; then turn the part round in the chuck."
    source = "ISO 230-7 (axes of rotation); Altintas, Manufacturing Automation, 2nd ed. 2012, sec. 2.3. Range assumed."

    incoming = Input("{signal}", doc="cutting force of a part that runs true")
    angle = Input("rad", doc="spindle angle")
    depth = Input("m", doc="depth of cut")
    outgoing = Output("{signal}", doc="cutting force")
    eccentricity = Parameter("m", 0.0, low=0.0, doc="half of the reading of a dial gauge")
    order = Parameter("1", 1.0, low=0.0, doc="lobes per turn")
    phase = Parameter("rad", 0.0, doc="phase at angle zero")
    second_sine, second_cosine, third_sine, third_cosine = harmonic_parameters()

    @staticmethod
    def output(
        incoming: float, angle: float, depth: float, eccentricity: float, order: float, phase: float, second_sine: float,
        second_cosine: float, third_sine: float, third_cosine: float,
    ) -> float:  # fmt: skip
        if eccentricity == 0.0 or depth <= 0.0:
            return incoming
        turned = order * angle + phase
        wave = cos(turned) + harmonics(turned, second_sine, second_cosine, third_sine, third_cosine)
        return incoming * max(0.0, 1.0 + eccentricity * wave / depth)


class Unbalance(Effect):
    """A mass off the spindle axis, felt by a force sensor at the tool or the housing.

    F_out = F_in + moment speed^2 cos(angle + phase)
    """

    catalogue, family, site = 34, "spindle-synchronous", "force"
    stage = 3
    neutral = {"moment": 0.0}
    identification = Identification(typical={"moment": (1e-5, 1e-2), "phase": (-math.pi, math.pi)}, nuisance=("phase",))
    fingerprint = "A line once per spindle turn that grows with the square of the speed and is there without a cut."
    confused_with = ("Runout, which does not grow with the speed",)
    experiment = "Three speeds, with and without a cut."
    source = "ISO 21940-11 (balancing of rotors). Range assumed."

    incoming = Input("{signal}", doc="force without the unbalance")
    angle = Input("rad", doc="spindle angle")
    spindle_speed = Input("rad/s", doc="spindle speed")
    outgoing = Output("{signal}", doc="force with the unbalance")
    moment = Parameter("kg*m", 0.0, low=0.0, doc="mass times its distance from the axis")
    phase = Parameter("rad", 0.0, doc="phase at angle zero")

    @staticmethod
    def output(incoming: float, angle: float, spindle_speed: float, moment: float, phase: float) -> float:
        return incoming if moment == 0.0 else incoming + moment * spindle_speed * spindle_speed * cos(angle + phase)


class BeltSlip(Effect):
    """A belt that creeps in proportion to its load, between motor and spindle.

    y_out = y_in (1 - slip - creep |load|)
    """

    catalogue, family, site = 35, "spindle speed", "flow"
    neutral = {"slip": 0.0, "creep": 0.0}
    identification = Identification(carried=("rad/s",), typical={"slip": (0.001, 0.03), "creep": (1e-5, 1e-2)})
    fingerprint = "The ratio of spindle to motor speed falls with the torque."
    confused_with = ("SpeedDroop", "ScaleFactorError, which does not know the load")
    experiment = "Motor and spindle encoders together, without load and in the cut."
    source = "Childs, Mechanical Design, 2nd ed. 2004, ch. 12 (belt creep of 0.5 to 2 %). Range assumed."

    incoming = Input("{signal}", doc="speed before the belt")
    effort = Input("{effort}", doc="load torque")
    outgoing = Output("{signal}", doc="speed behind the belt")
    slip = Parameter("1", 0.0, low=-0.5, high=0.9, doc="slip without load")
    creep = Parameter("1/({effort})", 0.0, low=0.0, doc="slip per load")

    @staticmethod
    def output(incoming: float, effort: float, slip: float, creep: float) -> float:
        return incoming if slip == 0.0 and creep == 0.0 else incoming * (1.0 - slip - creep * abs(effort))


class SpeedDroop(Effect):
    """A spindle that slows down under load, after a time.

    y_out = y_in - s,   response ds/dt = droop load - s
    """

    catalogue, family, site = 36, "spindle speed", "flow"
    neutral = {"droop": 0.0}
    identification = Identification(carried=("rad/s",), typical={"droop": (0.01, 10.0), "response": (0.01, 1.0)})
    fingerprint = "The speed dips exactly while the tool cuts."
    confused_with = ("BeltSlip",)
    experiment = "Motor and spindle encoders together: droop shows in both, slip in one."
    source = "Krishnan, Electric Motor Drives, Prentice Hall 2001, sec. 3 (speed regulation, 1 to 5 % at full load). Range assumed."

    incoming = Input("{signal}", doc="speed without load")
    effort = Input("{effort}", doc="load torque")
    outgoing = Output("{signal}", doc="speed under load")
    loss = State("{effort}", doc="load as the spindle has yet felt it")
    droop = Parameter("{signal}/({effort})", 0.0, low=0.0, doc="speed lost per load")
    response = Parameter("s", 0.1, low=1e-3, doc="time constant of the dip")

    @staticmethod
    def derivative(effort: float, loss: float, response: float) -> float:
        return (effort - loss) / response

    @staticmethod
    def output(incoming: float, loss: float, droop: float) -> float:
        return incoming if droop == 0.0 else incoming - droop * loss


class SpindleGrowth(Effect):
    """A spindle that grows with the heat of its bearings, which depends on the speeds it ran at.

    x_out = x_in + growth w,   time_constant dw/dt = |speed| / full_speed - w
    """

    catalogue, family, site = 37, "slow", "measured"
    neutral = {"growth": 0.0}
    identification = Identification(
        carried=("m",), typical={"growth": (10e-6, 40e-6), "time_constant": (60.0, 5400.0)}, history=("warmth",)
    )
    fingerprint = "A slow drift that is the same at every position and follows the history of the spindle speed."
    confused_with = ("ThermalScrewGrowth, which grows with the position", "ToolCompliance")
    experiment = "Steps of spindle speed without a cut."
    source = "ISO 230-3 (thermal distortion by rotating spindles). Range assumed."

    incoming = Input("{signal}", doc="position with a cold spindle")
    spindle_speed = Input("rad/s", doc="spindle speed")
    outgoing = Output("{signal}", doc="position with a warm spindle")
    warmth = State("1", doc="1 after long running at full speed")
    growth = Parameter("{signal}", 0.0, doc="growth after long running at full speed")
    time_constant = Parameter("s", 1800.0, low=1e-3, doc="time to 63 % of the growth")
    full_speed = Parameter("rad/s", 300.0, low=1e-3, doc="speed the growth is given for")

    @staticmethod
    def derivative(spindle_speed: float, warmth: float, time_constant: float, full_speed: float) -> float:
        return (abs(spindle_speed) / full_speed - warmth) / time_constant

    @staticmethod
    def output(incoming: float, warmth: float, growth: float) -> float:
        return incoming if growth == 0.0 else incoming + growth * warmth
