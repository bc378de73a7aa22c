"""Where a second sensor of one motion has its zero: nowhere near that of the first one, on most machines, which is no error of either."""

from __future__ import annotations

import numpy as np

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.identification.replay.experiment import Experiment


def sensor_zeros(experiment: Experiment, method: Method = STANDARD) -> list[str]:
    """Return a sentence for each second sensor whose zero differs from that of the first one or of the prescribed position."""
    told = []
    sensed = experiment.sensed
    for row in sorted(sensed.led):
        simulated = sensed.channel([], [], sensed.plan.channels.index(sensed.channels[row]))
        apart = sensed.recorded[row] - simulated
        apart = apart[np.isfinite(apart)] if np.isfinite(apart).any() else np.zeros(1)
        middle, spread = float(np.mean(apart)), float(np.std(apart))
        if abs(middle) > method.errors * max(spread, float(sensed.seen_floors[row])):
            shown = shown_with_unit(abs(middle), sensed.plan.unit(sensed.channels[row]), 3)
            told.append(
                f"{experiment.machine.compare[row]} has its zero {shown} beside that of the reference; taken for no error of either."
            )
    for row, (first, apart) in experiment.sensed.zeros().items():
        shown_there = experiment.sensed.seen[row][np.isfinite(experiment.sensed.seen[row])]
        spread = float(np.std(shown_there)) if len(shown_there) else 0.0
        if abs(apart) > method.errors * max(spread, float(experiment.sensed.seen_floors[row])):
            name, other = experiment.machine.compare[row], experiment.machine.compare[first]
            shown = shown_with_unit(abs(apart), experiment.sensed.plan.unit(experiment.sensed.channels[row]), 3)
            told.append(f"{name} has its zero {shown} beside that of {other}; taken for no error of either.")
    return told
