"""An effect with no more values than the recordings show: one that vanishes with a value held at nothing, and is as good, does without it.

A friction that also has a peak at low speed is sure of the sum of both, and of neither by itself: its level is then no surer than the peak
that is not there. Backward elimination, one value after the other, as with effects. Source: Ljung, System Identification, 2nd ed. 1999,
section 16.4 (the smallest of the models that fit as well).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import listed
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.compare_models import compare_models, further_parameters, gains_over
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted, with_start
from lathesim.identification.records.model import Model, is_full_band


def fix_parameters(laboratory: Laboratory, found: SearchResult, method: Method = STANDARD) -> SearchResult:
    """Return the search with the values of effects held at nothing that neither recording needs, and with each those that say something of
    it alone."""
    for candidate in found.model.candidates:
        model, spared = found.model, list[str]()
        while (leaner := _without_the_most_needless(laboratory, model, _there(model, candidate), method=method)) is not None:
            model, names = leaner
            spared += [name.partition(".")[2] for name in names]
        if spared:
            laboratory.progress(f"{candidate.name} at {candidate.at} is as good without {listed(spared)}")
            found = found.accepted(laboratory.settled(model), "fix parameters", f"as good without {listed(spared)}")
    return found


def _there(model: Model, candidate: Candidate) -> Candidate:
    return next(other for other in model.candidates if other.part == candidate.part)


def _without_the_most_needless(
    laboratory: Laboratory, model: Model, candidate: Candidate, method: Method = STANDARD
) -> tuple[Model, list[str]] | None:
    """Return the model without the value of a candidate that it misses least, and the names of what went; none where it misses each."""
    best: tuple[Model, list[str]] | None = None
    for name, nothing in _may_be_held(candidate, model.fitted, method=method):
        leaner, names = _held(laboratory, model, candidate, name, nothing)
        if is_as_good(leaner, model, method=method) and (
            best is None or leaner.score.above(best[0].score, full_band=is_full_band(model.candidates)) > 0.0
        ):
            best = leaner, names
    return best


def is_as_good(leaner: Model, model: Model, method: Method = STANDARD) -> bool:
    """Return whether a model with fewer values loses next to nothing of a model's likelihood, on either recording."""
    gains = gains_over(leaner, model, full_band=is_full_band(model.candidates))
    return compare_models(gains, method, parameters=further_parameters(leaner, model)).as_good


def _unsure_shape(candidate: Candidate, fitted: Fitted, method: Method = STANDARD) -> Iterator[str]:
    """Return the values of a finer shape that may well be nothing."""
    for name in candidate.parameters:
        if (
            name.partition(".")[2] in candidate.effect.identification.extended
            and name not in candidate.spare
            and abs(fitted.by_name[name]) < method.selection.significant * fitted.error(name)
        ):
            yield name


def _may_be_held(candidate: Candidate, fitted: Fitted, method: Method = STANDARD) -> Iterator[tuple[str, float]]:
    """Return the values that may be nothing with the effect still there, and what is nothing: those that are so unless they are given, and
    those of its sizes beside which another one makes it sensed."""
    sizes = [name for name in candidate.parameters if name.partition(".")[2] in candidate.effect.neutral]
    if len(sizes) > 1:
        yield from ((name, float(candidate.effect.neutral[name.partition(".")[2]])) for name in sizes)
    yield from ((name, 0.0) for name in candidate.spare)
    yield from ((name, 0.0) for name in _unsure_shape(candidate, fitted, method=method))


def _held(laboratory: Laboratory, model: Model, candidate: Candidate, name: str, nothing: float) -> tuple[Model, list[str]]:
    """Return the model with a value of a candidate held at nothing, and the names of what nothing shows any more."""
    names = [name]
    constant = {**model.fitted.constant, name: nothing}
    free = [item for item in with_start(model.fitted) if item.name != name]
    fitted = fit(laboratory.experiment.sensed, free, constant, rounds=1, full_band=is_full_band(model.candidates))
    assert fitted.sensitivity is not None
    silent = {item.name for item, slope in zip(fitted.free, fitted.sensitivity, strict=True) if not np.any(slope)}
    names += [other for other in candidate.parameters if other in silent]
    if len(names) > 1:
        rest = [item for item in with_start(fitted) if item.name not in names]
        constant |= {other: fitted.by_name[other] for other in names}
        fitted = fit(laboratory.experiment.sensed, rest, constant, rounds=1, full_band=is_full_band(model.candidates))
    leaner = candidate.keeping([other for other in candidate.parameters if other not in names])
    candidates = tuple(leaner if other is candidate else other for other in model.candidates)
    return laboratory.model(candidates, fitted), names
