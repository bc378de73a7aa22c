"""A signal that was recorded, played back."""

from __future__ import annotations

from typing import Any

from lathesim.component import Component, DiscreteState, Output, Parameter, Table

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
        while position + 1 < len(samples) and samples[position + 1][TIME] + shift <= time + 1e-9:
            position += 1
        return position * 1.0

    @staticmethod
    def output(samples: Any, row: float, interpolation: float, shift: float, time: float) -> float:
        """Hold, or go on along the line to the next row."""
        rows = len(samples)
        if rows == 0:
            return 0.0
        position = int(row)
        value = float(samples[position][VALUE])
        if interpolation < 0.5:
            return value
        while position + 1 < rows and samples[position + 1][TIME] + shift <= time:
            position += 1
        begin = samples[position][TIME] + shift
        if position + 1 >= rows or time <= begin:
            return float(samples[position][VALUE])
        share = (time - begin) / (samples[position + 1][TIME] + shift - begin)
        return float(samples[position][VALUE] + share * (samples[position + 1][VALUE] - samples[position][VALUE]))
