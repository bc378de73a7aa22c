"""Backward elimination: a model without some of its effects, the rest fitted again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import is_an_event, is_of_a_clock
from lathesim.diagnosis.selection.compare_models import Gains, compare_models
from lathesim.diagnosis.selection.laboratory import Laboratory, judged_score
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution.budget import Progress
from lathesim.identification.records.candidate import Candidate, instants_of
from lathesim.identification.records.fit import Fitted
from lathesim.identification.records.model import Model, is_full_band
from lathesim.identification.replay.experiment import Experiment


def fewer(laboratory: Laboratory, model: Model, *gone: Candidate, rounds: int = 1) -> Model:
    """Return a model without some of its candidates, judged on both recordings."""
    return laboratory.model(_rest(model, gone), fitted_without(laboratory, model, *gone, rounds=rounds))


def fitted_without(laboratory: Laboratory, model: Model, *gone: Candidate, rounds: int = 1) -> Fitted:
    """Return the fit of the rest of a model."""
    names = {name for candidate in gone for name in candidate.parameters}
    free = [item for item in model.free if item.name not in names]
    return fit(laboratory.experiment.sensed, free, model.fitted.constant, rounds=rounds, full_band=is_full_band(_rest(model, gone)))


def _rest(model: Model, gone: Sequence[Candidate]) -> tuple[Candidate, ...]:
    return tuple(other for other in model.candidates if not any(other is candidate for candidate in gone))


def without_needless(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search without effects that the others have made needless, the earliest first, until none is; a lag that was a part of
    what they do and is next to nothing beside them is."""

    def is_needless(candidate: Candidate) -> bool:
        return not is_in_time(laboratory, candidate, found.model, method=method) or _is_needless(laboratory, found.model, candidate, method)

    while needless := next((candidate for candidate in found.model.candidates[:-1] if is_needless(candidate)), None):
        laboratory.progress(f"{needless.name} at {needless.at} is no longer needed")
        found = found.accepted(fewer(laboratory, found.model, needless), "drop", "no longer needed")
        found = found.taking_over(found.model.candidates[-1], needless)
    return found


def without_parts_of_a_shape(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search without effects that were a part of the finer shape of the last one, and with that explain too little to be worth a
    name."""
    for candidate in found.model.candidates[:-1]:
        without = fewer(laboratory, found.model, candidate)
        lost = without.error - found.model.error
        rest = without.error + np.maximum(laboratory.everything - laboratory.baseline_error, 0.0)
        of_all, of_rest = float(np.max(lost / laboratory.everything)), float(np.max(lost / rest))
        much = of_all > method.share_of_all and of_rest > method.share_of_rest
        if not (much or of_rest > method.nearly_all_of_rest):
            laboratory.progress(f"{candidate.name} at {candidate.at} was a part of the shape of {found.model.candidates[-1].name}")
            trials = found.trials_with({}, candidate)
            found = found.accepted(without, "drop", "a part of the shape of another effect", trials=trials)
    return found


def is_in_time(laboratory: Laboratory, candidate: Candidate, model: Model, method: Method = STANDARD) -> bool:
    """Return whether an effect that delays does so by a fair part of a sample, and whether an event comes after the recording began."""
    period = laboratory.experiment.machine.assembly.sample_period
    values, duration = model.fitted.by_name, len(laboratory.experiment.record) * period
    return is_of_a_clock(candidate, values, period, duration, method=method) and is_an_event(
        instants_of(candidate), values, duration, method=method
    )


def _is_needless(laboratory: Laboratory, model: Model, candidate: Candidate, method: Method) -> bool:
    """Return whether a model without one of its candidates loses no more than that saves, on the estimation recording."""
    without = judged_score(laboratory.experiment, fitted_without(laboratory, model, candidate))
    gains = Gains(without.above(model.score, full_band=is_full_band(model.candidates)))
    return compare_models(gains, method, effects=-1, parameters=-len(candidate.parameters)).as_good


def leave_out(
    found: SearchResult,
    candidates: Sequence[Candidate],
    experiment: Experiment,
    validation: Experiment,
    tell: Progress,
    method: Method = STANDARD,
) -> SearchResult:
    """Return a search without some effects of its model, the rest fitted again."""
    laboratory = Laboratory(experiment, validation, tell, method=method)
    laboratory.weigh(found.baseline.fitted)
    gone = [candidate for candidate in found.model.candidates if candidate in candidates]
    all_go = len(gone) == len(found.model.candidates)
    model = found.baseline if all_go else fewer(laboratory, found.model, *gone, rounds=2)
    return found.accepted(model, "drop", "not determined, or of no use")
