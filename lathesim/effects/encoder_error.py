"""What an encoder gets wrong by itself."""

from __future__ import annotations

import math

from lathesim.component import Input, Output, Parameter
from lathesim.effects.effect import SHAPE, SHAPE_RANGES, Effect, Identification, harmonic_parameters, harmonics
from lathesim.elementary import sin


class EncoderEccentricity(Effect):
    """A disc that is mounted off its axis.

    y_out = y_in + amplitude (sin a + second and third harmonic),   a = 2 pi y_in / turn + phase

    A harmonic is sine sin(n a) + cosine cos(n a), both given as shares of the amplitude; the second comes from a disc that is tilted.
    """

    catalogue, family, site = 28, "once per turn", "measured"
    neutral = {"amplitude": 0.0}
    identification = Identification(
        carried=("m", "rad"),
        typical={"amplitude": (0.5e-6, 10e-6), "turn": (0.002, 0.02), "phase": (-math.pi, math.pi), **SHAPE_RANGES},
        typical_rotary={
            "amplitude": (1.5e-4, 1.5e-3),
            "turn": (2.0 * math.pi, 2.0 * math.pi),
            "phase": (-math.pi, math.pi),
            **SHAPE_RANGES,
        },
        nuisance=("phase",),
        extended=SHAPE,
    )
    fingerprint = "A line once per turn of the encoder, in scale less encoder and in the speed, with its phase tied to the disc."
    confused_with = ("PeriodicPitchError", "TorqueRipple", "Runout")
    experiment = "A second reading head opposite the first, or a direct scale."
    source = "Heidenhain, Rotary Encoders (technical information: eccentricity); 0.5 to 5 arc minutes. Range assumed."

    incoming = Input("{signal}", doc="true position")
    outgoing = Output("{signal}", doc="position the disc shows")
    amplitude = Parameter("{signal}", 0.0, low=0.0, doc="half of the peak-to-peak error")
    turn = Parameter("{signal}", 0.005, low=1e-6, doc="travel per turn of the encoder")
    phase = Parameter("rad", 0.0, doc="phase at position zero")
    second_sine, second_cosine, third_sine, third_cosine = harmonic_parameters()

    @staticmethod
    def output(
        incoming: float, amplitude: float, turn: float, phase: float, second_sine: float, second_cosine: float, third_sine: float,
        third_cosine: float,
    ) -> float:  # fmt: skip
        if amplitude == 0.0:
            return incoming
        angle = 2.0 * math.pi * incoming / turn + phase
        return incoming + amplitude * (sin(angle) + harmonics(angle, second_sine, second_cosine, third_sine, third_cosine))


class EncoderInterpolationError(Effect):
    """Sine and cosine of unequal size and offset: an error within each signal period.

    y_out = y_in + amplitude sin(2 pi y_in / signal_period + phase) + second sin(4 pi y_in / signal_period + phase)
    """

    catalogue, family, site = 29, "encoder", "measured"
    neutral = {"amplitude": 0.0, "second": 0.0}
    identification = Identification(
        carried=("m", "rad"),
        typical={"amplitude": (0.05e-6, 1e-6), "second": (0.0, 0.5e-6), "signal_period": (4e-6, 100e-6), "phase": (-math.pi, math.pi)},
        typical_rotary={"amplitude": (1e-6, 1e-4), "second": (0.0, 1e-4), "signal_period": (1e-4, 0.02), "phase": (-math.pi, math.pi)},
        nuisance=("phase",),
    )
    fingerprint = "A line at the very short signal period of the scale, whose frequency follows the speed."
    confused_with = ("noise, where the speed is high against the sample rate",)
    experiment = "A pass at 0.1 mm/s."
    source = "Heidenhain, Linear Encoders (technical information: position error within one signal period, 1 to 2 %). Range assumed."

    incoming = Input("{signal}", doc="true position")
    outgoing = Output("{signal}", doc="interpolated position")
    amplitude = Parameter("{signal}", 0.0, low=0.0, doc="error once per signal period (offsets)")
    second = Parameter("{signal}", 0.0, low=0.0, doc="error twice per signal period (amplitudes, phase)")
    signal_period = Parameter("{signal}", 20e-6, low=1e-9, doc="travel per signal period")
    phase = Parameter("rad", 0.0, doc="phase at position zero")

    @staticmethod
    def output(incoming: float, amplitude: float, second: float, signal_period: float, phase: float) -> float:
        if amplitude == 0.0 and second == 0.0:
            return incoming
        angle = 2.0 * math.pi * incoming / signal_period
        return incoming + amplitude * sin(angle + phase) + second * sin(2.0 * angle + phase)


