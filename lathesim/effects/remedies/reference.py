"""Remedies on the reference of an axis: play, tables of the screw and across axes, growth, and a structure that swings."""

from __future__ import annotations

import itertools
import math
from typing import Any, ClassVar

from lathesim.component import DiscreteState, Input, Memory, Parameter, State, Table
from lathesim.effects.remedies.modelled import SHORTEST, ModelledRemedy, ahead, followed
from lathesim.effects.remedies.remedy import Remedy


def interpolated(table: Any, at: float, column: int) -> float:
    """Return the value of a table, linear between its rows and held beyond its ends; the rows' positions rise."""
    rows = len(table)
    if rows == 0:
        return 0.0
    if at <= table[0][0]:
        return float(table[0][column])
    if at >= table[rows - 1][0]:
        return float(table[rows - 1][column])
    low = 0
    high = rows - 1
    while high - low > 1:
        middle = (low + high) // 2
        if table[middle][0] <= at:
            low = middle
        else:
            high = middle
    width = table[high][0] - table[low][0]
    if width <= 0.0:
        return float(table[low][column])
    part = (at - table[low][0]) / width
    return float(table[low][column] + part * (table[high][column] - table[low][column]))


def folds_back(rows: list[list[float]]) -> str:
    """Return what is wrong with a table whose positions do not rise, or so steep that the corrected axis would turn back; else nothing."""
    for number, (first, second) in enumerate(itertools.pairwise(rows), start=2):
        if second[0] <= first[0]:
            return f"the position falls from {first[0]:g} m to {second[0]:g} m in row {number}; the positions of a table rise."
        for column in range(1, len(first)):
            if abs(second[column] - first[column]) >= second[0] - first[0]:
                return f"the table folds back in row {number}: the correction changes by more than the way between two points."
    return ""


class BacklashShift(ModelledRemedy):
    """Shifts the reference by half the play in the direction of motion:  out = in + share c,  c = +-width/2.

    The shift turns over as sin^2 over ``spread`` seconds from where the model reverses, and is sent ahead by the model, so that the motor
    has crossed the play when the table is to move. A negative ``width`` takes back what a reading with play makes too much.

    Source: backlash compensation of common controls; M. Nordin, P.-O. Gutman, Automatica 38 (2002), section 4.
    """

    site = "drive"
    answers = ("Backlash",)
    limits = ("voltage", "bandwidth")
    cannot = "A force that pulls the table through the play is not held."
    follows = {"width": "the width of the play"}

    width = Parameter("{signal}", 0.0, doc="whole width of the play")
    spread = Parameter("s", 0.0, low=0.0, doc="time over which the shift turns over")
    still = Parameter("({drive})/s", 1e-6, low=1e-12, doc="speed below which the axis stands")
    side = DiscreteState("1", doc="sign of the direction in which it moves or last moved; 0 before the first motion")
    since = DiscreteState("s", 1e9, doc="time since the last reversal")
    begin = DiscreteState("1", doc="shift at that reversal, of half the width")
    shift = DiscreteState("{signal}", doc="shift at the end of this sample")
    before = DiscreteState("{signal}", doc="shift at its beginning")
    added = DiscreteState("{signal}", doc="what is added in this sample")

    @staticmethod
    def update(
        drive: float,
        lag: float,
        inner: float,
        model_position: float,
        model_rate: float,
        width: float,
        spread: float,
        still: float,
        side: float,
        since: float,
        begin: float,
        shift: float,
        before: float,
        sample_period: float,
        time: float,
    ) -> tuple[float, float, float, float, float, float, float, float]:
        """Find reversals of the model, and where the shift is on its way over."""
        if time <= 0.0:
            return drive, 0.0, 0.0, 1e9, 0.0, 0.0, 0.0, 0.0
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        turned = 0.0
        if rate > still:
            turned = 1.0
        elif rate < -still:
            turned = -1.0
        half = 0.5 * width
        if turned != 0.0 and turned != side:
            begin = shift / half if half != 0.0 else 0.0
            side = turned
            since = 0.0
        since = since + sample_period
        share_over = 1.0
        if since < spread:
            wave = math.sin(0.5 * math.pi * since / spread)
            share_over = wave * wave
        wanted = half * (begin + (side - begin) * share_over)
        if side == 0.0:
            wanted = 0.0
        return position, rate, side, since, begin, wanted, shift, ahead(before, shift, wanted, lag, inner, sample_period)

    @staticmethod
    def output(incoming: float, share: float, added: float) -> float:
        """Shift the reference."""
        if share == 0.0:
            return incoming
        return incoming + share * added


