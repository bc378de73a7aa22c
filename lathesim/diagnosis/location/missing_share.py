"""How much of what acts at a part is missing from the simulation."""

from __future__ import annotations

import math

import numpy as np

from lathesim.diagnosis.location.missing_force import missing_signal
from lathesim.diagnosis.records.diagnosis import (
    MissingSignal,
)
from lathesim.engine.assembly import FloatArray
from lathesim.identification.machine.roles import acting
from lathesim.identification.records.fit import Fitted
from lathesim.identification.records.model import Model
from lathesim.identification.replay.experiment import Experiment


def missing_share(experiment: Experiment, fitted: Fitted, row: int) -> tuple[float, FloatArray]:
    """Return the missing signal's size as a share of what acts there, and what acts there (samples,)."""
    missing = missing_signal(experiment, fitted, row)
    sources = dict(acting(experiment.sensed.plan.assembly))
    part = missing.at.partition(".")[0]
    source = next((output for target, output in sources.items() if target.partition(".")[0] == part), "")
    if missing.at == experiment.machine.compare[row] or source not in experiment.sensed.plan.channels:
        total = np.nan_to_num(experiment.sensed.recorded[row])
        total = total - float(np.mean(total))
    else:
        names = list(fitted.by_name)
        position = experiment.sensed.plan.channels.index(source)
        total = experiment.sensed.channel(names, [fitted.by_name[name] for name in names], position)
    size = float(np.sqrt(np.mean(total**2)))
    left = float(np.sqrt(np.mean(missing.values**2)))
    # beside nothing that acts anything is without end, and nothing is no share
    return (left / size if size > 0.0 else math.inf if left > 0.0 else math.nan), total


def missing_signals(validation: Experiment, before: Model, after: Model) -> tuple[MissingSignal, ...]:
    """Return what is missing behind each channel on the validation recording, before and after."""
    result: list[MissingSignal] = []
    for row in range(len(validation.machine.compare)):
        first = missing_signal(validation, before.validation_fit, row)
        second = missing_signal(validation, after.validation_fit, row)
        share_before, total = missing_share(validation, before.validation_fit, row)
        share_after, _ = missing_share(validation, after.validation_fit, row)
        time = validation.record.time
        result.append(MissingSignal(first.at, first.unit, time, first.values, second.values, total, share_before, share_after))
    return tuple(result)


FORCES = ("N", "N*m")
"""Units in which what is missing at a part is a force."""
