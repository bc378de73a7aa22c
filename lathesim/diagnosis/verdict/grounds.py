"""What a decision rests on beside the tests of what is left: acceptance of effects, their ties, values that moved, all as criteria."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.residual_test import Condition, Criterion, ResidualTest, all_of, held
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import believable, of_usual_size
from lathesim.diagnosis.selection.compare_models import due
from lathesim.diagnosis.verdict.adequacy import Adequacy
from lathesim.diagnosis.verdict.ranking import RankedEffect, rivals_of
from lathesim.identification.estimation.estimates import CONFIDENCE, Estimates, half_intervals_from_neutral
from lathesim.identification.records.model import Trial


@dataclass(frozen=True)
class Grounds:
    """What a decision rests on.

    ``accepted`` are criteria of effects of the model that hold, ``refused`` those of further effects that do not. ``ties`` hold where an
    effect cannot be distinguished from the first one; ``tied`` says that another reason ties it: a form that the recording could not have
    shown, a value of the lesson. ``rest_explained`` says that a further effect is possible, which explains nearly all of what is left, and
    ``at_first`` of which channels and values the tests speak of the place of the first effect.
    ``moved`` holds where other values of the lesson explain much, ``values_off`` where one is the answer.
    """

    effects: bool
    tests: tuple[ResidualTest, ...]
    explains: Criterion
    first_may_be_zero: Criterion | None
    moved: Criterion
    accepted: tuple[Criterion, ...] = ()
    refused: tuple[Criterion, ...] = ()
    ties: tuple[Criterion, ...] = ()
    rest_explained: bool = False
    at_first: frozenset[str] = frozenset()
    tied: bool = False
    values_off: bool = False


def may_be_zero(first: RankedEffect, found: SearchResult, values: Estimates) -> Criterion | None:
    """Return the criterion that the interval of the first effect includes its neutral value; none for one that was read off a count."""
    if not found.holds(first.candidate):
        return None
    away = half_intervals_from_neutral(first.candidate, values)
    return all_of(Condition(away, "<", 1.0, "confidence", "half intervals", 1.0 / CONFIDENCE))


def acceptance(trial: Trial, method: Method, null_maximum: float) -> Criterion:
    """Return the criterion by which the effect of a trial is accepted, as far as numbers decide: gains, shares, the closed loop.

    The standard error of a log-likelihood gain G is that of half a non-central chi-squared variable, the root of 2 G - k/2 for k
    parameters. Source: S. S. Wilks, Annals of Mathematical Statistics 9 (1938); left out: errors of the shares, how far it moves a channel.
    """
    parameters = len(trial.candidate.parameters)
    least, validated = due(method, parameters=parameters), max(method.per_parameter, method.selection.fit_share.times(trial.gain))
    clauses: list[tuple[Condition, ...]] = [
        (Condition(trial.gain - null_maximum, ">", least, "margin", "nats", _gain_error(trial.gain, parameters)),),
        (held(trial.validation_gain, ">", validated, _gain_error(trial.validation_gain, parameters)),),
        (held(trial.closed_loop_degradation, "<", method.shared.alike),),
    ]
    if not trial.restores_plausibility:
        nearly_all = held(trial.share_of_rest, ">", method.nearly_all_of_rest)
        clauses += [
            (held(trial.share_of_all, ">", method.share_of_all), nearly_all),
            (held(trial.share_of_rest, ">", method.share_of_rest), nearly_all),
        ]
    return Criterion(tuple(clauses))


def of_the_model(found: SearchResult, method: Method) -> tuple[Criterion, ...]:
    """Return the criteria of the effects of the model; one that another move than the forward selection accepted is taken as it is."""
    chosen = [trial for part in found.model.candidates for trial in found.trials.get(part.part, ()) if trial.candidate.part == part.part]
    criteria = (acceptance(trial, method, found.null_maximum) for trial in chosen)
    return tuple(criterion for criterion in criteria if criterion.holds)


def of_the_rest(found: SearchResult, method: Method, nearest: int = 5) -> tuple[Criterion, ...]:
    """Return the criteria of effects that were tried on top of the model and refused for their numbers alone, the ``nearest`` of them."""
    tried = [trial for trial in found.tried if found.was_held_against(trial) and not believable(trial, method, found.null_maximum)]
    sound = [
        trial
        for trial in tried
        if not (trial.implausible or trial.becomes_implausible or trial.candidate.effect.identification.size_of_recording)
        and of_usual_size(trial.candidate, trial.model.fitted.by_name, method)
    ]
    criteria = [acceptance(trial, method, found.null_maximum) for trial in sound]
    refused = [(one.deciding.excess, one) for one in criteria if one.deciding and not one.holds]
    return tuple(one for _, one in sorted(refused, key=lambda pair: -pair[0])[:nearest])


def ties(first: RankedEffect, found: SearchResult, method: Method) -> tuple[Criterion, ...]:
    """Return for each rival of the first effect the criterion that the two cannot be distinguished.

    The standard error of the gap g between two log-likelihoods is the root of 2 g: that of the likelihood ratio of two given models.
    """
    found_ties = []
    for chosen, rival, compared in rivals_of(first.candidate, found, method):
        gap = -compared.gains.estimation
        apart = abs(rival.share_of_all - chosen.share_of_all)
        error = math.sqrt(2.0 * max(gap, 0.0))
        found_ties.append(all_of(held(gap, "<", compared.resolution, error), held(apart, "<", method.selection.tie_share)))
    return tuple(found_ties)


def gathered(
    found: SearchResult,
    ranked: Sequence[RankedEffect],
    adequate: Adequacy,
    moved: Criterion,
    values: Estimates,
    possible: bool,
    method: Method,
) -> Grounds:
    """Return what a decision rests on; ``values`` are the estimates with the error of the effects' form, and ``possible`` says whether a
    further effect explains what is left."""
    first = ranked[0] if ranked else None
    rivals = ties(first, found, method) if first else ()
    by_number = sum(criterion.holds for criterion in rivals)
    return Grounds(
        effects=bool(ranked),
        tests=adequate.tests,
        explains=all_of(held(adequate.judged.removed_here, ">=", method.shared.larger_part, adequate.judged.removed_error)),
        first_may_be_zero=may_be_zero(first, found, values) if first else None,
        moved=moved,
        accepted=of_the_model(found, method),
        refused=of_the_rest(found, method),
        ties=rivals,
        rest_explained=possible,
        at_first=_at_place(first, adequate) if first else frozenset(),
        tied=bool(first and (len(first.tied) > by_number or found.values_instead)),
        values_off=bool(found.values_off),
    )


def _at_place(first: RankedEffect, adequate: Adequacy) -> frozenset[str]:
    """Return what tests are of that speak of the place of an effect: channels and values of its part, channels behind which its part misses
    something, and the whole model."""
    part = first.candidate.at.partition(".")[0]
    behind = {channel for channel, missing, _ in adequate.judged.missing() if missing.at.partition(".")[0] == part}
    own = {test.channel for test in adequate.tests if test.channel.partition(".")[0] == part}
    return frozenset(("", *behind, *own))


def _gain_error(gain: float, parameters: int) -> float:
    return math.sqrt(max(2.0 * gain - 0.5 * parameters, 0.5 * parameters)) if math.isfinite(gain) else 0.0
