"""Backlash between motor and table, and errors of the screw and of the ways."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import SHAPE, SHAPE_RANGES, Effect, Identification, harmonic_parameters, harmonics
from lathesim.elementary import sin


def _dragged(follower: float, leader: float, half: float) -> float:
    """Return where a follower stands that the leader can only push beyond ``half`` of the play on either side."""
    if follower > leader + half:
        return leader + half
    if follower < leader - half:
        return leader - half
    return follower


def _softly_dragged(follower: float, leader: float, leader_before: float, half: float, softness: float) -> float:
    """Return where a follower stands whose gap, ``leader - follower``, closes as du/ds = -u^softness / half with the way s of the leader,
    where u = 1 - gap / half is the part of the gap that is left in the direction of the motion.

    Solved over the way from ``leader_before`` to ``leader``: u^(1 - softness) falls by (1 - softness) s / half.
    """
    way = abs(leader - leader_before)
    direction = 1.0 if leader >= leader_before else -1.0
    left = min(max(1.0 - direction * (leader_before - follower) / half, 0.0), 2.0)
    if softness < 1.0:
        power = 1.0 - softness
        left = max(left**power - power * way / half, 0.0) ** (1.0 / power)
    else:
        left = left * math.exp(-way / half)
    return leader - direction * half * (1.0 - left)


class Backlash(Effect):
    """Play of screw, nut or gear: the table stands still until the motor has crossed the gap.

    x_out = x_out, held;  pushed so that  |x_out - x_in| <= width / 2

    With a ``softness`` the gap closes gradually, as one between skewed flanks or in stiff grease does: the part u of it that is left falls
    with the way s of the motor as du/ds = -2 u^softness / width, so 0 is the sharp edge and 1 an exponential.

    The table is taken to rest by its friction while the play is crossed, so the trace is one of geometry and not of force.
    Left out: the impact at the end of the gap, and a table that drifts inside it.
    """

    catalogue, family, site = 8, "reversal", "measured"
    neutral = {"width": 0.0}
    identification = Identification(
        between_sensors=True,
        carried=("m", "rad"),
        typical={"width": (2e-6, 100e-6), "start_in_gap": (-1.0, 1.0), "softness": (0.0, 1.0)},
        typical_rotary={"width": (1e-4, 0.02), "start_in_gap": (-1.0, 1.0), "softness": (0.0, 1.0)},
        nuisance=("start_in_gap",),
        extended=("softness",),
    )
    fingerprint = "Table scale less motor encoder jumps by the width at each reversal; the loop has the same width at every speed."
    confused_with = ("PreslidingFriction", "TorsionalWindUp", "CumulativePitchError", "TransportDelay, whose loop grows with the speed")
    experiment = "Two amplitudes at two speeds, watched with a direct scale."
    source = (
        "Nordin, Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002), sec. 2 (hysteresis "
        "model); softness after Dahl, A solid friction model, Aerospace Corp. TOR-0158(3107-18)-1 (1968). Range assumed."
    )

    incoming = Input("{signal}", doc="position before the play")
    outgoing = Output("{signal}", doc="position after the play")
    follower = DiscreteState("{signal}", doc="position after the play at the sample instant")
    leader = DiscreteState("{signal}", doc="position before the play at the sample instant")
    width = Parameter("{signal}", 0.0, low=0.0, doc="whole width of the play")
    start_in_gap = Parameter("1", 0.0, low=-1.0, high=1.0, doc="where the follower starts in the gap: -1 behind, 1 ahead")
    softness = Parameter("1", 0.0, low=0.0, high=1.0, doc="how gradually the gap closes: 0 at once, 1 exponentially")

    @staticmethod
    def update(
        incoming: float, follower: float, leader: float, width: float, start_in_gap: float, softness: float, time: float
    ) -> tuple[float, float]:
        if time <= 0.0:
            return incoming + 0.5 * width * start_in_gap, incoming
        if softness == 0.0 or width == 0.0:
            return _dragged(follower, incoming, 0.5 * width), incoming
        return _softly_dragged(follower, incoming, leader, 0.5 * width, softness), incoming

    @staticmethod
    def output(incoming: float, follower: float, leader: float, width: float, softness: float) -> float:
        if width == 0.0:
            return incoming
        if softness == 0.0:
            return _dragged(follower, incoming, 0.5 * width)
        return _softly_dragged(follower, incoming, leader, 0.5 * width, softness)


class CumulativePitchError(Effect):
    """A lead that is a little too long or too short.

    x_out = x_in + slope (x_in - origin)
    """

    catalogue, family, site = 9, "geometry", "measured"
    neutral = {"slope": 0.0}
    identification = Identification(between_sensors=True, carried=("m",), typical={"slope": (-300e-6, 300e-6)})
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
        return incoming if slope == 0.0 else incoming + slope * (incoming - origin)


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
    experiment = "At constant speed, see whether the spectral line is in the scale difference or in the force."
    source = "ISO 3408-3: travel variation within 2 pi rad is 6 um (class 3), 8 um (5)."

    incoming = Input("{signal}", doc="position by the turns of the screw")
    outgoing = Output("{signal}", doc="position of the table")
    amplitude = Parameter("{signal}", 0.0, low=0.0, doc="half of the peak-to-peak error")
    lead = Parameter("{signal}", 0.005, low=1e-6, doc="travel after which the error repeats")
    phase = Parameter("rad", 0.0, doc="phase at position zero")
    second_sine, second_cosine, third_sine, third_cosine = harmonic_parameters()

    @staticmethod
    def output(
        incoming: float, amplitude: float, lead: float, phase: float, second_sine: float, second_cosine: float, third_sine: float,
        third_cosine: float,
    ) -> float:  # fmt: skip
        if amplitude == 0.0:
            return incoming
        angle = 2.0 * math.pi * incoming / lead + phase
        return incoming + amplitude * (sin(angle) + harmonics(angle, second_sine, second_cosine, third_sine, third_cosine))


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
        senses_elsewhere={"other_position": "displacement"}, between_sensors=True, typical={"slope": (-50e-6, 50e-6), "bow": (-1e-3, 1e-3)}
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
        return incoming if slope == 0.0 and bow == 0.0 else incoming + (slope + bow * other_position) * other_position
