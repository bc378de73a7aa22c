"""Whether two channels of a recording are exchanged."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.recording_checks.controllers import unexplained_share
from lathesim.identification.replay.experiment import SETTLING, Experiment
from lathesim.identification.signal import root_mean_square


def exchanged_with(experiment: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> str:
    """Return a sentence where another channel is the command that a controller makes of what it was given, and its own is not: two columns
    are exchanged, though their units differ. The text is empty where none is."""
    if not experiment.machine.replay:
        return ""
    begin = int(SETTLING * experiment.sensed.samples)
    simulated = np.nan_to_num(experiment.sensed.recorded - experiment.sensed.one(values))[:, begin:]
    recorded = np.nan_to_num(experiment.sensed.recorded)[:, begin:]
    for row, share in unexplained_share(experiment, values):
        name = experiment.machine.compare[row]
        for other, column in enumerate(recorded):
            size = float(np.std(column))
            if other != row and share > method.little and size > 0.0 and root_mean_square(column - simulated[row]) < method.little * size:
                exchanged = experiment.machine.compare[other]
                return (
                    f"{exchanged} is what the lesson's controller makes of what it was given, and {share:.0%} of {name} "
                    "is not: the two look swapped. Exchange their columns in the lesson."
                )
    return ""


def swapped(experiment: Experiment, values: Mapping[str, float], method: Method = STANDARD) -> str:
    """Return a sentence where two channels of one unit are what the machine with ``values`` makes of each other; empty where none are."""
    recorded = np.nan_to_num(experiment.sensed.recorded)
    simulated = recorded - np.nan_to_num(experiment.sensed.one(values))
    units = [experiment.record.channels[name].unit for name in experiment.machine.compare]
    power = np.maximum(np.sum(recorded**2, axis=1), 1e-60)
    off = np.sum((recorded[:, None] - simulated[None]) ** 2, axis=2) / power[:, None]
    for first, second in itertools.combinations(range(len(units)), 2):
        as_mapped, exchanged = off[first, first] + off[second, second], off[first, second] + off[second, first]
        if units[first] == units[second] and as_mapped > method.little and exchanged < method.little * as_mapped:
            names = f"{experiment.machine.compare[first]} and {experiment.machine.compare[second]}"
            return (
                f"{names} look swapped: as mapped the machine misses {np.sqrt(0.5 * as_mapped):.0%} of them, exchanged "
                f"{np.sqrt(0.5 * exchanged):.0%}. Exchange their columns in the lesson."
            )
    return ""
