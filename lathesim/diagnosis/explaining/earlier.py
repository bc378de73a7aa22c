"""What a recording from before a change says of an effect that explains the recording after it.

An effect that the earlier recording shows as much as the later one is no part of the change: the errors of the lesson look alike in both.
Source: Campbell, Stanley, Experimental and Quasi-Experimental Designs for Research, 1963 (a control beside a treatment).
"""

from __future__ import annotations

import numpy as np

from lathesim.diagnosis.explaining.density import gain
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.records.found import Tried
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records import is_full_band, with_start
from lathesim.identification.replay.experiment import Experiment, baseline_free


def was_there_before(study: Study, trial: Tried) -> bool:
    """Return whether the larger part of what an effect gains is gained before the change too; never without an earlier recording.

    Gains add up over samples, so that of the earlier recording is taken for as many samples as were fitted.
    """
    experiment = study.earlier
    if experiment is None:
        return False
    candidates = trial.model.candidates
    names = {name for candidate in candidates for name in candidate.parameters}
    own = [*baseline_free(experiment.machine), *experiment.start_states(experiment.sensed.plan)]
    effects = [one for one in with_start(trial.model.fitted) if one.name in names]
    with_effect = fit(experiment.sensed, [*own, *effects], rounds=2, full_band=is_full_band(candidates))
    gone = set(trial.candidate.parameters)
    rest = [one for one in with_start(with_effect) if one.name not in gone]
    left = fit(experiment.sensed, rest, rounds=2, full_band=is_full_band(candidates))
    before = gain(with_effect, left, full_band=is_full_band(candidates)).nats * _samples(study.estimation) / _samples(experiment)
    return before > study.method.larger_part * trial.fitted.nats


def _samples(experiment: Experiment) -> float:
    """Return how many samples of an experiment are fitted."""
    return float(len(experiment.record) if experiment.weights is None else np.sum(experiment.weights))
