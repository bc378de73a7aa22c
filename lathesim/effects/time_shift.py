"""Time: signals that come late, channels that are shifted, clocks that run apart.

A channel that is shifted is interpolated by a cubic between two samples. A command is held between them, and a late one changes inside an
interval: a sensor that is read at the sample still sees the old one.
"""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Memory, Noise, Output, Parameter
from lathesim.effects.effect import Effect, Identification

_AROUND = 4.0
"""Cells of a ring that a cubic between two of them takes."""
_QUARTER = 0.25
"""Of a step: the stages of a step are at its beginning, its middle and its end."""
_ROUNDING = 1e-9
"""Of an instant, in steps."""

_SAMPLES = 1024


def _remember(history: list[float], newest: float, incoming: float, time: float) -> float:
    """Write into the ring and give the place of the newest; at the start the whole ring is filled."""
    length = len(history)
    if time <= 0.0:
        for place in range(length):
            history[place] = incoming
        return 0.0
    following = int(newest) + 1
    if following >= length:
        following = 0
    history[following] = incoming
    return float(following)


def _remembered(history: list[float], newest: float, back: int) -> float:
    """Return the value so many samples back."""
    place = int(newest) - back
    if place < 0:
        place += len(history)
    return history[place]


def _delayed(history: list[float], newest: float, samples: float) -> float:
    """Return the value some samples back, on the cubic through the two samples on either side; near the newest one, and beyond it, on the
    parabola through the last three. A straight line would be off by an eighth of the acceleration times the period squared."""
    if samples > len(history) - _AROUND:
        return math.nan
    back = samples
    whole = int(back)
    if back < 1.0:
        last, before = _remembered(history, newest, 0), _remembered(history, newest, 1)
        change, bend = last - before, last - 2.0 * before + _remembered(history, newest, 2)
        return last - back * change + 0.5 * back * (back - 1.0) * bend
    part = back - whole
    later, here = _remembered(history, newest, whole - 1), _remembered(history, newest, whole)
    sooner, first = _remembered(history, newest, whole + 1), _remembered(history, newest, whole + 2)
    outer = later * (part - 2.0) - first * (part + 1.0)
    inner = here * (part + 1.0) * (part - 2.0) * (part - 1.0) - sooner * (part + 1.0) * part * (part - 2.0)
    return 0.5 * inner - part * (part - 1.0) * outer / 6.0


class TransportDelay(Effect):
    """A command that acts late: computing time, communication, a loop that is sampled twice.

    u_out(t) = u_in(t - delay)
    """

    catalogue, family, site = 24, "lag", "drive"
    neutral = {"delay": 0.0}
    identification = Identification(whole_samples="delay", typical={"delay": (0.1e-3, 20e-3)})
    fingerprint = "A pure shift between command and force: its phase is linear in frequency, its amplitude is not touched."
    confused_with = ("MotorInductance", "CurrentLoopLag", "SensorFilter", "half a step of the integrator of a simulation")
    experiment = "Sines at several frequencies: the phase of a delay grows in proportion, that of a lag levels off."
    source = "Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. 1998, ch. 5 and 11. Range assumed."

    incoming = Input("{signal}", doc="command in time")
    outgoing = Output("{signal}", doc="command that acts")
    held = DiscreteState("{signal}", doc="delayed command at the end of the sample period")
    before = DiscreteState("{signal}", doc="delayed command at its beginning")
    began = DiscreteState("s", doc="when the sample period began")
    newest = DiscreteState("1", doc="place of the newest value in the history")
    history = Memory("{signal}", _SAMPLES, doc="the last samples", holds=lambda delay: delay)
    delay = Parameter("s", 0.0, low=0.0, high=10.0, doc="how late it is")

    @staticmethod
    def update(
        incoming: float, newest: float, history: list[float], delay: float, sample_period: float, time: float
    ) -> tuple[float, float, float, float]:
        place = _remember(history, newest, incoming, time)
        if delay / sample_period > len(history) - 2.0:
            return math.nan, math.nan, time, place
        whole = int(delay / sample_period)
        return _remembered(history, place, whole), _remembered(history, place, whole + 1), time, place

    @staticmethod
    def output(
        incoming: float, held: float, before: float, began: float, delay: float, sample_period: float, time: float, step: float
    ) -> float:
        if delay == 0.0:
            return incoming
        change = delay - sample_period * int(delay / sample_period)
        return held + (before - held) * _still_to_come(change / step, (time - began) / step)


def _still_to_come(change: float, now: float) -> float:
    """Return the share of a signal that has not changed yet, ``change`` and ``now`` counted in steps.

    In the middle of the step in which it changes it is 3/2 a - 1/4, a being the share of the step before the change: with the weights 1/6,
    4/6, 1/6 that a Runge-Kutta step of order four gives to the beginning, the middle and the end, the mean over the step is a. Where the
    change is near an end it is outside 0 to 1. Source: Simpson's rule; a signal that jumps would make the order of the step one.
    """
    whole = math.floor(now + _QUARTER)
    if abs(now - whole) < _QUARTER:
        return 1.0 if change > whole + _ROUNDING else 0.0
    inside = change - whole
    if inside > 1.0 + _ROUNDING:
        return 1.0
    if inside < _ROUNDING:
        return 0.0
    return 1.5 * inside - 0.25


