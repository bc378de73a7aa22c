"""Remedies against a structure that gives, swings or grows warm."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Memory, Parameter, State
from lathesim.effects.remedy import SHORTEST, EffectAtLoop, ModelledRemedy, Remedy, Sizes, ahead, followed, with_added

_TWO_HALVES = 1.5
"""Number of the kind of shaper below which it spreads over one half period, and above which over two."""


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

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return shifts that the simulation finds."""
        shifts = ("per_speed", "per_acceleration")
        return Sizes(dict.fromkeys(shifts, 0.0), tuned=shifts)

    @staticmethod
    def update(
        drive: float, lag: float, inner: float, model_position: float, model_rate: float, per_speed: float, per_acceleration: float,
        shift: float, before: float, sample_period: float, time: float,
    ) -> tuple[float, float, float, float, float]:  # fmt: skip
        """Follow the reference; the acceleration is that of the model's equation."""
        if time <= 0.0:
            return drive, 0.0, 0.0, 0.0, 0.0
        position, rate = followed(model_position, model_rate, drive, lag, inner, sample_period)
        slope = (rate - model_rate) / sample_period
        if lag * inner > SHORTEST * SHORTEST:
            slope = (drive - position - lag * rate) / (lag * inner)
        wanted = per_speed * rate + per_acceleration * slope
        return position, rate, wanted, shift, ahead(before, shift, wanted, lag, inner, sample_period)

    output = staticmethod(with_added)


class SwingModel(ModelledRemedy):
    """Takes away the swing of a structure that the axis excites:

        out = in - share gain s,   s'' + 2 damping w s' + w^2 s = a + drag v

    a and v are acceleration and speed of the model, drag the viscous friction over the mass, w = 2 pi frequency; the swing is known ahead
    and sent through the model's inverse, so the table stands still while bed or screw swing.

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

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the resonance, with gains that the simulation finds."""
        values = {name: effect.values[name] for name in ("frequency", "damping")}
        return Sizes({**values, "gain": 0.0, "drag": 0.0}, tuned=("gain", "drag"))

    @staticmethod
    def update(
        drive: float, lag: float, inner: float, model_position: float, model_rate: float, share: float, gain: float, drag: float,
        frequency: float, damping: float, swing: float, swing_rate: float, before: float, sample_period: float, time: float,
    ) -> tuple[float, float, float, float, float, float]:  # fmt: skip
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
        return incoming if share == 0.0 else incoming - share * added