class PlayReading(ModelledRemedy):
    """Takes play out of the reading that closes a loop:  out = in - share (f - m),  f follows m, pushed so that |f - m| <= width/2.

    m is the position of the model; what its reading with play would be is worked out as the play itself works.

    Source: M. Nordin, P.-O. Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38 (2002), section 4 (inverse).
    """

    site = "measured"
    answers = ("Backlash",)
    limits = ("sensor", "model")
    cannot = "A force that moves the axis within its play is not read."
    follows = {"width": "the width of the play"}

    width = Parameter("{signal}", 0.0, low=0.0, doc="whole width of the play")
    follower = DiscreteState("{drive}", doc="what is read of the model's position")
    error = DiscreteState("{drive}", doc="error of the reading at this sample")

    @staticmethod
    def update(
        drive: float,
        lag: float,
        inner: float,
        model_position: float,
        model_rate: float,
        width: float,
        follower: float,
        sample_period: float,
        time: float,
    ) -> tuple[float, float, float, float]:
        """Follow the reference, and drag the reading along."""
        if time <= 0.0:
            return drive, 0.0, drive, 0.0
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        error = follower - model_position
        half = 0.5 * width
        if follower > position + half:
            follower = position + half
        elif follower < position - half:
            follower = position - half
        return position, rate, follower, error

    @staticmethod
    def output(incoming: float, share: float, error: float) -> float:
        """Take the play out of the reading."""
        if share == 0.0:
            return incoming
        return incoming - share * error


class PitchTable(ModelledRemedy):
    """Corrects the reference by a table of the axis, with a column for each direction:  out = in - share e(q, direction).

    The table ``points`` holds positions with the error found there going forward and going backward, linear between them (a one-sided
    table has both columns alike); what is left of an error A sin(2 pi q/p) between points h apart is A (1 - cos(pi h/p)). It is taken where
    the model is and sent ahead of it.

    Source: ISO 230-2 (positioning, bidirectional); axis compensation of common controls.
    """

    site = "drive"
    answers = ("CumulativePitchError", "PeriodicPitchError", "EncoderEccentricity", "EncoderInterpolationError", "ScaleFactorError")
    limits = ("points", "bandwidth")
    cannot = "What moves with temperature is not in a table."
    follows = {"points": "the error law, taken at the points"}
    example_tables: ClassVar[dict[str, list[list[float]]]] = {"points": [[0.0, 0.0, 1e-6], [0.01, 1e-6, 2e-6], [0.02, 0.0, 1e-6]]}

    points = Table("m", ("position", "forward", "backward"), doc="error of the axis at each point, going forward and backward")
    still = Parameter("({drive})/s", 1e-6, low=1e-12, doc="speed below which the axis stands")
    backward = DiscreteState("1", doc="1 while it moves or last moved backward")
    error = DiscreteState("{signal}", doc="error at the end of this sample")
    before = DiscreteState("{signal}", doc="error at its beginning")
    added = DiscreteState("{signal}", doc="what is taken away in this sample")

    @staticmethod
    def table_fault(name: str, rows: list[list[float]]) -> str:
        """Say what is wrong with a table, or nothing."""
        return folds_back(rows)

    @staticmethod
    def update(
        points: Any,
        drive: float,
        lag: float,
        inner: float,
        model_position: float,
        model_rate: float,
        still: float,
        backward: float,
        error: float,
        before: float,
        sample_period: float,
        time: float,
    ) -> tuple[float, float, float, float, float, float]:
        """Look the error up where the model is."""
        if time <= 0.0:
            first = interpolated(points, drive, 1)
            return drive, 0.0, 0.0, first, first, first
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        if rate > still:
            backward = 0.0
        elif rate < -still:
            backward = 1.0
        found = interpolated(points, position, 2 if backward > 0.5 else 1)
        return position, rate, backward, found, error, ahead(before, error, found, lag, inner, sample_period)

    @staticmethod
    def output(incoming: float, share: float, added: float) -> float:
        """Take the error away."""
        if share == 0.0:
            return incoming
        return incoming - share * added