class ChannelTimeShift(Effect):
    """One channel of a recording that is shifted in time against the others.

    y_out(t) = y_in(t - shift);   a run extrapolates a negative shift by the parabola through the last three samples, and what is held
    against a recording is read ahead
    """

    catalogue, family, site = 27, "recording", "reading"
    neutral = {"shift": 0.0}
    identification = Identification(delay="shift", typical={"shift": (-5e-3, 50e-3)})
    fingerprint = "One channel is late or early by a constant time; the loop itself behaves as if it were not."
    confused_with = ("TransportDelay, which a controller feels and an open loop does not show", "SensorFilter")
    experiment = "Record one edge on all channels, and what acts: in an open loop a late sensor and a late drive are one explanation."
    source = "Ljung, System Identification, 2nd ed. 1999, sec. 14.1 (data handling). Range assumed."

    incoming = Input("{signal}", doc="signal in time")
    outgoing = Output("{signal}", doc="signal as recorded")
    held = DiscreteState("{signal}", doc="shifted signal")
    newest = DiscreteState("1", doc="place of the newest value in the history")
    history = Memory("{signal}", _SAMPLES, doc="the last samples", holds=lambda shift: shift)
    shift = Parameter("s", 0.0, low=-10.0, high=10.0, doc="how late the channel is")

    @staticmethod
    def update(
        incoming: float, newest: float, history: list[float], shift: float, sample_period: float, time: float
    ) -> tuple[float, float]:
        place = _remember(history, newest, incoming, time)
        return _delayed(history, place, shift / sample_period), place

    @staticmethod
    def output(incoming: float, held: float, shift: float) -> float:
        return incoming if shift == 0.0 else held


class ClockSkew(Effect):
    """A recorder whose clock runs slow or fast against the machine's.

    y_out(t) = y_in(t - skew t);   as for a shift in time, a negative skew is read ahead only against a recording
    """

    catalogue, family, site = 26, "slow", "reading"
    neutral = {"skew": 0.0}
    identification = Identification(delay="skew", typical={"skew": (-1e-3, 0.01)})
    fingerprint = "The residual follows the velocity and grows linearly along the recording."
    confused_with = ("ThermalScrewGrowth", "DriveGainError", "ChannelTimeShift, over a short recording")
    experiment = "Two markers far apart on both clocks."
    source = "Ljung, System Identification, 2nd ed. 1999, sec. 14.1; crystal clocks: 10 to 100 ppm. Range assumed."

    incoming = Input("{signal}", doc="signal on the machine's clock")
    outgoing = Output("{signal}", doc="signal on the recorder's clock")
    held = DiscreteState("{signal}", doc="shifted signal")
    newest = DiscreteState("1", doc="place of the newest value in the history")
    history = Memory("{signal}", _SAMPLES, doc="the last samples", holds=lambda skew, duration: skew * duration)
    skew = Parameter("1", 0.0, low=-0.1, high=0.1, doc="delay gained per time")

    @staticmethod
    def update(incoming: float, newest: float, history: list[float], skew: float, sample_period: float, time: float) -> tuple[float, float]:
        place = _remember(history, newest, incoming, time)
        return _delayed(history, place, skew * time / sample_period), place

    @staticmethod
    def output(incoming: float, held: float, skew: float) -> float:
        return incoming if skew == 0.0 else held


class SampleJitter(Effect):
    """Samples taken a little early or late, at random.

    y_out = y_in + dy/dt deviation n,   n standard normal, new at each sample
    """

    catalogue, family, site = 25, "recording", "reading"
    neutral = {"deviation": 0.0}
    identification = Identification(carried=(), typical={"deviation": (10e-6, 500e-6)})
    fingerprint = "Broadband noise that grows with the speed."
    confused_with = ("noise of the sensor, which does not grow with the speed",)
    experiment = "Look at the time stamps; run at two speeds."
    source = "Kester (ed.), The Data Conversion Handbook, Newnes 2005, ch. 2 (aperture jitter). Range assumed."

    incoming = Input("{signal}", doc="signal at the sample instant")
    outgoing = Output("{signal}", doc="signal a little beside it")
    held = DiscreteState("{signal}", doc="signal as taken")
    before = DiscreteState("{signal}", doc="signal at the last sample instant")
    chance = Noise(doc="deviation of this sample")
    deviation = Parameter("s", 0.0, low=0.0, high=1.0, doc="standard deviation of the instant")

    @staticmethod
    def update(incoming: float, before: float, chance: float, deviation: float, sample_period: float, time: float) -> tuple[float, float]:
        if time > 0.0:
            return incoming + (incoming - before) * (chance * deviation / sample_period), incoming
        return incoming, incoming

    @staticmethod
    def output(incoming: float, held: float, deviation: float) -> float:
        return incoming if deviation == 0.0 else held
