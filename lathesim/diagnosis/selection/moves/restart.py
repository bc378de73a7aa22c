"""Whether a search began with the wrong effect: a greedy one takes the best first one, and two others may do more together.

Where something takes away most of what is left and is not believed beside what was found, a wrong beginning is a likely reason. It is tried
in the place of each effect that was found, and the search is done again from each of the next best beginnings. Where values of the lesson
are strained to the end, two effects may have drawn them, neither of which eases them alone: what is not believed beside them is taken in
for once, and counts if nothing is strained any more in the end. Source: Miller, Subset Selection in Regression, 2nd ed., 2002, section 3.8
(replacing what was selected early).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.candidates.harmonics import is_part_of_a_wave
from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.acceptance import believable, merit, simplest
from lathesim.diagnosis.selection.elimination import fewer
from lathesim.diagnosis.selection.laboratory import Bench, is_strained
from lathesim.identification.records.model import Trial

_MOST = 2
"""Beginnings that are tried beside the first."""
_MUCH = 0.5
"""Share of what is left that something must take away on its own."""


def other_beginnings(bench: Bench, found: Found, settings: Settings) -> Iterator[Found]:
    """Give searches to be gone on with that begin otherwise; none where nothing that is not believed does much."""
    if is_strained(found.model.fitted) and (drawn := _despite_strain(found, settings)):
        yield Found(found.baseline, drawn.model, {**found.trials, drawn.term.part: [drawn]}, to_ease=True)
    refused = _refused(found, settings)
    if refused is None or not found.model.terms:
        return
    for trial in _exchanged(bench, found, refused):
        if believable(trial, settings, found.chance):
            yield Found(found.baseline, trial.model, {**found.trials, trial.term.part: [trial]})
    for trial in [trial for trial in found.beginnings if trial.term.part not in found.refused][:_MOST]:
        yield Found(found.baseline, trial.model, {trial.term.part: [trial]})


def _refused(found: Found, settings: Settings) -> Trial | None:
    """Give what takes away most of what the effects that were found leave, moves a channel by more than the rest there, and is not believed
    beside them; nothing where a part of a wave that was found takes away more. What is lost in the rest is no sign of a wrong beginning."""
    there = found.model.terms
    asked = [trial for trial in found.tried if trial.term.part not in found.refused]
    beside = [trial for trial in asked if trial.model.terms[:-1] == there and trial.term not in there]
    gaining = [trial for trial in beside if min(trial.gain, trial.held_out_gain) > settings.margin]
    much = [trial for trial in gaining if trial.share_of_rest > _MUCH and trial.moves > settings.smallest_move]
    most = max(much, key=lambda trial: trial.share_of_rest, default=None)
    return None if most is None or is_part_of_a_wave(most, found.model) else most


def _despite_strain(found: Found, settings: Settings) -> Trial | None:
    """Give the best of what would be believed beside the effects that were found, were no value of the lesson strained."""
    eased = replace(settings, despite_strain=True)
    beside = [trial for trial in found.tried if trial.model.terms[:-1] == found.model.terms and trial.term.part not in found.refused]
    good = [trial for trial in beside if trial.strained and believable(trial, eased, found.chance)]
    good = [trial for trial in good if not is_part_of_a_wave(trial, found.model)]
    return simplest(sorted(good, key=lambda trial: -merit(trial, settings)), settings) if good else None


def _exchanged(bench: Bench, found: Found, refused: Trial) -> Iterator[Trial]:
    """Give trials of what was refused in the place of each effect of the model."""
    values = refused.model.fitted.by_name
    start = np.array([values[name] for name in refused.term.parameters])
    for term in found.model.terms:
        before = fewer(bench, found.model, term)
        yield bench.trial(before, refused.term, before.terms, before.free, [start])


def plainly_better(other: Found, found: Found, settings: Settings) -> bool:
    """Say whether another model explains both recordings better, by more than the parameters cost that it has more, and has come to what it
    was begun for."""
    if other.to_ease and is_strained(other.model.fitted):
        return False
    more = sum(len(term.parameters) for term in other.model.terms) - sum(len(term.parameters) for term in found.model.terms)
    due = settings.margin + settings.per_parameter * max(more, 0)
    fitted = other.model.score.above(found.model.score, wide=True)
    judged = other.model.held_out.above(found.model.held_out, wide=True)
    return bool(min(fitted, judged) > due)
