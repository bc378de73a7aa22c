"""Lines that a spindle leaves in a force: what is left in the cut, against the angle of the spindle, in orders."""

from __future__ import annotations

import math

import numpy as np

from lathesim.diagnosis.location.missing_force import missing_signal
from lathesim.diagnosis.location.operating_conditions import turns
from lathesim.diagnosis.location.order_spectrum import Line, lines_of
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import Experiment


def turn_lines(experiment: Experiment, fitted: Fitted, method: Method = STANDARD) -> list[tuple[str, str, int, Line]]:
    """Return the lines at whole orders: channel, part, order, and the line against the angle [rad]."""
    found = []
    for part, (angle, inside) in turns(experiment).items():
        for row, channel in enumerate(experiment.machine.compare):
            left = missing_signal(experiment, fitted, row).values[inside]
            steady = slice(len(left) // 10, None)
            trend = np.polynomial.Polynomial.fit(angle[inside][steady], left[steady], 3)
            lines, _ = lines_of(left[steady] - trend(angle[inside][steady]), {"angle": ("rad", angle[inside][steady])}, method=method)
            for line in lines:
                order = 2.0 * math.pi * line.frequency
                if round(order) >= 1 and abs(order - round(order)) < method.location.whole_order * round(order):
                    found.append((channel, part, round(order), line))
    return found


def told(lines: list[tuple[str, str, int, Line]], units: dict[str, str]) -> list[str]:
    """Return a sentence for each line."""
    often = {1: "once", 2: "twice"}
    return [
        f"A line {often.get(order, f'{order} times')} per turn of the spindle, {line.amplitude:.3g} {units[channel]}, is left at {channel} "
        f"(in the cut of {part})."
        for channel, part, order, line in lines
    ]
