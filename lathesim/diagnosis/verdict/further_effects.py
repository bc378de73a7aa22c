"""Which further effect is possible beside the model: it explains most of what is left, and too little of all to be named."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.candidates.harmonics import is_part_of_a_wave
from lathesim.diagnosis.candidates.periodic_starts import is_a_wave
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import compare_trials, gains_enough, merit, of_usual_size
from lathesim.diagnosis.selection.elimination import is_in_time
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.diagnosis.selection.refusing.refusal import is_trifling
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Trial


@dataclass(frozen=True)
class Possible:
    """An effect that may be there beside the model, and how probable it is among all that were tried there."""

    trial: Trial
    probability: float
    replaces: tuple[Candidate, ...]
    """Effects of the model that it refines: it would take their place."""


def further_effects(laboratory: Laboratory, found: SearchResult, method: Method) -> tuple[Possible, ...]:
    """Return the best further effect, and those that cannot be told from it, the best first.

    Each gains on both recordings what an accepted effect must gain, and explains nearly all of what is left somewhere. What it is not
    asked is how much it explains of all, and how far it moves a channel. The probabilities are those of
    :func:`lathesim.diagnosis.verdict.ranking.rank_effects`: exp(-gap / half the resolution), over the sum of all that were tried there.
    """
    held = [trial for trial in _best_of_each(found, method) if _may_be_there(laboratory, found, trial, method)]
    ordered = sorted(held, key=lambda trial: -merit(trial, method))
    if not ordered:
        return ()
    compared = [compare_trials(trial, ordered[0], ordered[0], method) for trial in ordered]
    weights = np.exp([min(one.gains.estimation, 0.0) / (0.5 * one.resolution) for one in compared])
    return tuple(
        Possible(trial, float(weight / weights.sum()), _replaced(found, trial))
        for trial, one, weight in zip(ordered, compared, weights, strict=True)
        if one.as_good
    )


def _best_of_each(found: SearchResult, method: Method) -> Iterable[Trial]:
    """Return the trials that were made on top of the model: of an effect that was tried in several ways the best."""
    best: dict[tuple[str, str], Trial] = {}
    for trial in (trial for trial in found.tried if found.was_held_against(trial) and trial.candidate.part not in found.there_before):
        key = trial.candidate.name, trial.candidate.at
        if key not in best or merit(trial, method) > merit(best[key], method):
            best[key] = trial
    return best.values()


def _may_be_there(laboratory: Laboratory, found: SearchResult, trial: Trial, method: Method) -> bool:
    """Return whether an effect is believable but for its size."""
    values = trial.model.fitted.by_name
    sound = not (trial.implausible or trial.becomes_implausible or trial.candidate.effect.identification.size_of_recording)
    return (
        sound
        and gains_enough(trial, method, found.null_maximum)
        and trial.share_of_rest > method.nearly_all_of_rest
        and trial.closed_loop_degradation < method.shared.alike
        and of_usual_size(trial.candidate, values, method)
        and not is_part_of_a_wave(trial, found.model, method=method)
        and is_a_wave(laboratory.experiment, trial.candidate, values, method=method)
        and is_in_time(laboratory, trial.candidate, trial.model, method=method)
        and not is_trifling(laboratory, found.model, trial.model, trial, method=method)
    )


def _replaced(found: SearchResult, trial: Trial) -> tuple[Candidate, ...]:
    kept = {candidate.part for candidate in trial.model.candidates}
    return tuple(candidate for candidate in found.model.candidates if candidate.part not in kept)
