"""What the recordings of a diagnosis cannot answer: rivals that the search passed by, and effects that no size of them would show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.explaining.plausible import is_plausible
from lathesim.diagnosis.explaining.resolution import as_good, significant
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explaining.trial import settled_trial, tried
from lathesim.diagnosis.isolation.answerable import reasons
from lathesim.diagnosis.isolation.apart import alike
from lathesim.diagnosis.isolation.visible import ChannelChange, Looking, Visible, shapes, unseen
from lathesim.diagnosis.records.diagnosis import Unanswerable
from lathesim.diagnosis.records.found import Found, Screened, Tried
from lathesim.identification.execution import together
from lathesim.identification.records import Candidate


def locked(study: Study, found: Found) -> tuple[Found, tuple[Unanswerable, ...]]:
    """Return a search with the rivals that it passed by, and the effects that its recordings do not show.

    A search fits the rivals that a linear estimate ranks first, from usual values. One that does the same with the period or the instant of
    the effect itself is fitted here; where it predicts as well, it is a tie.
    """
    if not found.complete or study.earlier is not None or study.ends.is_over:
        return found, ()
    looking = Looking.at(replace(study, validation=study.estimation), found.model.fitted)
    there = {one.part for one in found.model.candidates}
    shaped = shapes(study, [one for one in study.estimation.candidates if one.part not in there], few=1)
    others = looking.changes([(shape.candidate, shape.point) for shape in shaped], judged=False)
    known = [change for change in others if change is not None]
    for part, worth in found.worth.items():
        rivals = _passed_by(study, found, worth, known)
        found = replace(found, rivals={**found.rivals, part: (*found.rivals.get(part, ()), *rivals)})
    return found, tuple(_unanswerable(looking, one) for one in unseen(looking, shaped))


def _passed_by(study: Study, found: Found, worth: Tried, others: Sequence[ChannelChange]) -> list[Tried]:
    """Return the rivals of an effect that predict as well in its place and that were not fitted there."""
    fitted = found.model.fitted
    run = worth.before.fitted.residual - fitted.residual
    own = np.array([fitted.by_name[name] for name in worth.candidate.parameters])
    without = Looking.at(replace(study, validation=study.estimation), replace(worth.before.fitted, noise=fitted.noise))
    truth = ChannelChange(worth.candidate, own, run, without.taken.left(run, fitted.noise))
    rest = [one.part for one in worth.before.candidates]
    # what was fitted there and explains the larger part was held against the effect already
    least = study.method.larger_part * worth.predicted.nats
    known = [one for one in found.tried if [other.part for other in one.before.candidates] == rest and one.predicted.nats > least]
    there = {one.part for one in found.model.candidates} | {one.candidate.part for one in known}
    (begun,) = alike(without, [truth], others, study.method.nearly_all)
    left = [(candidate, values) for candidate, values in begun if candidate.part not in there]

    def made(one: tuple[Candidate, np.ndarray]) -> Tried:
        return settled_trial(study, worth.before, tried(study, worth.before, Screened(one[0], 0.0, (one[1],), np.ones(1)), None))

    trials = together(made, left)
    return [one for one in trials if significant(one, study) and is_plausible(study, one.model) and as_good(one.model, worth, study)]


def _unanswerable(looking: Looking, one: Visible) -> Unanswerable:
    """Return an effect that is not seen, with why."""
    candidate = one.shape.candidate
    return Unanswerable(candidate.name, candidate.place, "; ".join(reasons(looking, one)))
