"""What came near an effect when it came in, held against it again once everything else was found.

With the rest of what is missing still there much is alike: a delay and the lag of a current loop leave the same as long as a friction is
not known, and a current that is shown late may do better than a drive that acts late. Each rival is tried in the place of the effect,
beside all others of the model: one that does better takes the place, and so does one that does as well and makes another effect needless;
what else does as well is a tie.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.acceptance import EQUAL_SHARE, TIE_SHARE, believable, merit
from lathesim.diagnosis.selection.elimination import fewer
from lathesim.diagnosis.selection.laboratory import Bench, is_strained
from lathesim.diagnosis.selection.trials import Asked, side_by_side
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.model import Trial

_NEAR = 0.8
"""Share of what an effect gained that a rival must have gained to be tried again."""
_MOST = 4
_LATE = frozenset({"lag", "recording"})
"""Families of what acts or shows late."""


def try_rivals_again(bench: Bench, found: Found, settings: Settings) -> None:
    """Hold each effect of a model of several against what came near it, in the place of it."""
    if len(found.model.terms) < 2:
        return
    for term in found.model.terms:
        rivals = _near(term, found, settings)
        if not rivals:
            continue
        bench.say(f"trying again what came near {term.name} at {term.at}")
        if _takes_two_places(bench, found, term, rivals, settings):
            return
        before = fewer(bench, found.model, term)
        values = found.model.fitted.by_name
        itself = Asked(term, before.terms, before.free, [np.array([values[name] for name in term.parameters])])
        shaped = [_in_its_shape(trial, term, values) for trial in rivals]
        asked = [Asked(rival, before.terms, before.free, starts) for rival, starts in shaped]
        own, *others = side_by_side(bench, before, [itself, *asked])
        # what it took away when it came in is what it is credited with
        more = found.removed_by(term) - own.share_of_all
        never_moved = {trial.term.part for trial in found.unmoved.get(term.part, [])}
        others = [trial for trial in others if trial.term.part not in never_moved or believable(trial, settings, 0.0)]
        if not others:
            continue
        best = max(others, key=lambda trial: merit(trial, settings))
        chosen = best if _is_better(best, own, settings) else own
        credited = [replace(trial, share_of_all=trial.share_of_all + more) for trial in (own, *others)]
        if chosen is not own:
            bench.say(f"{chosen.term.name} takes the place of {term.name} beside the rest")
            found.model = bench.settled(chosen.model)
            del found.trials[term.part]
        found.trials[chosen.term.part] = credited


def _in_its_shape(trial: Trial, term: Term, values: Mapping[str, float]) -> tuple[Term, list[FloatArray]]:
    """Give a rival with the values of a finer shape that an effect has got since, and where to start: a screw with harmonics is held
    against an encoder's disc with harmonics. Half a turn on the even ones have the other sign."""
    rival, fitted = trial.term, trial.model.fitted.by_name
    its_own = {name.partition(".")[2]: values[name] for name in term.parameters}
    more = [name for name in its_own if name in term.effect.finer_shape]
    if more and rival.shaped is not None and rival.effect.finer_shape == term.effect.finer_shape:
        rival = rival.shaped.keeping([*rival.parameters, *(f"{rival.part}.{name}" for name in more)])
    starts = []
    for turned in (False, True) if rival is not trial.term else (False,):
        shape = {f"{rival.part}.{name}": -its_own[name] if turned and name.startswith("second") else its_own[name] for name in more}
        starts.append(np.array([{**shape, **fitted}[name] for name in rival.parameters]))
    return rival, starts


def _near(term: Term, found: Found, settings: Settings) -> list[Trial]:
    """Give the trials of other effects that came near an effect of the model, the nearest first."""
    trials = [*found.trials.get(term.part, []), *found.unmoved.get(term.part, [])]
    own = next((trial for trial in trials if trial.term.part == term.part), None)
    if own is None:
        return []
    there = {other.part for other in found.model.terms}
    near = [trial for trial in trials if trial.term.part not in there and merit(trial, settings) > _NEAR * merit(own, settings)]
    return sorted(near, key=lambda trial: -merit(trial, settings))[:_MOST]


def _takes_two_places(bench: Bench, found: Found, term: Term, rivals: Sequence[Trial], settings: Settings) -> bool:
    """Let a rival of a late effect take its place and that of another one, if it does as well as both: two channels that are late are one
    drive that is. Say whether one did."""
    both = [other for other in found.model.terms if other is not term and {other.family, term.family} <= _LATE]
    for other in both:
        before = fewer(bench, fewer(bench, found.model, term), other)
        asked = [trial for trial in rivals if trial.term.family in _LATE]
        starts = [np.array([trial.model.fitted.by_name[name] for name in trial.term.parameters]) for trial in asked]
        tried = side_by_side(
            bench, before, [Asked(trial.term, before.terms, before.free, [start]) for trial, start in zip(asked, starts, strict=True)]
        )
        for trial in sorted((trial for trial in tried if believable(trial, settings, 0.0)), key=lambda trial: -merit(trial, settings)):
            settled = bench.settled(trial.model)
            saved = settings.margin + settings.per_parameter * (len(term.parameters) + len(other.parameters) - len(trial.term.parameters))
            # one delay is never simulated as well as two shifts are fitted
            if found.model.score.above(settled.score, wide=True) < max(saved, EQUAL_SHARE * trial.gain) and not is_strained(settled.fitted):
                bench.say(f"{trial.term.name} takes the places of {term.name} and {other.name}")
                shared = min(found.removed_by(term) + found.removed_by(other), 1.0)
                found.model = settled
                del found.trials[term.part], found.trials[other.part]
                found.trials[trial.term.part] = [replace(trial, share_of_all=shared)]
                return True
    return False


def _is_better(trial: Trial, own: Trial, settings: Settings) -> bool:
    """Say whether a rival does clearly better, and needs no other machine. Of the same equation at another place less is clear."""
    more = merit(trial, settings) - merit(own, settings)
    shape = own.term.effect.finer_shape
    share = EQUAL_SHARE if shape and trial.term.effect.finer_shape == shape and trial.term.family == own.term.family else TIE_SHARE
    return more > max(settings.margin, share * merit(own, settings)) and not is_strained(trial.model.fitted)
