"""A finer form whose own values may be nothing gives way to what it refines: a friction that differs by nothing between the directions is
a plain one.

Nested models, held against each other at the same values of all else. Source: Ljung, System Identification, 2nd ed. 1999, section 16.4
(the smallest of the models that fit as well).
"""

from __future__ import annotations

from dataclasses import replace

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.laboratory import Laboratory, candidate_free
from lathesim.diagnosis.selection.moves.fix_parameters import is_as_good
from lathesim.diagnosis.selection.moves.split import form_starts
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import with_start
from lathesim.identification.records.model import Model, is_full_band


def specialise(laboratory: Laboratory, found: SearchResult, method: Method = STANDARD) -> SearchResult:
    """Return the search with what an effect refines in its place, where both recordings are explained as well by it; the effect is then
    told to be a form that shows too little here."""
    for finer in found.model.candidates:
        for plain in laboratory.experiment.candidates:
            if (
                plain.at != finer.at
                or plain.name not in finer.effect.identification.generalises
                or _has_values_of_its_own(finer, plain, found.model, method=method)
            ):
                continue
            model = None if plain in found.model.candidates else _in_its_place(laboratory, found.model, finer, plain, method=method)
            if model is not None and is_as_good(model, found.model, method=method):
                laboratory.progress(f"{finer.name} at {finer.at} is a plain {plain.name}")
                others = [trial for trial in found.trials.get(finer.part, ()) if trial.candidate.part != plain.part]
                its_own = [replace(trial, candidate=plain) if trial.candidate.part == finer.part else trial for trial in others]
                found = replace(found, trials={**found.trials, plain.part: its_own}).with_unseen(plain, [finer])
                found = found.accepted(laboratory.settled(model), "specialise", "its special case explains as much")
                break
    return found


def _has_values_of_its_own(finer: Candidate, plain: Candidate, model: Model, method: Method = STANDARD) -> bool:
    """Return whether a value that a plain form does not have is surely something: the way over which bristles bend, if not an asymmetry."""
    shared = {name.partition(".")[2] for name in plain.parameters}
    own = [name for name in finer.parameters if name.partition(".")[2] not in shared]
    return any(abs(model.fitted.by_name[name]) > method.selection.significant * model.fitted.error(name) for name in own)


def _in_its_place(laboratory: Laboratory, model: Model, finer: Candidate, plain: Candidate, method: Method = STANDARD) -> Model:
    """Return the model with a plain form in the place of a finer one, from the values that both have."""
    with_simulated_motion = any(model.fitted.constant.get(name) == 0.0 for name in laboratory.experiment.simulated_motion_of([finer]))
    motion = laboratory.experiment.simulated_motion_of([plain]) if with_simulated_motion else {}
    candidates = tuple(plain if candidate is finer else candidate for candidate in model.candidates)
    (start,) = form_starts(finer, plain, model, most=0)
    rest = [item for item in with_start(model.fitted) if item.name not in finer.parameters]
    constant = {name: value for name, value in model.fitted.constant.items() if name.partition(".")[0] != finer.part}
    return laboratory.model(
        candidates,
        fit(
            laboratory.experiment.sensed,
            [*rest, *candidate_free(plain, start, method=method)],
            constant | motion,
            rounds=1,
            full_band=is_full_band(candidates),
        ),
    )
