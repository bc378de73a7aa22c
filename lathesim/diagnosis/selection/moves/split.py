"""One effect that does what two do: Coulomb friction with a constant force is, as long as nothing rests, an uneven friction.

Simple effects come first: where two of them explain as much as the one, they take its place, and it is told to be tied with them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.candidates.screening import screened_instead
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.compare_models import Gains, compare_models, gains_over
from lathesim.diagnosis.selection.laboratory import Laboratory, candidate_free, judged_score
from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.estimation.transfer import transferred
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Model, Trial, is_full_band


def one_as_two(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search with two simple effects in the place of a refined form that they explain as much as."""
    simpler = two_for_one(laboratory, found.baseline, found.model, method=method)
    if simpler is None:
        return found
    model, trials = simpler
    laboratory.progress(f"as good and simpler: {' and '.join(trial.candidate.name for trial in trials)}")
    known = {**found.trials, **{trial.candidate.part: [trial] for trial in trials}}
    return found.accepted(laboratory.settled(model), "split", "two simple effects explain as much as one", trials=known)


def note_forms_of_two(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search with the single effects noted that explain what two of its model do."""
    return replace(found, forms=forms_of_two(laboratory, found.model, method=method))


def forms_of_two(laboratory: Laboratory, model: Model, method: Method = STANDARD) -> dict[str, list[Candidate]]:
    """Return, by the part of a candidate, the refined forms of it that explain both recordings as well as it does with another candidate
    beside it."""
    found: dict[str, list[Candidate]] = {}
    for candidate in model.candidates:
        finer = [
            other
            for other in laboratory.experiment.candidates
            if other.at == candidate.at and candidate.name in other.effect.identification.generalises
        ]
        beside = [other for other in model.candidates if other is not candidate and other.at == candidate.at]
        for form in finer:
            for other in beside:
                if _as_good(laboratory, model, (candidate, other), form, method=method):
                    for one in (candidate, other):
                        found.setdefault(one.part, []).append(form)
    return found


def two_for_one(laboratory: Laboratory, baseline: Model, model: Model, method: Method = STANDARD) -> tuple[Model, list[Trial]] | None:
    """Return the model in which a refined form gives way to the simple one and an effect of one value beside it, where they explain as
    much, with the trials of the two; else none."""
    for form in model.candidates:
        kept = tuple(candidate for candidate in model.candidates if candidate is not form)
        at = [candidate for candidate in laboratory.experiment.candidates if candidate.at == form.at and candidate not in model.candidates]
        simple = next((candidate for candidate in at if candidate.name in form.effect.identification.generalises), None)
        if simple is None:
            continue
        before = _without(laboratory, baseline, model, form, kept)
        first = laboratory.trial(before, simple, kept, before.free, form_starts(form, simple, model, most=0))
        for other in (item for item in at if _is_plain(item) and _is_beside(item, simple)):
            both = (*kept, simple)
            second = laboratory.trial(first.model, other, both, first.model.free, list(other.points[:1]))
            explained = max(0.0, min(second.full_band_gain, second.full_band_validation_gain))
            gains = gains_over(second.model, model, full_band=is_full_band(model.candidates))
            held = compare_models(gains, method, explained=explained)
            if second.validation_gain > 0.0 and held.as_good:
                return second.model, [first, second]
    return None


def _is_plain(candidate: Candidate) -> bool:
    """Return whether a candidate has one value and refines nothing."""
    return len(candidate.parameters) == 1 and not candidate.effect.identification.generalises


def _is_beside(candidate: Candidate, other: Candidate) -> bool:
    """Return whether two candidates of different kinds act on one port."""
    return candidate.effect.site == other.effect.site and candidate.family != other.family


def _without(laboratory: Laboratory, baseline: Model, model: Model, candidate: Candidate, kept: tuple[Candidate, ...]) -> Model:
    if not kept:
        return baseline
    free = [item for item in model.free if item.name not in candidate.parameters]
    return laboratory.model(kept, fit(laboratory.experiment.sensed, free, model.fitted.constant, rounds=2, full_band=is_full_band(kept)))


def _as_good(laboratory: Laboratory, model: Model, two: tuple[Candidate, Candidate], form: Candidate, method: Method = STANDARD) -> bool:
    kept = tuple(candidate for candidate in model.candidates if candidate not in two)
    gone = {name for candidate in two for name in candidate.parameters}
    free = [item for item in model.free if item.name not in gone]
    full_band, constant = is_full_band((*kept, form)), model.fitted.constant
    starts = form_starts(two[0], form, model)
    without = fit(
        laboratory.experiment.sensed,
        [item for item in model.free if item.name not in two[1].parameters],
        constant,
        rounds=1,
        full_band=full_band,
        slopes="kept",
    )
    gained = model.score.above(judged_score(laboratory.experiment, without), full_band=full_band)
    if screened_instead(laboratory.experiment.sensed, without, two[0], form, starts).gain < method.selection.hopeless * gained:
        return False
    tried = [
        fit(
            laboratory.experiment.sensed,
            [*free, *candidate_free(form, start, method=method)],
            constant,
            rounds=2,
            full_band=full_band,
            slopes="kept",
        )
        for start in starts
    ]
    best = max(tried, key=lambda fitted: fitted.score)
    gains = [Gains(judged_score(laboratory.experiment, best).above(model.score, full_band=full_band))]
    if _is_as_good(gains[0], gained, method):
        validation = judged_score(laboratory.validation, transferred(laboratory.validation, best, (*kept, form)))
        gains.append(Gains(validation.above(model.validation, full_band=full_band)))
    return all(_is_as_good(one, gained, method) for one in gains)


def _is_as_good(gains: Gains, gained: float, method: Method) -> bool:
    """Return whether one effect explains as much as two, of which the second ``gained`` [nats]."""
    return compare_models(gains, method, explained=max(gained, 0.0)).as_good


def form_starts(candidate: Candidate, other: Candidate, model: Model, most: int = 2) -> Sequence[FloatArray]:
    """Return starting values of a finer form: what it has in common with the simple one as fitted, the rest neutral or typical.

    What may vanish does so in some of them: a peak of a usual size is far too large on a small machine.
    """
    values = model.fitted.by_name
    start = other.neutral.copy()
    for position, name in enumerate(other.parameters):
        item = name.partition(".")[2]
        otherwise = start[position] if item in other.effect.neutral else other.points[0][position]
        start[position] = values.get(f"{candidate.part}.{item}", otherwise)
    shared = np.array([f"{candidate.part}.{name.partition('.')[2]}" in values for name in other.parameters])
    may_vanish = (other.low == 0.0) & ~shared & ~np.array([name.partition(".")[2] in other.effect.neutral for name in other.parameters])
    bare = [np.where(shared, start, np.where(may_vanish, 0.0, point)) for point in other.points[:most]] if may_vanish.any() else []
    return [start, *bare, *[np.where(start == other.neutral, point, start) for point in other.points[:most]]]
