"""An effect with no more values than the recordings show: one that vanishes with a value held at nothing, and is as good, does without it.

A friction that also has a peak at low speed is sure of the sum of both, and of neither by itself: its level is then no surer than the peak
that is not there. Backward elimination, one value after the other, as with effects. Source: Ljung, System Identification, 2nd ed. 1999,
section 16.4 (the smallest of the models that fit as well).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lathesim.diagnosis.records.diagnosis import listed
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.laboratory import Bench
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.fit import Fitted, with_start
from lathesim.identification.records.model import Model, is_wide

SURELY = 3.0
"""Standard errors from which on a value of a finer shape is there."""
_AS_GOOD = 3.0
"""Nats that a value must be worth on the fitted or on the held-out recording."""


def drop_needless_values(bench: Bench, found: Found) -> None:
    """Hold at nothing the values of effects that neither recording needs, and with each those that say something of it alone."""
    for term in found.model.terms:
        spared: list[str] = []
        while (leaner := _without_the_most_needless(bench, found.model, _there(found.model, term))) is not None:
            found.model, names = leaner
            spared += [name.partition(".")[2] for name in names]
        if spared:
            bench.say(f"{term.name} at {term.at} is as good without {listed(spared)}")
            found.model = bench.settled(found.model)


def _there(model: Model, term: Term) -> Term:
    return next(other for other in model.terms if other.part == term.part)


def _without_the_most_needless(bench: Bench, model: Model, term: Term) -> tuple[Model, list[str]] | None:
    """Give the model without the value of a term that it misses least, and the names of what went; none where it misses each."""
    best: tuple[Model, list[str]] | None = None
    for name, nothing in _may_be_held(term, model.fitted):
        leaner, names = _held(bench, model, term, name, nothing)
        if is_as_good(leaner, model) and (best is None or leaner.score.above(best[0].score, wide=is_wide(model.terms)) > 0.0):
            best = leaner, names
    return best


def is_as_good(leaner: Model, model: Model) -> bool:
    """Say whether a model with fewer values loses next to nothing of a model's likelihood, on either recording."""
    wide = is_wide(model.terms)
    return max(model.score.above(leaner.score, wide=wide), model.held_out.above(leaner.held_out, wide=wide)) < _AS_GOOD


def _unsure_shape(term: Term, fitted: Fitted) -> Iterator[str]:
    """Give the values of a finer shape that may well be nothing."""
    for name in term.parameters:
        if (
            name.partition(".")[2] in term.effect.finer_shape
            and name not in term.spare
            and abs(fitted.by_name[name]) < SURELY * fitted.error(name)
        ):
            yield name


def _may_be_held(term: Term, fitted: Fitted) -> Iterator[tuple[str, float]]:
    """Give the values that may be nothing with the effect still there, and what is nothing: those that are so unless they are given, and
    those of its sizes beside which another one makes it felt."""
    sizes = [name for name in term.parameters if name.partition(".")[2] in term.effect.neutral]
    if len(sizes) > 1:
        yield from ((name, float(term.effect.neutral[name.partition(".")[2]])) for name in sizes)
    yield from ((name, 0.0) for name in term.spare)
    yield from ((name, 0.0) for name in _unsure_shape(term, fitted))


def _held(bench: Bench, model: Model, term: Term, name: str, nothing: float) -> tuple[Model, list[str]]:
    """Give the model with a value of a term held at nothing, and the names of what nothing shows any more."""
    names = [name]
    constant = {**model.fitted.constant, name: nothing}
    free = [item for item in with_start(model.fitted) if item.name != name]
    fitted = fit(bench.rig.sensed, free, constant, rounds=1, wide=is_wide(model.terms))
    assert fitted.sensitivity is not None
    silent = {item.name for item, slope in zip(fitted.free, fitted.sensitivity, strict=True) if not np.any(slope)}
    names += [other for other in term.parameters if other in silent]
    if len(names) > 1:
        rest = [item for item in with_start(fitted) if item.name not in names]
        constant |= {other: fitted.by_name[other] for other in names}
        fitted = fit(bench.rig.sensed, rest, constant, rounds=1, wide=is_wide(model.terms))
    leaner = term.keeping([other for other in term.parameters if other not in names])
    terms = tuple(leaner if other is term else other for other in model.terms)
    return bench.model(terms, fitted), names