class ReadingTable(Remedy):
    """Corrects the reading of the sensor that closes a loop by a table:  out = in - share e(in).

    The table ``points`` holds readings with the error of the sensor there, linear between them: an eccentric disc, a signal period, a lead
    that the motor's encoder does not see. The phase of an incremental encoder is found anew at start.

    Source: Heidenhain, Rotary Encoders (technical information), compensation tables of common controls.
    """

    site = "measured"
    answers = ("EncoderEccentricity", "EncoderInterpolationError", "CumulativePitchError", "PeriodicPitchError", "ScaleFactorError")
    limits = ("points", "sensor")
    cannot = "An incremental encoder without an index has another phase after each start."
    follows = {"points": "the error law, taken at the points"}
    example_tables: ClassVar[dict[str, list[list[float]]]] = {"points": [[0.0, 0.0], [0.01, 1e-6], [0.02, 0.0]]}

    points = Table("m", ("position", "error"), doc="error of the reading at each point")

    @staticmethod
    def table_fault(name: str, rows: list[list[float]]) -> str:
        """Say what is wrong with a table, or nothing."""
        return folds_back(rows)

    @staticmethod
    def output(incoming: float, points: Any, share: float) -> float:
        """Take the error away."""
        if share == 0.0:
            return incoming
        return incoming - share * interpolated(points, incoming, 1)


class AcrossTable(Remedy):
    """Corrects the reference of one axis by a table over the place of another:  out = in - share e(q_other).

    The table ``points`` holds places of the other axis with the error of this one there, linear between them: out of square, and the way
    that is not straight. Source: ISO 230-1; sag compensation of common controls.
    """

    site = "drive"
    answers = ("SquarenessError",)
    limits = ("points",)
    cannot = "What moves with temperature is not in a table."
    follows = {"points": "the error law over the other axis"}
    example_tables: ClassVar[dict[str, list[list[float]]]] = {"points": [[0.0, 0.0], [0.01, 1e-6], [0.02, 0.0]]}

    points = Table("m", ("position", "error"), doc="error of this axis over the place of the other one")
    other = Input("m", doc="position asked of the other axis")

    @staticmethod
    def table_fault(name: str, rows: list[list[float]]) -> str:
        """Say what is wrong with a table, or nothing."""
        return folds_back(rows)

    @staticmethod
    def output(incoming: float, points: Any, other: float, share: float) -> float:
        """Take the error away."""
        if share == 0.0:
            return incoming
        return incoming - share * interpolated(points, other, 1)


class GrowthModel(Remedy):
    """Takes the growth of a screw away:  out = in - share strain (1 - exp(-(t + warmed_before)/time_constant)) (in - fixed_end).

    Source: ISO 230-3; J. Mayr et al., Thermal issues in machine tools, CIRP Annals 61 (2012). Left out: another duty than the one learned.
    """

    site = "drive"
    answers = ("ThermalScrewGrowth",)
    limits = ("duty",)
    cannot = "Another duty than the one learned grows otherwise."
    follows = {"strain": "the strain", "time_constant": "its time constant"}

    strain = Parameter("1", 0.0, low=-0.01, high=0.01, doc="thermal strain of the warm screw")
    time_constant = Parameter("s", 1800.0, low=1e-3, doc="time to 63 % of the growth")
    fixed_end = Parameter("{signal}", 0.0, doc="position of the fixed bearing")
    warmed_before = Parameter("s", 0.0, low=0.0, doc="how long it has been warming up")

    @staticmethod
    def output(
        incoming: float, time: float, share: float, strain: float, time_constant: float, fixed_end: float, warmed_before: float
    ) -> float:
        """Take the growth away."""
        if share == 0.0:
            return incoming
        return incoming - share * strain * (1.0 - math.exp(-(time + warmed_before) / time_constant)) * (incoming - fixed_end)


class SpindleGrowthModel(Remedy):
    """Takes the growth of a spindle away, from the speeds it ran at:  out = in - share growth w,  T dw/dt = |n|/full_speed - w.

    Source: ISO 230-3 (thermal distortion by rotating spindles).
    """

    site = "drive"
    answers = ("SpindleGrowth",)
    limits = ("duty",)
    cannot = "Another duty than the one learned grows otherwise."
    follows = {"growth": "the growth", "time_constant": "its time constant"}

    spindle_speed = Input("rad/s", doc="spindle speed")
    warmth = State("1", doc="1 after long running at full speed")
    growth = Parameter("{signal}", 0.0, doc="growth after long running at full speed")
    time_constant = Parameter("s", 1800.0, low=1e-3, doc="time to 63 % of the growth")
    full_speed = Parameter("rad/s", 300.0, low=1e-3, doc="speed the growth is given for")

    @staticmethod
    def derivative(spindle_speed: float, warmth: float, time_constant: float, full_speed: float) -> float:
        """Warm up."""
        return (abs(spindle_speed) / full_speed - warmth) / time_constant

    @staticmethod
    def output(incoming: float, warmth: float, share: float, growth: float) -> float:
        """Take the growth away."""
        if share == 0.0:
            return incoming
        return incoming - share * growth * warmth


