"""Remedies that shift a reference or a reading: against play, by table of an axis, of a reading or across axes, and learned lap by lap."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from lathesim.component import ON, DiscreteState, Input, Parameter, Table
from lathesim.effects.remedy import SHORTEST, EffectAtLoop, ModelledRemedy, Remedy, Sizes, ahead, followed, with_added


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


_SPREADS = (0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0)
"""Lags over which the shift of a play is tried to turn over."""
_IN_GAP = {"start_in_gap": (-1.0, 1.0)}
"""On which side of its play an axis was left: nobody knows that at the start."""
_POINTS_PER_PERIOD = 24
_FEWEST_POINTS = 33
_MOST_POINTS = 4000
_BEYOND_TRAVEL = 0.02


def error_points(effect: EffectAtLoop) -> npt.NDArray[np.float64]:
    """Return places over the travel and the error at each, (points, 2) [m]."""
    low, high = effect.travel
    margin = max(_BEYOND_TRAVEL * (high - low), 1e-4)
    period = effect.values.get("lead") or effect.values.get("turn") or effect.values.get("signal_period") or 0.0
    width = high - low + 2.0 * margin
    count = _FEWEST_POINTS if period <= 0.0 else int(min(max(_FEWEST_POINTS, width / period * _POINTS_PER_PERIOD), _MOST_POINTS))
    places = np.linspace(low - margin, high + margin, count)
    return np.stack([places, _errors_at(places, effect.values, period)], axis=1)


def _errors_at(x: npt.NDArray[np.float64], p: Mapping[str, float], period: float) -> npt.NDArray[np.float64]:
    """Return the errors [m] at places: of a straight line, of a scale, or of a wave that repeats after a ``period`` [m]."""
    if "slope" in p:
        return p["slope"] * (x - p["origin"])
    if "factor" in p:
        return (p["factor"] - 1.0) * x
    turned = 2.0 * math.pi * x / period
    if "signal_period" in p:
        return np.asarray(p["amplitude"] * np.sin(turned + p["phase"]) + p["second"] * np.sin(2.0 * turned + p["phase"]))
    angle = turned + p["phase"]
    second = p["second_sine"] * np.sin(2.0 * angle) + p["second_cosine"] * np.cos(2.0 * angle)
    third = p["third_sine"] * np.sin(3.0 * angle) + p["third_cosine"] * np.cos(3.0 * angle)
    return np.asarray(p["amplitude"] * (np.sin(angle) + second + third))


class PointTable:
    """A table of points, which must not fold back."""

    @staticmethod
    def table_fault(name: str, rows: list[list[float]]) -> str:
        """Return what is wrong with a table, or nothing."""
        return folds_back(rows)


class PitchTable(PointTable, ModelledRemedy):
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

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the table of a screw, of where the table of the machine is; none for an error of the reading itself."""
        if effect.closes:
            return None
        return Sizes({}, tables={"points": (("position", "forward", "backward"), error_points(effect)[:, [0, 1, 1]])})

    @staticmethod
    def update(
        points: Any, drive: float, lag: float, inner: float, model_position: float, model_rate: float, still: float, backward: float,
        error: float, before: float, sample_period: float, time: float,
    ) -> tuple[float, float, float, float, float, float]:  # fmt: skip
        if time <= 0.0:
            first = interpolated(points, drive, 1)
            return drive, 0.0, 0.0, first, first, first
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        if rate > still:
            backward = 0.0
        elif rate < -still:
            backward = 1.0
        found = interpolated(points, position, 2 if backward > ON else 1)
        return position, rate, backward, found, error, ahead(before, error, found, lag, inner, sample_period)

    @staticmethod
    def output(incoming: float, share: float, added: float) -> float:
        return incoming if share == 0.0 else incoming - share * added


class ReadingTable(PointTable, Remedy):
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

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the table of the loop's own encoder, of what it reads; none for an error behind its back."""
        return Sizes({}, tables={"points": (("position", "error"), error_points(effect))}) if effect.closes else None

    @staticmethod
    def output(incoming: float, points: Any, share: float) -> float:
        return incoming if share == 0.0 else incoming - share * interpolated(points, incoming, 1)


