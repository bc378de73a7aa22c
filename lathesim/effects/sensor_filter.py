"""A sensor that answers late and round."""

from __future__ import annotations

import math

from lathesim.component import DiscreteState, Input, Output, Parameter
from lathesim.effects.effect import Effect
from lathesim.effects.identification import Identification


def _filtered(incoming: float, before: float, lagged: float, time_constant: float, sample_period: float) -> float:
    """Return the lag of a signal that runs straight from ``before`` to ``incoming`` over a sample, ``lagged`` at its beginning."""
    if time_constant == 0.0:
        return incoming
    kept = math.exp(-sample_period / time_constant)
    return incoming + kept * (lagged - before) - (incoming - before) * (time_constant / sample_period) * (1.0 - kept)


class SensorFilter(Effect):
    """A low-pass filter of a sensor or its amplifier: one stage of first order, or up to four one after the other.

    T_k dy_k/dt + y_k = y_(k-1),   T_k = time_constant max(0, min(1, stages - k + 1)),   k = 1 ... 4

    With 2.3 stages there are two equal ones and one of 0.3 of their time constant.

    Solved exactly for a signal that is straight between samples, as a place or a speed is nearly, or with ``held`` = 1 for one that stays
    as it is until the next sample, as a current or a cutting force that is worked out of commands: taken for the other one, it would come
    half a sample late or early. Where it is put in, it is told which of the two its signal is. Left out: what happens between samples; a
    resonant filter; the filter begins at rest on the first sample.
    """

    catalogue, family, site = 32, "lag", "reading"
    neutral = {"time_constant": 0.0}
    identification = Identification(
        delay="time_constant",
        held_flag="held",
        typical={"time_constant": (0.3e-3, 20e-3), "stages": (1.0, 4.0)},
        typical_rotary={"time_constant": (0.3e-3, 20e-3), "stages": (1.0, 4.0)},
        extended=("stages",),
    )
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
    third = DiscreteState("{signal}", doc="third stage")
    fourth = DiscreteState("{signal}", doc="fourth stage")
    before = DiscreteState("{signal}", doc="signal one sample before")
    time_constant = Parameter("s", 0.0, low=0.0, high=10.0, doc="time constant of a stage")
    stages = Parameter("1", 1.0, low=1.0, high=4.0, doc="number of stages")
    held = Parameter("1", 0.0, low=0.0, high=1.0, doc="1 where the signal is held between samples")

    @staticmethod
    def update(
        incoming: float,
        first: float,
        second: float,
        third: float,
        fourth: float,
        before: float,
        time_constant: float,
        stages: float,
        held: float,
        sample_period: float,
        time: float,
    ) -> tuple[float, float, float, float, float]:
        if time <= 0.0 or time_constant == 0.0:
            return incoming, incoming, incoming, incoming, incoming
        end = before if held >= 0.5 else incoming
        one = _filtered(end, before, first, time_constant, sample_period)
        if stages <= 1.0:
            return one, one, one, one, incoming
        two = _filtered(one, first, second, time_constant * min(stages - 1.0, 1.0), sample_period)
        three = _filtered(two, second, third, time_constant * max(0.0, min(stages - 2.0, 1.0)), sample_period)
        return one, two, three, _filtered(three, third, fourth, time_constant * max(0.0, stages - 3.0), sample_period), incoming

    @staticmethod
    def output(incoming: float, fourth: float, time_constant: float) -> float:
        if time_constant == 0.0:
            return incoming
        return fourth
