"""A model without one of its effects, the rest fitted again."""

from __future__ import annotations

from lathesim.diagnosis.selection.laboratory import Bench
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.fit import Fitted
from lathesim.identification.records.model import Model, is_wide


def fewer(bench: Bench, model: Model, term: Term) -> Model:
    """Give a model without one of its terms, judged on both recordings."""
    return bench.model(_rest(model, term), fitted_without(bench, model, term))


def fitted_without(bench: Bench, model: Model, term: Term) -> Fitted:
    """Fit the rest of a model anew."""
    free = [item for item in model.free if item.name not in term.parameters]
    return fit(bench.rig.sensed, free, model.fitted.constant, rounds=1, wide=is_wide(_rest(model, term)))


def _rest(model: Model, term: Term) -> tuple[Term, ...]:
    return tuple(other for other in model.terms if other is not term)