def _lateness(frequency: float, damping: float, kind: float) -> float:
    """Return the time [s] over which a shaper spreads the reference."""
    return (1.0 if kind < _TWO_HALVES else 2.0) * 0.5 / (frequency * math.sqrt(1.0 - damping * damping))


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
    typed_in = reshapes = True
    limits = ("time",)
    cannot = "Corners are rounded by what it is late, and cutting forces excite the structure too."
    follows = {"frequency": "the natural frequency", "damping": "its damping"}

    frequency = Parameter("Hz", 20.0, low=0.1, high=2000.0, doc="natural frequency")
    damping = Parameter("1", 0.0, low=0.0, high=0.9, doc="damping ratio")
    kind = Parameter("1", 1.0, low=1.0, high=2.0, doc="1 for ZV, 2 for ZVD")
    history = Memory("{signal}", 4096, doc="the last references", holds=_lateness)
    newest = DiscreteState("1", doc="place of the newest value in the history")
    shaped = DiscreteState("{signal}", doc="shaped reference of this sample")

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the resonance, for the shaper that is late the least."""
        return Sizes({**{name: effect.values[name] for name in ("frequency", "damping")}, "kind": 1.0})

    @staticmethod
    def update(
        incoming: float, history: list[float], newest: float, frequency: float, damping: float, kind: float, sample_period: float,
        time: float,
    ) -> tuple[float, float]:  # fmt: skip
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
        if kind < _TWO_HALVES:
            return place * 1.0, (incoming + part * once) / (1.0 + part)
        twice = _back(history, place, 2.0 * half)
        return place * 1.0, (incoming + 2.0 * part * once + part * part * twice) / ((1.0 + part) * (1.0 + part))

    @staticmethod
    def output(incoming: float, share: float, shaped: float) -> float:
        return incoming if share == 0.0 else incoming + share * (shaped - incoming)


def _back(history: list[float], newest: int, samples: float) -> float:
    """Return the value some samples back, linear between two."""
    length = len(history)
    if samples > length - 2.0:
        return math.nan
    whole = int(samples)
    first = newest - whole
    if first < 0:
        first += length
    second = first - 1
    if second < 0:
        second += length
    return history[first] + (samples - whole) * (history[second] - history[first])


class CommandNotch(Remedy):
    """Takes a band of frequencies out of the command:

        out = in + share (H in - in),   H = (s^2 + 2 numerator w s + w^2)/(s^2 + 2 denominator w s + w^2),   w = 2 pi frequency

    H is made discrete by the bilinear transformation, true at w. Source: Siemens, SINAMICS S120 Function Manual, current setpoint filter.
    """

    answers = ("AxialResonance", "BaseRocking")
    typed_in = True
    limits = ("bandwidth",)
    cannot = "What shakes the structure from outside is not taken away, and the loop gets later below the band."
    follows = {"frequency": "the natural frequency", "numerator": "its damping"}

    frequency = Parameter("Hz", 20.0, low=0.1, high=2000.0, doc="middle of the band")
    numerator = Parameter("1", 0.0, low=0.0, high=10.0, doc="damping ratio of the numerator: its share of the denominator's is left")
    denominator = Parameter("1", 0.5, low=1e-3, high=10.0, doc="damping ratio of the denominator: half the width of the band")
    first = DiscreteState("{signal}", doc="command a sample ago")
    second = DiscreteState("{signal}", doc="command two samples ago")
    kept = DiscreteState("{signal}", doc="filtered command of this sample")
    before = DiscreteState("{signal}", doc="filtered command a sample ago")

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return the resonance, with the motor held and with it free, and a band that the simulation finds."""
        frequency, free = effect.values["frequency"], math.sqrt(1.0 - effect.values.get("table_share", 0.0))
        values = {"frequency": frequency, "numerator": effect.values["damping"], "denominator": 0.5}
        return Sizes(values, tuned=("frequency", "denominator"), begins={"frequency": (frequency, frequency / free)})

    @staticmethod
    def update(
        incoming: float, frequency: float, numerator: float, denominator: float, first: float, second: float, kept: float, before: float,
        sample_period: float, time: float,
    ) -> tuple[float, float, float, float]:  # fmt: skip
        """Filter the command; what no sample can hold passes."""
        if time <= 0.0 or 2.0 * frequency * sample_period >= 1.0:
            return incoming, incoming, incoming, incoming
        k = math.tan(math.pi * frequency * sample_period)
        middle = 2.0 * (k * k - 1.0)
        passed = (1.0 + 2.0 * numerator * k + k * k) * incoming + middle * first + (1.0 - 2.0 * numerator * k + k * k) * second
        held = middle * kept + (1.0 - 2.0 * denominator * k + k * k) * before
        return incoming, first, (passed - held) / (1.0 + 2.0 * denominator * k + k * k), kept

    @staticmethod
    def output(incoming: float, share: float, kept: float) -> float:
        return incoming if share == 0.0 else incoming + share * (kept - incoming)


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

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return how the screw grows."""
        side = -1.0 if effect.closes else 1.0
        values = {name: effect.values[name] for name in ("time_constant", "fixed_end", "warmed_before")}
        return Sizes({"strain": side * effect.values["strain"], **values})

    @staticmethod
    def output(
        incoming: float, time: float, share: float, strain: float, time_constant: float, fixed_end: float, warmed_before: float
    ) -> float:
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

    @classmethod
    def sized_for(cls, effect: EffectAtLoop) -> Sizes | None:
        """Return how the spindle grows."""
        side = -1.0 if effect.closes else 1.0
        values = {name: effect.values[name] for name in ("time_constant", "full_speed")}
        return Sizes({"growth": side * effect.values["growth"], **values})

    @staticmethod
    def derivative(spindle_speed: float, warmth: float, time_constant: float, full_speed: float) -> float:
        return (abs(spindle_speed) / full_speed - warmth) / time_constant

    @staticmethod
    def output(incoming: float, warmth: float, share: float, growth: float) -> float:
        return incoming if share == 0.0 else incoming - share * growth * warmth
