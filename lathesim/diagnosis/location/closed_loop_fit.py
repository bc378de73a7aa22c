"""The lesson's closed-loop simulation beside a recording, without and with what was found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.records.diagnosis import ChannelFit
from lathesim.engine.assembly import FloatArray
from lathesim.engine.wiring import Plan
from lathesim.identification.replay.closed_loop import SETTLING
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal.analysis import root_mean_square
from lathesim.identification.signal.rounding import LARGER_PART


@dataclass(frozen=True)
class Compared:
    """The lesson's own simulation held against a recording: simulated channels (channels, samples) without and with what was found."""

    before: FloatArray
    after: FloatArray
    fit: dict[str, ChannelFit]


def compared(experiment: Experiment, before: Mapping[str, float], after: Mapping[str, float]) -> Compared:
    """Simulate the lesson with two sets of values and compare both with the recording."""
    names = experiment.own.settable([*before, *after])
    plan = experiment.own.plan
    values = {name: _own_value(plan, name) for name in names}
    rows = np.array([[{**values, **chosen}[name] for name in names] for chosen in (before, after)])
    first, second = (experiment.sensed.from_zero_of(run) for run in experiment.own.outputs(names, rows))
    begin = int(SETTLING * experiment.own.samples)
    fits: dict[str, ChannelFit] = {}
    for row, name in enumerate(experiment.machine.compare):
        recorded, floor = experiment.own.recorded[row], experiment.floors[name]
        sizes = [root_mean_square(_counted(experiment, recorded - simulated[row])[begin:]) for simulated in (first, second)]
        fits[name] = ChannelFit(plan.unit(experiment.own.channels[row]), floor, sizes[0], sizes[1], experiment.name)
    return Compared(first, second, fits)


def _counted(experiment: Experiment, values: FloatArray) -> FloatArray:
    """Return values (samples,) without those that do not count."""
    return values if experiment.weights is None else np.where(experiment.weights > LARGER_PART, values, np.nan)


def _own_value(plan: Plan, name: str) -> float:
    parameters, states = plan.parameters, plan.states
    return float(plan.parameter_values[parameters[name]] if name in parameters else plan.start_states[states[name]])
