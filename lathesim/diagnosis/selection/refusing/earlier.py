"""What a recording from before a change says of an effect that explains the recording after it.

A lesson is never quite right: its laws, its steps and what warms up leave an error that some effect explains a part of. Without a
comparison only an effect that explains a fair share of the error is worth a name. With a recording of the same machine from before it
changed the comparison is there: what the lesson's errors look like, they look like in both recordings. An effect that gains as much in the
earlier one is no part of the change, and one that does not needs no further share. What was there before and is worth a name by itself
stays in the model beside the change: with a friction left out a play that came in looks like something else.
Source: Campbell, Stanley, Experimental and Quasi-Experimental Designs for Research, 1963 (a control beside a treatment rules out what both
have in common).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import believable
from lathesim.diagnosis.selection.laboratory import Earlier, Laboratory
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial
from lathesim.identification.replay.experiment import Experiment, baseline_free


def earlier_recording(experiment: Experiment, method: Method = STANDARD) -> Earlier:
    """Return a recording from before a change with the lesson as it stands fitted to it."""
    laboratory = Laboratory(experiment, experiment, lambda text: None, method=method)
    fitted = fit(experiment.sensed, [*baseline_free(experiment.machine), *experiment.start_states(experiment.sensed.plan)], rounds=3)
    laboratory.weigh(fitted)
    return Earlier(laboratory, laboratory.model((), fitted))


def was_there_before(laboratory: Laboratory, candidate: Candidate, model: Model, gain: float, method: Method) -> bool:
    """Return whether the larger part of the ``gain`` [nats] of an effect of a model is gained before the change too.

    Gains add up over samples, so that of the earlier recording is taken for as many samples as were fitted.
    """
    earlier = laboratory.earlier
    if earlier is None:
        return False
    if candidate.part not in earlier.gains:
        values = model.fitted.by_name
        starts = [np.array([values[name] for name in candidate.parameters]), *candidate.points[:1]]
        trial = earlier.laboratory.trial(earlier.baseline, candidate, (), earlier.baseline.free, starts)
        earlier.gains[candidate.part] = trial.gain * _samples(laboratory.experiment) / _samples(earlier.laboratory.experiment)
    return earlier.gains[candidate.part] > method.shared.larger_part * gain


def is_old_and_small(laboratory: Laboratory, trial: Trial, settled: Model, null_maximum: float, method: Method) -> bool:
    """Return whether an effect was there before the change, and would not be believed without a recording from before it."""
    alone = method.without_earlier
    return (
        alone is not None
        and was_there_before(laboratory, trial.candidate, settled, trial.gain, method)
        and not believable(trial, alone, null_maximum)
    )


def note_what_was_there(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search with the effects of its model marked that were there before the change."""
    there = set(found.there_before)
    for candidate in found.model.candidates:
        trial = found.trial_of(candidate)
        if trial is not None and was_there_before(laboratory, candidate, found.model, trial.gain, method):
            there.add(candidate.part)
    return replace(found, there_before=frozenset(there))


def _samples(experiment: Experiment) -> float:
    """Return how many samples of an experiment are fitted."""
    return float(len(experiment.record) if experiment.weights is None else np.sum(experiment.weights))