class AcrossTable(PointTable, Remedy):
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

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the table over the way of the other axis; none without one."""
        if not effect.other:
            return None
        low, high = effect.other_travel
        places = np.linspace(low - 1e-3, high + 1e-3, _FEWEST_POINTS)
        side = -1.0 if effect.closes else 1.0
        errors = side * (effect.values["slope"] + effect.values["bow"] * places) * places
        return Sizes({}, tables={"points": (("position", "error"), np.stack([places, errors], axis=1))}, sources={"other": effect.other})

    @staticmethod
    def output(incoming: float, points: Any, other: float, share: float) -> float:
        return incoming if share == 0.0 else incoming - share * interpolated(points, other, 1)


class LearnedCorrection(Remedy):
    """Adds what was learned for each sample of a lap:  out_k = in_k + share c_k,  nothing once the lap is over.

    The table ``samples`` holds one number a sample, from the first sample of the run on. It belongs to one program at one feed: another
    lap has another table. Source: D. A. Bristow, M. Tharayil, A. G. Alleyne, A survey of iterative learning control, IEEE Control Systems
    26 (2006).
    """

    answers = ()
    limits = ("converter", "encoder", "bandwidth", "same lap each time")
    cannot = "It helps the lap that it was learned on and no other one."
    follows = {"samples": "the recorded errors of the laps before"}
    source = "Bristow, Tharayil, Alleyne, A survey of iterative learning control, IEEE Control Systems 26 (2006)"
    example_tables: ClassVar[dict[str, list[list[float]]]] = {"samples": [[0.0], [1e-3], [-1e-3]]}

    samples = Table("{signal}", ("correction",), doc="what is added, one number a sample")
    place = DiscreteState("1", -1.0, doc="sample of the lap")

    @staticmethod
    def update(place: float) -> float:
        return place + 1.0

    @staticmethod
    def output(incoming: float, samples: Any, place: float, share: float) -> float:
        row = int(place)
        return incoming if share == 0.0 or row < 0 or row >= len(samples) else float(incoming + share * samples[row][0])


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

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the play and how fast it turns over; none for a play of the reading itself."""
        if effect.closes:
            return None
        values = {"width": effect.values["width"], "spread": max(0.3 * effect.lag, 1e-3)}
        begins = {"spread": tuple(times * max(effect.lag, 1e-3) for times in _SPREADS)}
        return Sizes(values, tuned=("spread", "width"), one_sided=("width",), begins=begins, free=_IN_GAP)

    @staticmethod
    def update(
        drive: float, lag: float, inner: float, model_position: float, model_rate: float, width: float, spread: float, still: float,
        side: float, since: float, begin: float, shift: float, before: float, sample_period: float, time: float,
    ) -> tuple[float, float, float, float, float, float, float, float]:  # fmt: skip
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

    output = staticmethod(with_added)


class ReversalPulse(ModelledRemedy):
    """Adds a pulse to the speed setpoint where that setpoint turns:  out = in + share lag d speed exp(-t/fade).

    d is the new direction and t the time since. A speed on top of the setpoint (r - m)/T is the T-fold of it on top of r, so it is added to
    the reference. Source: Siemens, SINUMERIK Function Manual K3, friction compensation. Assumed: the pulse begins where the setpoint
    without feedforward crosses zero.
    """

    site = "drive"
    answers = ("CoulombFriction", "StribeckFriction", "AsymmetricFriction", "PositionDependentFriction", "PreslidingFriction")
    typed_in = True
    limits = ("bandwidth",)
    cannot = "Friction that stays after the pulse is left to the integrator of the loop."
    follows = {"speed": "the level of the friction, as a speed"}

    speed = Parameter("({drive})/s", 0.0, doc="what is added to the speed setpoint")
    fade = Parameter("s", 0.015, low=1e-4, high=10.0, doc="time in which it falls to 1/e")
    still = Parameter("({drive})/s", 1e-6, low=1e-12, doc="setpoint below which the axis stands")
    side = DiscreteState("1", doc="sign of the setpoint now or last; 0 before the first motion")
    since = DiscreteState("s", 1e9, doc="time since it turned")

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return a pulse that the simulation finds; none for a loop that is not behind, of which the setpoint is not known."""
        if effect.lag < SHORTEST:
            return None
        begins = {"speed": (1e-4, 3e-4, 1e-3, 3e-3, 1e-2), "fade": tuple(times * effect.lag for times in (1.0, 3.0, 10.0, 30.0))}
        return Sizes({"speed": 1e-3, "fade": 3.0 * effect.lag}, tuned=("speed", "fade"), one_sided=("speed",), begins=begins)

    @staticmethod
    def update(
        drive: float, lag: float, inner: float, model_position: float, model_rate: float, still: float, side: float, since: float,
        sample_period: float, time: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        if time <= 0.0 or lag <= 0.0:
            return drive, 0.0, 0.0, 1e9
        setpoint = (drive - model_position) / lag
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        since = since + sample_period
        if abs(setpoint) > still and setpoint * side <= 0.0:
            since = 0.0 if side != 0.0 else since
            side = 1.0 if setpoint > 0.0 else -1.0
        return position, rate, side, since

    @staticmethod
    def output(incoming: float, share: float, lag: float, speed: float, fade: float, side: float, since: float) -> float:
        return incoming if share == 0.0 else incoming + share * lag * side * speed * math.exp(-since / fade)


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

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the play of the reading; none for one behind its back."""
        return Sizes({"width": effect.values["width"]}, one_sided=("width",), free=_IN_GAP) if effect.closes else None

    @staticmethod
    def update(
        drive: float, lag: float, inner: float, model_position: float, model_rate: float, width: float, follower: float,
        sample_period: float, time: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
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
        return incoming if share == 0.0 else incoming - share * error
