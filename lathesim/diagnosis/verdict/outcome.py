"""What a search found, in the form that the answer is drawn from."""

from __future__ import annotations

from lathesim.diagnosis.explaining.search import Found
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explaining.trial import Tried
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.verdict.decision import far_off
from lathesim.identification.records.model import Trial


def as_search_result(study: Study, found: Found) -> SearchResult:
    """Return the search with every trial."""
    off = far_off(found)
    trials = {
        candidate.part: [_trial(one) for one in (found.worth.get(candidate.part), *found.rivals.get(candidate.part, ())) if one is not None]
        for candidate in found.model.candidates
    }
    return SearchResult(
        baseline=found.baseline,
        model=found.model,
        trials=trials,
        tried=tuple(map(_trial, found.tried)),
        jointly_off=off,
        complete=found.complete,
        history=found.history,
        there_before=found.there_before,
    )


def _trial(one: Tried) -> Trial:
    return Trial(one.candidate, one.model, one.fitted.nats, one.predicted.nats, one.predicted.error, one.predicted.share)
