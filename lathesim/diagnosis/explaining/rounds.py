"""A round of trials: which candidates are worth a fit on top of a model, and how each of them does."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from lathesim.diagnosis.candidates.eligibility import due as may_come
from lathesim.diagnosis.candidates.eligibility import finer
from lathesim.diagnosis.candidates.screening import screen
from lathesim.diagnosis.candidates.starting_points import starting_points
from lathesim.diagnosis.explaining.chance import due, least_apart
from lathesim.diagnosis.explaining.plausible import is_plausible
from lathesim.diagnosis.explaining.resolution import significant
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explaining.trial import settled_trial, tried, without, worth
from lathesim.diagnosis.method.method import HOPELESS, NEAR, RIVAL
from lathesim.diagnosis.records.found import Screened, Tried
from lathesim.engine.assembly import FloatArray
from lathesim.identification.execution import together
from lathesim.identification.records import Candidate, CandidateStanding, Model, Standing, is_full_band
from lathesim.identification.signal import root_mean_square

_AT_ONCE = 5
"""Candidates that are fitted at once."""


@dataclass
class Rounds:
    """The rounds of a search; one on top of the same model is not made twice: the same values free, between the same bounds, and fitted no
    better.

    ``rivals`` are, by the part of an effect that came in, those that predicted as well: they are fitted in each later round. ``others`` are
    those that predicted better than without them when the last effect came in, and ``ahead`` those that gained more than what came in, by
    their own noise, which leaves less by the noise of either.
    """

    study: Study
    rivals: dict[str, tuple[Candidate, ...]] = field(default_factory=dict)
    others: list[Tried] = field(default_factory=list)
    ahead: list[Tried] = field(default_factory=list)
    _made: dict[frozenset[tuple[str, float, float]], tuple[float, list[Tried]]] = field(default_factory=dict)

    def is_new(self, model: Model) -> bool:
        """Return whether no round was made on top of a model that is fitted as well, with the same values free."""
        return model.fitted.score > self._made.get(_key(model), (-math.inf, []))[0] + due(self.study.method)

    def on(self, model: Model, known: Tried | None = None, *, growing: bool = False) -> list[Tried]:
        """Return the most promising candidates, each fitted on top of a model, and those that were nothing there. One that is ``known`` on
        top of it is not fitted again.

        Of a ``growing`` model the most promising alone, where it leads the others to better values: all would gain by these.
        """
        if self.is_new(model):
            rivals = {one.part for others in self.rivals.values() for one in others}
            self._made[_key(model)] = (
                model.fitted.score,
                _round(self.study, model, rivals, known, growing=growing and bool(model.candidates)),
            )
        return self._made[_key(model)][1]


def _key(model: Model) -> frozenset[tuple[str, float, float]]:
    return frozenset((one.name, one.low, one.high) for one in model.free)


def led_to(study: Study, model: Model, trial: Tried) -> Model | None:
    """Return a model with the values that a further effect led to, where the others predict as well with these and without it; none where
    it is worth something.

    A fit ends in a valley where each further value helps it on: what that gains is no effect.
    """
    left = without(study, trial.model, trial.candidate)
    if left.fitted.score < model.fitted.score or significant(worth(trial.candidate, left, trial.model), study):
        return None
    return left


def _leads_on(study: Study, model: Model, trial: Tried) -> bool:
    """Return whether all that a trial gains are clearly better values of the model before it."""
    led = led_to(study, model, trial) if significant(trial, study) and is_plausible(study, trial.model) else None
    return led is not None and led.fitted.score > model.fitted.score + due(study.method)


def _round(study: Study, model: Model, rivals: Collection[str], known: Tried | None, *, growing: bool) -> list[Tried]:
    experiment = study.estimation
    candidates = [*may_come(model, experiment), *finer(model, experiment)]
    points = starting_points(experiment, model.fitted, candidates, method=study.method)
    study.progress(f"{len(candidates)} effects by a linear estimate, beside {len(model.candidates)} found")
    screened = screen(experiment.sensed, model.fitted, candidates, points)
    # what acts in several places shows wholly only with a size in each
    everywhere = [one.shaped for one in candidates if one.shaped is not None and one.acts_elsewhere]
    wide = screen(experiment.sensed, model.fitted, everywhere) if everywhere else ()
    least = 0.0 if is_off(study, model) else due(study.method)
    items = sorted((*screened, *wide), key=lambda item: -item.gain)
    batches, first = _promising(items, study, rivals, least), known
    if growing and batches:
        first = tried(study, model, batches[0][0], _read_off(points, batches[0][0].candidate))
        if _leads_on(study, model, first):
            return [first]
    trials, good = _fitted_on(study, model, batches, items, points, first)
    # what no machine does is no yardstick: a first fit of what is right may be far behind it. Nor is what is judged on other frequencies
    most: dict[bool, float] = {}
    for made in good or trials:
        all_frequencies = is_full_band(made.model.candidates)
        most[all_frequencies] = max(most.get(all_frequencies, 0.0), made.predicted.nats)

    best = max(good or trials, key=lambda made: made.predicted.nats, default=None)
    trace = best and (best.candidate.family, best.candidate.at)

    def fine(made: Tried) -> Tried:
        """Return a trial fitted further where it may be the best: near it, or alike, where a first fit of a delay stops a sample short."""
        like = (made.candidate.family, made.candidate.at) == trace
        near = 0.0 if like else NEAR * most.get(is_full_band(made.model.candidates), 0.0)
        if made is not known and made.predicted.nats > max(near, due(study.method)):
            made = settled_trial(study, model, made)
        text = f"{made.name} gains {made.predicted.nats:.0f} +- {made.predicted.error:.0f}"
        study.progress(Standing.told(text, [CandidateStanding(made.name, made.fitted.nats, made.predicted.nats, made.predicted.share)]))
        return made

    return list(together(fine, trials))


def _read_off(points: Mapping[str, FloatArray], candidate: Candidate) -> FloatArray | None:
    """Return the values that were read off the recording for a candidate, if they are those of its form."""
    read_off = points.get(candidate.part)
    return read_off if read_off is not None and read_off.shape[-1:] == (len(candidate.parameters),) else None


def is_off(study: Study, model: Model) -> bool:
    """Return whether a channel is off by clearly more than the recording resolves: the noise that screening takes for granted is then what
    is missing, and its gains tell no more than which effects go first."""
    floors = study.estimation.sensed.seen_floors
    return any(root_mean_square(row) > study.method.errors * floor for row, floor in zip(model.fitted.residual, floors, strict=True))


def _promising(ranked: Sequence[Screened], study: Study, rivals: Collection[str], least: float) -> list[list[Screened]]:
    """Return the candidates that are worth a fit, in batches of which each holds the best that are left by their screening gain, of at
    least ``least``; the first holds what should be fitted with them too."""
    least = max([least, *(HOPELESS * item.gain for item in ranked[:1])])
    worth = [item for item in ranked if item.gain > least]
    first = _first(worth, study, rivals) if worth else []
    rest = [item for item in worth if not any(item is one for one in first)]
    later = [rest[place : place + _AT_ONCE] for place in (0, _AT_ONCE)]
    return [batch for batch in (first, *later) if batch]


def _fitted_on(
    study: Study,
    model: Model,
    batches: list[list[Screened]],
    items: Sequence[Screened],
    points: Mapping[str, FloatArray],
    known: Tried | None,
) -> tuple[list[Tried], list[Tried]]:
    """Return the candidates of some batches fitted on top of a model, and those of them that predict better: up to the first batch that
    holds some, and what this has overlooked. One that is ``known`` there is not fitted again."""

    def fitted(item: Screened) -> Tried:
        if known is not None and item.candidate.parameters == known.candidate.parameters:
            return known
        return tried(study, model, item, _read_off(points, item.candidate))

    trials: list[Tried] = []
    good: list[Tried] = []
    begun: list[Screened] = []
    while batches:
        batch = [item for item in with_simpler_forms(batches.pop(0), items) if not any(item is one for one in begun)]
        begun += batch
        trials += together(fitted, batch)
        before, good = good, [made for made in trials if significant(made, study) and is_plausible(study, made.model)]
        if before:
            break
        batches = _overlooked(good, items, batches) if good else batches
    return trials, good


def _overlooked(good: Sequence[Tried], items: Sequence[Screened], batches: Sequence[Sequence[Screened]]) -> list[list[Screened]]:
    """Return as one batch what of later ones promised nearly as much as the best trial, behind what promised more and did not keep it."""
    best = max(good, key=lambda made: made.predicted.nats).candidate
    promised = max(item.gain for item in items if item.candidate.part == best.part)
    near = [item for batch in batches for item in batch if item.gain > RIVAL * promised]
    return [near[:_AT_ONCE]] if near else []


def _first(worth: Sequence[Screened], study: Study, rivals: Collection[str]) -> list[Screened]:
    """Return the best candidates, with the twins of the simpler forms of each, what leaves a like trace, and ``rivals``."""
    rival = RIVAL * worth[0].gain
    near = [item for item in worth if item.gain > rival][:_AT_ONCE]
    simpler = set[tuple[str, str]]().union(*(simpler_forms(item.candidate) for item in near))
    alike = {(item.candidate.family, item.candidate.at) for item in near[:2]}
    # what promises the same at the same place as a simpler form may be its twin: in one direction a weight is that of a friction
    plain = [item for item in worth if (item.candidate.name, item.candidate.at) in simpler]

    apart = least_apart(study.method)

    def belongs(item: Screened) -> bool:
        one = item.candidate
        like = (one.family, one.at) in alike or one.part in rivals
        return like or any(one.at == other.candidate.at and abs(item.gain - other.gain) < apart for other in plain)

    return near + [item for item in worth if not any(item is one for one in near) and belongs(item)]


def with_simpler_forms(batch: Sequence[Screened], ranked: Sequence[Screened]) -> list[Screened]:
    """Return some candidates with the simpler forms of each: a finer form waits for these, and is not to come in as they were not tried."""
    simpler = set[tuple[str, str]]().union(*(simpler_forms(item.candidate) for item in batch))
    return [
        *batch,
        *(one for one in ranked if (one.candidate.name, one.candidate.at) in simpler and not any(one is item for item in batch)),
    ]


def simpler_forms(candidate: Candidate) -> set[tuple[str, str]]:
    """Return the effects that a candidate is a finer form of, or stands on, with their places."""
    how = candidate.effect.identification
    return {(name, candidate.at) for name in (*how.generalises, *how.prerequisites)}


def is_finer(candidate: Candidate, others: Collection[Candidate]) -> bool:
    """Return whether a candidate is a finer form of one of some others."""
    return bool(simpler_forms(candidate) & {(one.name, one.at) for one in others})
