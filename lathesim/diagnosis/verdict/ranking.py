"""From what a search found to what is said: how sure each name is, what it is tied with, and whether the model is adequate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import compare_trials
from lathesim.diagnosis.selection.compare_models import ModelComparison
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.identification.noise.noise_model import white_noise
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted
from lathesim.identification.records.model import Trial
from lathesim.identification.replay.experiment import Experiment


@dataclass(frozen=True)
class RankedEffect:
    """How sure an effect is: its probability among all candidates, and the candidates it is tied with."""

    candidate: Candidate
    probability: float
    tied: tuple[Candidate, ...]
    forms: tuple[Candidate, ...]
    """Single effects that do what this one and another of the model do together."""
    share: float
    removes: float
    unseen: tuple[Candidate, ...] = ()
    """Refined forms of it that would show too little in the recording to be told from it."""


def rank_effects(found: SearchResult, method: Method, one_sided: Sequence[Candidate] = ()) -> list[RankedEffect]:
    """Return how sure each effect of the model is, the one that removes most first. It is tied with a ``one_sided`` form of it, which no
    recording could have shown. What was there before a change is none of it."""
    result = []
    for candidate in (one for one in found.model.candidates if one.part not in found.there_before):
        trials, chosen = found.trials.get(candidate.part, ()), found.trial_of(candidate)
        unseen = tuple({other.part: other for other in found.unseen.get(candidate.part, ())}.values())
        if chosen is None:
            result.append(RankedEffect(candidate, 0.5, (), (), 0.0, 0.0, unseen))
            continue
        rivals = [trial for trial in trials if trial.candidate.part != candidate.part]
        compared = [(trial.candidate, compare_trials(trial, chosen, chosen, method)) for trial in rivals]
        others = [(other, held) for other, held in compared if not held.explains_elsewhere]
        tied = tuple(other for other, held in others if held.as_good and not found.holds(other))
        weights = [np.exp(-max(0.0, -held.gains.estimation) / (0.5 * held.resolution)) for _, held in others]
        probability = float(1.0 / (1.0 + sum(weights)))
        tied += tuple(other for other in one_sided if other.at == candidate.at and is_told_by_direction(candidate, other))
        forms = tuple(found.forms.get(candidate.part, ()))
        share = min(chosen.share_of_all, 1.0)
        result.append(RankedEffect(candidate, probability, tied, forms, share, chosen.share_of_rest, unseen))
    return sorted(result, key=lambda item: -item.share)


def rivals_of(candidate: Candidate, found: SearchResult, method: Method) -> Iterator[tuple[Trial, Trial, ModelComparison]]:
    """Return the trial of an effect of the model, each rival that is not in the model, and how the rival compares with it."""
    chosen = found.trial_of(candidate)
    for trial in found.trials.get(candidate.part, ()) if chosen else ():
        if chosen and trial.candidate.part != candidate.part and not found.holds(trial.candidate):
            yield chosen, trial, compare_trials(trial, chosen, chosen, method)


def is_told_by_direction(candidate: Candidate, other: Candidate) -> bool:
    """Return whether a candidate is told from another only by how both act in two directions: it is refined by that, or repeats like it
    and acts at the same port."""
    alike = (candidate.effect.family, candidate.effect.site) == (other.effect.family, other.effect.site)
    return candidate.name in other.effect.identification.generalises or (alike and candidate.effect.identification.periodic is True)


def removed_in_band(found: SearchResult) -> float:
    """Return the share of the baseline's error, in the band of the motion, that the effects remove on the estimation recording."""
    before, after = found.baseline.error, found.model.error
    return float(1.0 - after[::2].sum() / before[::2].sum()) if before[::2].sum() > 0.0 else 0.0


def explains_nothing(experiment: Experiment, before: Fitted, after: Fitted, method: Method = STANDARD) -> bool:
    """Return whether a fit explains no more than chance does of another's error, whichever channel of the recording is looked at, and
    whether there is hardly any: where an error is left that nothing explains, something is missing."""
    over = np.sqrt(np.mean(np.square(before.residual), axis=1)) / experiment.sensed.seen_floors
    if np.max(over) > method.shared.alike:
        return False
    laboratory = Laboratory(experiment, experiment, lambda text: None, method=method)
    laboratory.weigh(before)
    return laboratory.most_removed(experiment, before, after) < method.share_of_all


def removed_share(experiment: Experiment, before: Fitted, after: Fitted, method: Method = STANDARD) -> float:
    """Return the share of a recording's error, above its floor and in the band of the motion, that one fit removes of another's.

    It is weighed as forces and sensor noise of the size of the first are, as in the search: what loads add up to over a recording, a metre
    or a turn that no model could know, does not outweigh what an effect does. White noise of a sensor beyond its floor, as it is left
    after, is nothing that a model could remove.
    """
    laboratory = Laboratory(experiment, experiment, lambda text: None, method=method)
    laboratory.weigh(before)
    shapes = experiment.sensed.noise_shapes(after.by_name)
    white = np.array([white_noise(row, shape) for row, shape in zip(after.residual, shapes, strict=True)])
    error, left = (float(laboratory.error(experiment, fitted, white)[::2].sum()) for fitted in (before, after))
    return 1.0 - left / error if error > 0.0 else 0.0
