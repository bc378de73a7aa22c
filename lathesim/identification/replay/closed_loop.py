"""The lesson's own simulation, in which nothing recorded holds anything: its channels with some values, and how far it stays off."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.identification.replay.experiment import Experiment

SETTLING = 0.02
"""Share of a recording at its beginning that is left out of residuals: controllers start with memories that nobody recorded."""


def own_run(experiment: Experiment, values: Mapping[str, float]) -> FloatArray:
    """Return the channels (channels, samples) of the lesson's own simulation with some values."""
    names = experiment.own.settable(values)
    (run,) = experiment.own.outputs(names, np.array([[values[name] for name in names]]))
    return np.asarray(run)


def own_error(experiment: Experiment, values: Mapping[str, float]) -> float:
    """Return the squared error of the lesson's own simulation with some values, in squared floors, summed over channels and samples."""
    error = _known(experiment, experiment.sensed.as_seen(own_run(experiment, values)))[:, int(SETTLING * experiment.own.samples) :]
    return float(np.sum((np.nan_to_num(error, nan=np.inf) / experiment.sensed.seen_floors[:, None]) ** 2))


def _known(experiment: Experiment, simulated: FloatArray) -> FloatArray:
    """Return recorded less simulated, zero where nothing was recorded."""
    return np.where(np.isfinite(experiment.sensed.seen), experiment.sensed.seen - simulated, 0.0)
