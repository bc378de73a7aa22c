"""A model without one of its effects, the rest fitted again."""

from __future__ import annotations

from lathesim.diagnosis.fit import Fitted, fit
from lathesim.diagnosis.terms import Term
from lathesim.diagnosis.trial import Bench, Model, is_wide


def fewer(bench: Bench, model: Model, term: Term) -> Model:
    """Give a model without one of its terms, judged on both recordings."""
    return bench.model(_rest(model, term), fitted_without(bench, model, term))


def fitted_without(bench: Bench, model: Model, term: Term) -> Fitted:
    """Fit the rest of a model anew."""
    free = [item for item in model.free if item.name not in term.parameters]
    return fit(bench.rig.sensed, free, model.fitted.constant, rounds=1, wide=is_wide(_rest(model, term)))


def _rest(model: Model, term: Term) -> tuple[Term, ...]:
    return tuple(other for other in model.terms if other is not term)
