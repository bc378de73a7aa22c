"""A sensor that answers late and round."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import Effect


def _filtered(incoming: float, before: float, lagged: float, time_constant: float, sample_period: float) -> float:
    """Give the lag of a signal that runs straight from ``before`` to ``incoming`` over a sample, ``lagged`` at its beginning."""
    if time_constant == 0.0:
        return incoming
    kept = math.exp(-sample_period / time_constant)
    return incoming + kept * (lagged - before) - (incoming - before) * (time_constant / sample_period) * (1.0 - kept)


class SensorFilter(Effect):
    """A low-pass filter of a sensor or its amplifier, of first or second order (two equal stages).

    T dy/dt + y = x,  and the same once more where stages = 2

    Solved exactly for a signal that is straight between samples, as a place or a speed is nearly, or with ``held`` = 1 for one that stays
    as it is until the next sample, as a current or a cutting force that is worked out of commands: taken for the other one, it would come
    half a sample late or early. Where it is put in, it is told which of the two its signal is. Left out: what happens between samples; the
    filter begins at rest on the first one.
    """

    catalogue, family, site = 32, "lag", "reading"
    late_by = "time_constant"
    told_if_held = "held"
    neutral = {"time_constant": 0.0}
    typical = {"time_constant": (0.3e-3, 20e-3)}
    typical_rotary = {"time_constant": (0.3e-3, 20e-3)}
    fingerprint = "One signal lags and is rounded, the same rising as falling; the others are in time."
    confused_with = ("TransportDelay", "ChannelTimeShift", "MotorInductance")
    experiment = "A step: a filter rounds it, a delay moves it."
    source = (
        "Beckwith, Marangoni, Lienhard, Mechanical Measurements, 6th ed. 2007, ch. 5 (first-order response); Franklin, Powell, Workman, "
        "Digital Control of Dynamic Systems, 3rd ed. 1998, sec. 6.3 (first-order hold). Range assumed."
    )

    incoming = Input("{signal}", doc="signal before the filter")
    outgoing = Output("{signal}", doc="signal after the filter")
    first = DiscreteState("{signal}", doc="first stage")
    second = DiscreteState("{signal}", doc="second stage")
    before = DiscreteState("{signal}", doc="signal one sample before")
    time_constant = Parameter("s", 0.0, low=0.0, high=10.0, doc="time constant of a stage")
    stages = Parameter("1", 1.0, low=1.0, high=2.0, doc="number of stages, 1 or 2")
    held = Parameter("1", 0.0, low=0.0, high=1.0, doc="1 where the signal is held between samples")

    @staticmethod
    def update(
        incoming: float, first: float, second: float, before: float, time_constant: float, held: float, sample_period: float, time: float
    ) -> tuple[float, float, float]:
        if time <= 0.0:
            return incoming, incoming, incoming
        end = before if held >= 0.5 and time_constant > 0.0 else incoming
        one = _filtered(end, before, first, time_constant, sample_period)
        return one, _filtered(one, first, second, time_constant, sample_period), incoming

    @staticmethod
    def output(incoming: float, first: float, second: float, time_constant: float, stages: float) -> float:
        if time_constant == 0.0:
            return incoming
        if stages < 1.5:
            return first
        return second
