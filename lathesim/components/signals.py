"""Parts that pass a signal on: as it was recorded, scaled, or late."""

from __future__ import annotations

import math
from typing import Any

from lathesim.component import ON, Component, DiscreteState, Input, Memory, Output, Parameter, Table

_CLOCK = 1e-9
"""Rounding of the clock [s]."""
_AROUND = 4.0
"""Cells of a ring that a cubic between two of them takes."""

TIME = 0
VALUE = 1


class RecordedSignal(Component):
    """Gives a recorded signal again: the table's value at the present time, held from row to row or along straight lines between them.

    ``samples`` has the columns time [s], rising, and value. ``interpolation`` 0 holds (what a converter does), 1 joins by lines, at every
    integration stage. Before the first row the first value stands, after the last the last. Left out: resampling and filtering.
    """

    group = "converters"

    ports = {"reading": "signal"}

    samples = Table("1", ("time", "value"), doc="time and value of each row, time rising")
    interpolation = Parameter("1", 0.0, low=0.0, high=1.0, doc="0 holds each value, 1 joins them by lines")
    shift = Parameter("s", 0.0, doc="how much later the signal is played")

    row = DiscreteState("1", doc="row at or before the present sample")

    signal = Output("{signal}", doc="the recorded signal")

    @staticmethod
    def update(samples: Any, row: float, shift: float, time: float) -> float:
        """Find the row of this sample; rounding of the clock by a billionth of a second is forgiven."""
        position = int(row)
        while position + 1 < len(samples) and samples[position + 1][TIME] + shift <= time + _CLOCK:
            position += 1
        return position * 1.0

    @staticmethod
    def output(samples: Any, row: float, interpolation: float, shift: float, time: float) -> float:
        rows = len(samples)
        if rows == 0:
            return 0.0
        position = int(row)
        value = float(samples[position][VALUE])
        if interpolation < ON:
            return value
        while position + 1 < rows and samples[position + 1][TIME] + shift <= time:
            position += 1
        begin = samples[position][TIME] + shift
        if position + 1 >= rows or time <= begin:
            return float(samples[position][VALUE])
        share = (time - begin) / (samples[position + 1][TIME] + shift - begin)
        return float(samples[position][VALUE] + share * (samples[position + 1][VALUE] - samples[position][VALUE]))


class ScaledValue(Component):
    """Gives a multiple of a value:  outgoing = factor incoming.

    Where a template feeds one value to two axes, this part between them gives the second axis a value of its own. Source: none needed.
    """

    group = "controllers"

    incoming = Input("{signal}", doc="the value that is followed")
    factor = Parameter("1", 1.0, low=0.0, doc="how many times as large")
    outgoing = Output("{signal}", doc="the multiple")

    @staticmethod
    def output(incoming: float, factor: float) -> float:
        return factor * incoming


_CELLS = 256
_DIVERGED = 1e9
"""Size in SI of a signal that has left every machine; assumed."""


class DelayLine(Component):
    """Gives a continuous signal as it was some time ago:  y(t) = u(t - d).

    The signal is written into a ring at each sample instant. Between two instants y is the cubic through the four stored values around
    t - d, evaluated at the time of each Runge-Kutta stage. Its error falls with the fourth power of the sample period. So RK4 keeps its
    order where the delay is one sample period or more, each sample is one step and the signal is smooth. Where its slope jumps, that one
    step has order two. A shorter delay extrapolates the cubic.

    Before the start the signal had its first value. The ring is as long as the delay. One that comes by a wire and is longer than the
    ring gives no number, and the run names it; the template's ``memory:`` makes the ring longer. A loop whose delay is too long swings up
    without bounds: from 1e9 on the line gives no number either, so that the run says where it broke.

    Source: Bellen and Zennaro, Numerical Methods for Delay Differential Equations (2003), section 4.1 (interpolants of the order of the
    method). Left out: values between the samples where a sample has several steps.
    """

    group = "controllers"

    incoming = Input("{signal}", doc="signal now")
    outgoing = Output("{signal}", doc="signal as it was one delay ago")
    delay = Parameter("s", 1e-3, low=0.0, doc="d: how late it arrives")
    history = Memory("{signal}", _CELLS, doc="values at the last sample instants", holds=lambda delay: delay)

    newest = DiscreteState("1", doc="place of the newest value in the ring")
    began = DiscreteState("s", doc="the last sample instant")
    offset = DiscreteState("1", doc="samples from the latest of the four values to t - d at that instant")
    latest = DiscreteState("{signal}", doc="latest of the four values")
    first = DiscreteState("{signal}", doc="their first backward difference")
    second = DiscreteState("{signal}", doc="half their second backward difference")
    third = DiscreteState("{signal}", doc="a sixth of their third backward difference")

    @staticmethod
    def update(
        incoming: float, history: list[float], newest: float, delay: float, time: float, sample_period: float
    ) -> tuple[float, float, float, float, float, float, float]:
        """Store this value, and take the cubic for the sample that begins."""
        cells = len(history)
        place = int(newest)
        if time <= 0.0:
            for cell in range(cells):
                history[cell] = incoming
        else:
            place += 1
            if place >= cells:
                place = 0
            history[place] = incoming
        late = delay / sample_period
        if not late <= cells - _AROUND or not abs(incoming) < _DIVERGED:
            return place * 1.0, time, math.nan, math.nan, math.nan, math.nan, math.nan
        back = max(0, int(late - 1.5))
        at = place - back
        if at < 0:
            at += cells
        newer = history[at]
        at = at - 1 if at > 0 else cells - 1
        new = history[at]
        at = at - 1 if at > 0 else cells - 1
        old = history[at]
        at = at - 1 if at > 0 else cells - 1
        older = history[at]
        second = newer - 2.0 * new + old
        third = second - (new - 2.0 * old + older)
        return place * 1.0, time, late - back, newer, newer - new, second / 2.0, third / 6.0

    @staticmethod
    def output(
        incoming: float, began: float, offset: float, latest: float, first: float, second: float, third: float, delay: float, time: float,
        sample_period: float,
    ) -> float:  # fmt: skip
        """The cubic in Newton's backward form."""
        if delay == 0.0:
            return incoming
        share = (time - began) * (1.0 / sample_period) - offset
        return latest + share * (first + (share + 1.0) * (second + (share + 2.0) * third))
