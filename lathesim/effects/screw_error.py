"""Errors of the screw and of the ways: the table is not where the turns of the motor say."""

from __future__ import annotations

import math

from lathesim.component import Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.harmonics import SHAPE, SHAPE_RANGES, harmonic_parameters, harmonics
from lathesim.effects.identification import Identification


class CumulativePitchError(Effect):
    """A lead that is a little too long or too short.

    x_out = x_in + slope (x_in - origin)
    """

    catalogue, family, site = 9, "geometry", "measured"
    neutral = {"slope": 0.0}
    identification = Identification(
        between_sensors=True,
        carried=("m",),
        typical={"slope": (-300e-6, 300e-6)},
        typical_rotary={"slope": (-300e-6, 300e-6)},
    )
    fingerprint = "Table scale less motor encoder grows in proportion to the position, the same in both directions, from the first lap on."
    confused_with = ("ScaleFactorError", "ThermalScrewGrowth, which grows with time")
    experiment = "Measure with a laser or scale at two temperatures."
    source = "ISO 3408-3: permitted travel variation over 300 mm is 12 um (class 3), 23 um (5), 52 um (7)."

    incoming = Input("{signal}", doc="position by the turns of the screw")
    outgoing = Output("{signal}", doc="position of the table")
    slope = Parameter("1", 0.0, low=-0.1, high=0.1, doc="error per travel")
    origin = Parameter("{signal}", 0.0, doc="where the error is zero")

    @staticmethod
    def output(incoming: float, slope: float, origin: float) -> float:
        if slope == 0.0:
            return incoming
        return incoming + slope * (incoming - origin)


class PeriodicPitchError(Effect):
    """An error that repeats with each turn of the screw, from a bent screw or a tilted thrust face.

    x_out = x_in + amplitude (sin a + second and third harmonic),   a = 2 pi x_in / lead + phase

    A harmonic is sine sin(n a) + cosine cos(n a), both given as shares of the amplitude.
    """

    catalogue, family, site = 10, "once per turn", "measured"
    neutral = {"amplitude": 0.0}
    identification = Identification(
        between_sensors=True,
        carried=("m",),
        typical={"amplitude": (0.5e-6, 10e-6), "lead": (0.0005, 0.02), "phase": (-math.pi, math.pi), **SHAPE_RANGES},
        typical_rotary={"amplitude": (1e-5, 0.01), "lead": (0.2, 2.0 * math.pi), "phase": (-math.pi, math.pi), **SHAPE_RANGES},
        nuisance=("phase",),
        extended=SHAPE,
    )
    fingerprint = (
        "Table scale less motor encoder has a line at the lead in position; the force has none. Balls pass at 0.3 to 0.45 of the lead."
    )
    confused_with = ("TorqueRipple, which shows in the force", "EncoderEccentricity")
    experiment = "Constant speed: see whether the line stands in the scale difference or in the force."
    source = "ISO 3408-3: travel variation within 2 pi rad is 6 um (class 3), 8 um (5)."

    incoming = Input("{signal}", doc="position by the turns of the screw")
    outgoing = Output("{signal}", doc="position of the table")
    amplitude = Parameter("{signal}", 0.0, low=0.0, doc="half of the peak-to-peak error")
    lead = Parameter("{signal}", 0.005, low=1e-6, doc="travel after which the error repeats")
    phase = Parameter("rad", 0.0, doc="phase at position zero")
    second_sine, second_cosine, third_sine, third_cosine = harmonic_parameters()

    @staticmethod
    def output(
        incoming: float,
        amplitude: float,
        lead: float,
        phase: float,
        second_sine: float,
        second_cosine: float,
        third_sine: float,
        third_cosine: float,
    ) -> float:
        if amplitude == 0.0:
            return incoming
        angle = 2.0 * math.pi * incoming / lead + phase
        return incoming + amplitude * (math.sin(angle) + harmonics(angle, second_sine, second_cosine, third_sine, third_cosine))


class ThermalScrewGrowth(Effect):
    """A screw that grows as its nut and bearings warm it.

    x_out = x_in + strain (1 - exp(-(t + warmed_before) / time_constant)) (x_in - fixed_end)

    strain = 11 to 12 um/m/K times the final rise of temperature. Time counts from the start of the recording. A screw that had warmed up
    before grows no more: it has a CumulativePitchError.
    Left out: a rise that is local to the stroke.
    """

    catalogue, family, site = 11, "slow", "measured"
    neutral = {"strain": 0.0}
    identification = Identification(
        between_sensors=True,
        carried=("m",),
        typical={"strain": (10e-6, 300e-6), "time_constant": (10.0, 3600.0), "fixed_end": (-1.0, 1.0)},
        typical_rotary={"strain": (10e-6, 300e-6), "time_constant": (10.0, 3600.0), "fixed_end": (-1.0, 1.0)},
        history=("warmed_before",),
    )
    fingerprint = "Table scale less motor encoder drifts slowly, in proportion to the distance from the fixed bearing."
    confused_with = ("WearForceGrowth, in the diameter", "SpindleGrowth", "ClockSkew", "CumulativePitchError")
    experiment = "Visit two positions in turn while warming; then let the machine cool and watch it return."
    source = "ISO 230-3; Mayr et al., Thermal issues in machine tools, CIRP Annals 61 (2012). Steel: 11 to 12 um/m/K. Range assumed."

    incoming = Input("{signal}", doc="position by the cold screw")
    outgoing = Output("{signal}", doc="position of the table")
    strain = Parameter("1", 0.0, low=-0.01, high=0.01, doc="thermal strain of the warm screw")
    time_constant = Parameter("s", 1800.0, low=1e-3, doc="time to 63 % of the growth")
    fixed_end = Parameter("{signal}", 0.0, doc="position of the fixed bearing")
    warmed_before = Parameter("s", 0.0, low=0.0, doc="how long it had been warming up when the recording began")

    @staticmethod
    def output(incoming: float, time: float, strain: float, time_constant: float, fixed_end: float, warmed_before: float) -> float:
        if strain == 0.0:
            return incoming
        return incoming + strain * (1.0 - math.exp(-(time + warmed_before) / time_constant)) * (incoming - fixed_end)


class SquarenessError(Effect):
    """An axis that is pulled aside as the other one travels: out of square, and bent by the way.

    x_out = x_in + slope z + bow z^2

    Needs a wire from the other axis: ``other_position: z_axis.position``. A diagnosis tries each other axis of the machine.
    """

    catalogue, family, site = 12, "geometry", "measured"
    neutral = {"slope": 0.0, "bow": 0.0}
    identification = Identification(
        senses_elsewhere={"other_position": "displacement"},
        between_sensors=True,
        typical={"slope": (-50e-6, 50e-6), "bow": (-1e-3, 1e-3)},
    )
    fingerprint = "The position error of one axis is a function of the position of the other."
    confused_with = ("a tailstock out of line, which gives the same taper", "WorkpieceDeflection")
    experiment = "Turn the test bar round, and measure it in the machine."
    source = "ISO 230-1 (squareness and straightness of linear axes). Range assumed."

    incoming = Input("{signal}", doc="position of this axis")
    other_position = Input("m", doc="position of the other axis")
    outgoing = Output("{signal}", doc="position with the error")
    slope = Parameter("1", 0.0, low=-0.1, high=0.1, doc="error per travel of the other axis")
    bow = Parameter("1/m", 0.0, doc="error per square of the travel of the other axis")

    @staticmethod
    def output(incoming: float, other_position: float, slope: float, bow: float) -> float:
        if slope == 0.0 and bow == 0.0:
            return incoming
        return incoming + (slope + bow * other_position) * other_position
