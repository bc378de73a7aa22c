"""One effect that does what two do: Coulomb friction with a constant force is, as long as nothing rests, an uneven friction.

Simple effects come first: where two of them explain as much as the one, they take its place, and it is told to be tied with them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lathesim.diagnosis.candidates.screening import screened_instead
from lathesim.diagnosis.selection.laboratory import Bench, judged_score, term_free
from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.estimation.transfer import on_recording
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.model import Model, Score, Trial, is_wide

AS_GOOD = 4.0
"""Nats that the one may be behind the two, on each recording ..."""
AS_GOOD_SHARE = 0.02
"""... or this share of what the second of the two gains."""
_PROMISED = 0.2
"""Share of what the second of the two gains that the one must promise in its place to be fitted."""


def forms_of_two(bench: Bench, model: Model) -> dict[str, list[Term]]:
    """Give, by the part of a term, the refined forms of it that explain both recordings as well as it does with another term beside it."""
    found: dict[str, list[Term]] = {}
    for term in model.terms:
        finer = [other for other in bench.rig.candidates if other.at == term.at and term.name in other.effect.refines]
        beside = [other for other in model.terms if other is not term and other.at == term.at]
        for form in finer:
            for other in beside:
                if _as_good(bench, model, (term, other), form):
                    for one in (term, other):
                        found.setdefault(one.part, []).append(form)
    return found


def two_for_one(bench: Bench, baseline: Model, model: Model) -> tuple[Model, list[Trial]] | None:
    """Give the model in which a refined form gives way to the simple one and an effect of one value beside it, where they explain as much,
    with the trials of the two; else none."""
    for form in model.terms:
        kept = tuple(term for term in model.terms if term is not form)
        at = [term for term in bench.rig.candidates if term.at == form.at and term not in model.terms]
        simple = next((term for term in at if term.name in form.effect.refines), None)
        if simple is None:
            continue
        before = _without(bench, baseline, model, form, kept)
        first = bench.trial(before, simple, kept, before.free, form_starts(form, simple, model, most=0))
        for other in (item for item in at if _is_plain(item) and _is_beside(item, simple)):
            both = (*kept, simple)
            second = bench.trial(first.model, other, both, first.model.free, list(other.points[:1]))
            allowed = max(AS_GOOD, AS_GOOD_SHARE * min(second.wide_gain, second.wide_held_out_gain))
            wide = is_wide(model.terms)
            behind = [ours.above(theirs, wide=wide) for ours, theirs in _scores(second.model, model)]
            if second.held_out_gain > 0.0 and min(behind) > -allowed:
                return second.model, [first, second]
    return None


def _is_plain(term: Term) -> bool:
    """Say whether a term has one value and refines nothing."""
    return len(term.parameters) == 1 and not term.effect.refines


def _is_beside(term: Term, other: Term) -> bool:
    """Say whether two terms of different kinds act on one port."""
    return term.effect.site == other.effect.site and term.family != other.family


def _scores(ours: Model, theirs: Model) -> list[tuple[Score, Score]]:
    return [(ours.score, theirs.score), (ours.held_out, theirs.held_out)]


def _without(bench: Bench, baseline: Model, model: Model, term: Term, kept: tuple[Term, ...]) -> Model:
    if not kept:
        return baseline
    free = [item for item in model.free if item.name not in term.parameters]
    return bench.model(kept, fit(bench.rig.sensed, free, model.fitted.constant, rounds=2, wide=is_wide(kept)))


def _as_good(bench: Bench, model: Model, two: tuple[Term, Term], form: Term) -> bool:
    kept = tuple(term for term in model.terms if term not in two)
    gone = {name for term in two for name in term.parameters}
    free = [item for item in model.free if item.name not in gone]
    wide, constant = is_wide((*kept, form)), model.fitted.constant
    starts = form_starts(two[0], form, model)
    without = fit(
        bench.rig.sensed, [item for item in model.free if item.name not in two[1].parameters], constant, rounds=1, wide=wide, slopes="kept"
    )
    gained = model.score.above(judged_score(bench.rig, without), wide=wide)
    if screened_instead(bench.rig.sensed, without, two[0], form, starts).gain < _PROMISED * gained:
        return False
    tried = [fit(bench.rig.sensed, [*free, *term_free(form, start)], constant, rounds=2, wide=wide, slopes="kept") for start in starts]
    best = max(tried, key=lambda fitted: fitted.score)
    allowed = max(AS_GOOD, AS_GOOD_SHARE * gained)
    if judged_score(bench.rig, best).above(model.score, wide=wide) < -allowed:
        return False
    held_out = judged_score(bench.held_out, on_recording(bench.held_out, best, (*kept, form)))
    return held_out.above(model.held_out, wide=wide) > -allowed


def form_starts(term: Term, other: Term, model: Model, most: int = 2) -> Sequence[FloatArray]:
    """Give starting values of a finer form: what it has in common with the simple one as fitted, the rest neutral or typical.

    What may vanish does so in some of them: a peak of a usual size is far too large on a small machine.
    """
    values = model.fitted.by_name
    start = other.neutral.copy()
    for position, name in enumerate(other.parameters):
        item = name.partition(".")[2]
        otherwise = start[position] if item in other.effect.neutral else other.points[0][position]
        start[position] = values.get(f"{term.part}.{item}", otherwise)
    shared = np.array([f"{term.part}.{name.partition('.')[2]}" in values for name in other.parameters])
    may_vanish = (other.low == 0.0) & ~shared & ~np.array([name.partition(".")[2] in other.effect.neutral for name in other.parameters])
    bare = [np.where(shared, start, np.where(may_vanish, 0.0, point)) for point in other.points[:most]] if may_vanish.any() else []
    return [start, *bare, *[np.where(start == other.neutral, point, start) for point in other.points[:most]]]
