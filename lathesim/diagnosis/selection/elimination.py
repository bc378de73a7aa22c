"""A model without one of its effects, the rest fitted again."""

from __future__ import annotations

from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted
from lathesim.identification.records.model import Model, is_full_band


def fewer(laboratory: Laboratory, model: Model, candidate: Candidate) -> Model:
    """Return a model without one of its candidates, judged on both recordings."""
    return laboratory.model(_rest(model, candidate), fitted_without(laboratory, model, candidate))


def fitted_without(laboratory: Laboratory, model: Model, candidate: Candidate) -> Fitted:
    """Fit the rest of a model anew."""
    free = [item for item in model.free if item.name not in candidate.parameters]
    return fit(laboratory.experiment.sensed, free, model.fitted.constant, rounds=1, full_band=is_full_band(_rest(model, candidate)))


def _rest(model: Model, candidate: Candidate) -> tuple[Candidate, ...]:
    return tuple(other for other in model.candidates if other is not candidate)
