"""Whether a search began with the wrong effect: a greedy one takes the best first one, and two others may do more together.

Where something explains most of what is left and is not believed beside what was found, a wrong beginning is a likely reason. It is tried
in the place of each effect that was found, and the search is done again from each of the next best beginnings. Where values of the lesson
are implausible to the end, two effects may have drawn them, neither of which eases them alone: what is not believed beside them is taken in
for once, and counts if nothing is implausible any more in the end. Source: Miller, Subset Selection in Regression, 2nd ed., 2002, section
3.8 (replacing what was selected early).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.candidates.harmonics import is_part_of_a_wave
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import believable, merit, simplest
from lathesim.diagnosis.selection.compare_models import Gains, ModelComparison, compare_models, further_parameters, gains_over
from lathesim.diagnosis.selection.elimination import fewer
from lathesim.diagnosis.selection.laboratory import Laboratory, is_implausible
from lathesim.identification.records.model import Trial


def restarts(laboratory: Laboratory, found: SearchResult, method: Method) -> Iterator[SearchResult]:
    """Return searches to be gone on with that begin otherwise; none where nothing that is not believed does much."""
    if is_implausible(found.model.fitted, method=method) and (drawn := _despite_implausible_values(found, method)):
        yield SearchResult(found.baseline, drawn.model, {**found.trials, drawn.candidate.part: [drawn]}, to_ease=True)
    refused = _refused(found, method)
    if refused is None or not found.model.candidates:
        return
    for trial in _exchanged(laboratory, found, refused):
        if believable(trial, method, found.null_maximum):
            yield SearchResult(found.baseline, trial.model, {**found.trials, trial.candidate.part: [trial]})
    for trial in [trial for trial in found.restarted_from if trial.candidate.part not in found.excluded][: method.selection.most_rivals]:
        yield SearchResult(found.baseline, trial.model, {trial.candidate.part: [trial]})


def _refused(found: SearchResult, method: Method) -> Trial | None:
    """Return what explains most of what the effects that were found leave, moves a channel by more than the rest there, and is not believed
    beside them; nothing where a part of a wave that was found explains more. What is lost in the rest is no sign of a wrong beginning."""
    there = found.model.candidates
    asked = [trial for trial in found.tried if trial.candidate.part not in found.excluded]
    beside = [trial for trial in asked if trial.model.candidates[:-1] == there and trial.candidate not in there]
    gaining = [trial for trial in beside if compare_models(Gains(trial.gain, trial.validation_gain), method, effects=1).better]
    much = [trial for trial in gaining if trial.share_of_rest > method.shared.larger_part and trial.moves > method.smallest_move]
    most = max(much, key=lambda trial: trial.share_of_rest, default=None)
    return None if most is None or is_part_of_a_wave(most, found.model, method=method) else most


def _despite_implausible_values(found: SearchResult, method: Method) -> Trial | None:
    """Return the best of what would be believed beside the effects that were found, were no value of the lesson implausible."""
    at_given_values = replace(method, despite_implausible_values=True)
    beside = [
        trial
        for trial in found.tried
        if trial.model.candidates[:-1] == found.model.candidates and trial.candidate.part not in found.excluded
    ]
    good = [trial for trial in beside if trial.implausible and believable(trial, at_given_values, found.null_maximum)]
    good = [trial for trial in good if not is_part_of_a_wave(trial, found.model, method=method)]
    return simplest(sorted(good, key=lambda trial: -merit(trial, method)), method) if good else None


def _exchanged(laboratory: Laboratory, found: SearchResult, refused: Trial) -> Iterator[Trial]:
    """Return trials of what was refused in the place of each effect of the model."""
    values = refused.model.fitted.by_name
    start = np.array([values[name] for name in refused.candidate.parameters])
    for candidate in found.model.candidates:
        before = fewer(laboratory, found.model, candidate)
        yield laboratory.trial(before, refused.candidate, before.candidates, before.free, [start])


def comparison_of_starts(other: SearchResult, found: SearchResult, method: Method) -> ModelComparison | None:
    """Return how another model compares with the one that was found, where it explains both recordings better by more than the parameters
    cost that it has more, and has come to what it was begun for; none where it does not."""
    if other.to_ease and is_implausible(other.model.fitted, method=method):
        return None
    more = max(further_parameters(other.model, found.model), 0)
    gains = gains_over(other.model, found.model, full_band=True)
    comparison = compare_models(gains, method, effects=1, parameters=more)
    return comparison if comparison.better else None