class ComplianceShift(ModelledRemedy):
    """Shifts the reference by what screw and coupling give under the force of the motion:  out = in + share (g_v v + g_a v').

    v and v' are those of the model, and the shift is sent through its inverse. With the compliance C, the mass m and the viscous friction
    b it is g_v = C b and g_a = C m.

    Source: Y. Altintas, Manufacturing Automation, 2nd ed. 2012, section 5.2 (elastic deformation of feed drives).
    """

    site = "drive"
    answers = ("TorsionalWindUp",)
    limits = ("voltage", "bandwidth")
    cannot = "What bends under cutting forces is not known ahead."
    follows = {"per_speed": "compliance times viscous friction", "per_acceleration": "compliance times mass"}

    per_speed = Parameter("s", 0.0, doc="shift per speed")
    per_acceleration = Parameter("s**2", 0.0, doc="shift per acceleration")
    shift = DiscreteState("{drive}", doc="shift at the end of this sample")
    before = DiscreteState("{drive}", doc="shift at its beginning")
    added = DiscreteState("{signal}", doc="what is added in this sample")

    @staticmethod
    def update(
        drive: float,
        lag: float,
        inner: float,
        model_position: float,
        model_rate: float,
        per_speed: float,
        per_acceleration: float,
        shift: float,
        before: float,
        sample_period: float,
        time: float,
    ) -> tuple[float, float, float, float, float]:
        """Follow the reference; the acceleration is that of the model's equation."""
        if time <= 0.0:
            return drive, 0.0, 0.0, 0.0, 0.0
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        slope = (rate - model_rate) / sample_period
        if lag * inner > SHORTEST * SHORTEST:
            slope = (drive - position - lag * rate) / (lag * inner)
        wanted = per_speed * rate + per_acceleration * slope
        return position, rate, wanted, shift, ahead(before, shift, wanted, lag, inner, sample_period)

    @staticmethod
    def output(incoming: float, share: float, added: float) -> float:
        """Shift the reference."""
        if share == 0.0:
            return incoming
        return incoming + share * added


class SwingModel(ModelledRemedy):
    """Takes away the swing of a structure that the axis excites:

        out = in - share gain s,   s'' + 2 damping w s' + w^2 s = a + drag v

    a and v are acceleration and speed of the model, drag the viscous friction over the mass, w = 2 pi frequency; the swing is known ahead and sent through the model's inverse, so the table
    stands still while bed or screw swing.

    Source: Y. Altintas et al., Machine tool feed drives, CIRP Annals 60 (2011), section 5 (active suppression by feedforward).
    """

    site = "drive"
    answers = ("AxialResonance", "BaseRocking")
    limits = ("voltage", "bandwidth")
    cannot = "Cutting forces excite it too, and are not known ahead."
    follows = {"frequency": "the natural frequency", "damping": "its damping", "gain": "the swing per acceleration"}

    gain = Parameter("1", 0.0, doc="swing that is taken away, of s")
    drag = Parameter("1/s", 0.0, doc="viscous friction of the axis over its mass")
    frequency = Parameter("Hz", 20.0, low=0.1, high=2000.0, doc="natural frequency")
    damping = Parameter("1", 0.05, low=0.0, high=2.0, doc="damping ratio")
    swing = DiscreteState("{drive}", doc="s at the end of this sample")
    swing_rate = DiscreteState("({drive})/s", doc="its rate")
    before = DiscreteState("{drive}", doc="s at the beginning of this sample")
    added = DiscreteState("{signal}", doc="what is taken away in this sample")

    @staticmethod
    def update(
        drive: float,
        lag: float,
        inner: float,
        model_position: float,
        model_rate: float,
        share: float,
        gain: float,
        drag: float,
        frequency: float,
        damping: float,
        swing: float,
        swing_rate: float,
        before: float,
        sample_period: float,
        time: float,
    ) -> tuple[float, float, float, float, float, float]:
        """Follow the reference, and the swing that its acceleration excites: exact for an acceleration that is held."""
        if time <= 0.0:
            return drive, 0.0, 0.0, 0.0, 0.0, 0.0
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        # what the shift itself accelerates swings too: (1 + gain) s'' + 2 damping w s' + w^2 s = a
        heavier = math.sqrt(max(1.0 + share * gain, 0.1))
        angular = 2.0 * math.pi * frequency / heavier
        damped = max(damping / heavier, 1e-4)
        pushed = (rate - model_rate) / sample_period + drag * 0.5 * (rate + model_rate)
        rest = pushed / (heavier * heavier * angular * angular)
        # s'' + 2 d w s' + w^2 s = a is the model's equation with T = 2 d/w and T_i = 1/(2 d w)
        following, speed = followed(swing, swing_rate, rest, 2.0 * damped / angular, 0.5 / (damped * angular), sample_period)
        return position, rate, following, speed, swing, gain * ahead(before, swing, following, lag, inner, sample_period)

    @staticmethod
    def output(incoming: float, share: float, added: float) -> float:
        """Take the swing away."""
        if share == 0.0:
            return incoming
        return incoming - share * added