class LostCounts(Effect):
    """Counts that are lost, at one instant or at up to three.

    y_out = y_in + jump (t >= instant) + second_jump (t >= second_instant) + third_jump (t >= third_instant)
    """

    catalogue, family, site = 30, "encoder", "measured"
    neutral = {"jump": 0.0}
    identification = Identification(
        carried=("m", "rad"),
        typical={
            "jump": (-200e-6, 200e-6), "instant": (0.0, 60.0), "second_jump": (-200e-6, 200e-6), "second_instant": (0.0, 60.0),
            "third_jump": (-200e-6, 200e-6), "third_instant": (0.0, 60.0),
        },
        typical_rotary={
            "jump": (-0.05, 0.05), "instant": (0.0, 60.0), "second_jump": (-0.05, 0.05), "second_instant": (0.0, 60.0),
            "third_jump": (-0.05, 0.05), "third_instant": (0.0, 60.0),
        },
        extended=("second_jump", "second_instant", "third_jump", "third_instant"),
        nuisance=("jump", "instant", "second_jump", "second_instant", "third_jump", "third_instant"),
        size_of_recording=("jump",),
    )  # fmt: skip
    fingerprint = "A step of the position difference that never comes back."
    confused_with = ("Backlash, whose step comes back with the next reversal",)
    experiment = "Return to the index mark."
    source = "Heidenhain, Linear Encoders (technical information: reference marks). Range assumed."

    incoming = Input("{signal}", doc="true position")
    outgoing = Output("{signal}", doc="counted position")
    jump = Parameter("{signal}", 0.0, doc="what the lost counts amount to")
    instant = Parameter("s", 1.0, low=0.0, doc="when they are lost")
    second_jump = Parameter("{signal}", 0.0, doc="what is lost at a second instant")
    second_instant = Parameter("s", 1.0, low=0.0, doc="when that is lost")
    third_jump = Parameter("{signal}", 0.0, doc="what is lost at a third instant")
    third_instant = Parameter("s", 1.0, low=0.0, doc="when that is lost")

    @staticmethod
    def output(
        incoming: float, time: float, jump: float, instant: float, second_jump: float, second_instant: float, third_jump: float,
        third_instant: float,
    ) -> float:  # fmt: skip
        if jump == 0.0:
            return incoming
        shown = incoming
        if time >= instant:
            shown += jump
        if time >= second_instant:
            shown += second_jump
        if time >= third_instant:
            shown += third_jump
        return shown


class Quantisation(Effect):
    """A reading in whole counts.

    y_out = round(y_in / count) count
    """

    catalogue, family, site = 30, "encoder", "measured"
    neutral = {"count": 0.0}
    identification = Identification(typical={"count": (0.05e-6, 5e-6)}, spacing="count", typical_rotary={"count": (1e-5, 1e-2)})
    fingerprint = "A staircase of one height."
    confused_with = ("noise of the sensor", "EncoderInterpolationError")
    experiment = "Creep over a few counts."
    source = "Widrow, Kollar, Quantization Noise, Cambridge 2008, ch. 1. Range assumed."

    incoming = Input("{signal}", doc="true value")
    outgoing = Output("{signal}", doc="value in whole counts")
    count = Parameter("{signal}", 0.0, low=0.0, doc="height of a step; 0 for none")

    @staticmethod
    def output(incoming: float, count: float) -> float:
        if count == 0.0:
            return incoming
        return math.floor(incoming / count + 0.5) * count