class InputShaper(Remedy):
    """Splits the reference into two or three parts half a vibration apart, so that their swings cancel:

        ZV: out = (in(t) + K in(t - h))/(1 + K),   ZVD: (in(t) + 2 K in(t - h) + K^2 in(t - 2 h))/(1 + K)^2
        K = exp(-pi damping/sqrt(1 - damping^2)),   h = 1/(2 frequency sqrt(1 - damping^2))

    Undamped, off by a ratio r of the frequencies, |cos(pi r/2)| of the swing is left by ZV and its square by ZVD. ZV is late by half a
    vibration, ZVD by one, so all axes of a path have the same shaper.

    Source: N. C. Singer, W. P. Seering, Preshaping command inputs to reduce system vibration, J. Dyn. Syst. Meas. Control 112 (1990).
    """

    site = "drive"
    answers = ("AxialResonance", "BaseRocking")
    limits = ("time",)
    cannot = "Corners are rounded by what it is late, and cutting forces excite the structure too."
    follows = {"frequency": "the natural frequency", "damping": "its damping"}

    frequency = Parameter("Hz", 20.0, low=0.1, high=2000.0, doc="natural frequency")
    damping = Parameter("1", 0.0, low=0.0, high=0.9, doc="damping ratio")
    kind = Parameter("1", 1.0, low=1.0, high=2.0, doc="1 for ZV, 2 for ZVD")
    history = Memory("{signal}", 4096, doc="the last references")
    newest = DiscreteState("1", doc="place of the newest value in the history")
    shaped = DiscreteState("{signal}", doc="shaped reference of this sample")

    @staticmethod
    def update(
        incoming: float,
        history: list[float],
        newest: float,
        frequency: float,
        damping: float,
        kind: float,
        sample_period: float,
        time: float,
    ) -> tuple[float, float]:
        """Add the parts, linear between samples."""
        length = len(history)
        place = int(newest) + 1
        if time <= 0.0:
            for row in range(length):
                history[row] = incoming
            place = 0
        if place >= length:
            place = 0
        history[place] = incoming
        root = math.sqrt(1.0 - damping * damping)
        part = math.exp(-math.pi * damping / root)
        half = 0.5 / (frequency * root) / sample_period
        once = _back(history, place, half)
        if kind < 1.5:
            return place * 1.0, (incoming + part * once) / (1.0 + part)
        twice = _back(history, place, 2.0 * half)
        return place * 1.0, (incoming + 2.0 * part * once + part * part * twice) / ((1.0 + part) * (1.0 + part))

    @staticmethod
    def output(incoming: float, share: float, shaped: float) -> float:
        """Send the shaped reference."""
        if share == 0.0:
            return incoming
        return incoming + share * (shaped - incoming)


def _back(history: list[float], newest: int, samples: float) -> float:
    """Return the value some samples back, linear between two."""
    length = len(history)
    if samples > length - 2.0:
        samples = length - 2.0
    whole = int(samples)
    first = newest - whole
    if first < 0:
        first += length
    second = first - 1
    if second < 0:
        second += length
    return history[first] + (samples - whole) * (history[second] - history[first])


def residual_of_shaper(ratio: float, kind: int) -> float:
    """Return the share of an undamped swing that a shaper leaves at a ratio r of the frequencies: |cos(pi r/2)| for ZV, squared for ZVD."""
    left = abs(math.cos(0.5 * math.pi * ratio))
    return left if kind == 1 else left * left


def residual_of_table(amplitude: float, spacing: float, period: float) -> float:
    """Return what a table leaves of an error A sin(2 pi x/p) between points h apart:  A (1 - cos(pi h/p))."""
    return amplitude * (1.0 - math.cos(math.pi * spacing / period))
