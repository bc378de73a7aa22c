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

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import believable, merit
from lathesim.diagnosis.selection.compare_models import Gains, compare_models, gains_over
from lathesim.diagnosis.selection.elimination import fewer
from lathesim.diagnosis.selection.laboratory import Laboratory, is_implausible
from lathesim.diagnosis.selection.trials import Asked, side_by_side
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Trial

_LATE = frozenset({"lag", "recording"})
"""Families of what acts or shows late."""


def retry_rivals(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search with each effect of a model of several compared with what came near it, in the place of it."""
    if len(found.model.candidates) < 2:
        return found
    for candidate in found.model.candidates:
        rivals = _near(candidate, found, method)
        if not rivals:
            continue
        laboratory.progress(f"trying again what came near {candidate.name} at {candidate.at}")
        if one_for_both := _in_two_places(laboratory, found, candidate, rivals, method):
            return one_for_both
        before = fewer(laboratory, found.model, candidate)
        values = found.model.fitted.by_name
        itself = Asked(candidate, before.candidates, before.free, [np.array([values[name] for name in candidate.parameters])])
        shaped = [_in_its_shape(trial, candidate, values) for trial in rivals]
        asked = [Asked(rival, before.candidates, before.free, starts) for rival, starts in shaped]
        own, *others = side_by_side(laboratory, before, [itself, *asked])
        # what it explained when it came in is what it is credited with
        more = found.removed_by(candidate) - own.share_of_all
        never_moved = {trial.candidate.part for trial in found.unmoved.get(candidate.part, [])}
        others = [trial for trial in others if trial.candidate.part not in never_moved or believable(trial, method, 0.0)]
        if not others:
            continue
        best = max(others, key=lambda trial: merit(trial, method))
        chosen = best if _is_better(best, own, method) else own
        credited = [replace(trial, share_of_all=trial.share_of_all + more) for trial in (own, *others)]
        trials = found.trials_with({chosen.candidate.part: credited}, *([candidate] if chosen is not own else []))
        found = replace(found, trials=trials)
        if chosen is not own:
            laboratory.progress(f"{chosen.candidate.name} takes the place of {candidate.name} beside the rest")
            found = found.accepted(laboratory.settled(chosen.model), "retry rivals", "beside the other effects it explains more")
    return found


def _in_its_shape(trial: Trial, candidate: Candidate, values: Mapping[str, float]) -> tuple[Candidate, list[FloatArray]]:
    """Return a rival with the values of a finer shape that an effect has got since, and where to start: a screw with harmonics is held
    against an encoder's disc with harmonics. Half a turn on the even ones have the other sign."""
    rival, fitted = trial.candidate, trial.model.fitted.by_name
    its_own = {name.partition(".")[2]: values[name] for name in candidate.parameters}
    more = [name for name in its_own if name in candidate.effect.identification.extended]
    if more and rival.shaped is not None and rival.effect.identification.extended == candidate.effect.identification.extended:
        rival = rival.shaped.keeping([*rival.parameters, *(f"{rival.part}.{name}" for name in more)])
    even, starts = candidate.effect.identification.second_harmonic, []
    for turned in (False, True) if rival is not trial.candidate else (False,):
        shape = {f"{rival.part}.{name}": -its_own[name] if turned and name in even else its_own[name] for name in more}
        starts.append(np.array([{**shape, **fitted}[name] for name in rival.parameters]))
    return rival, starts


def _near(candidate: Candidate, found: SearchResult, method: Method) -> list[Trial]:
    """Return the trials of other effects that came near an effect of the model, the nearest first."""
    trials = [*found.trials.get(candidate.part, []), *found.unmoved.get(candidate.part, [])]
    own = next((trial for trial in trials if trial.candidate.part == candidate.part), None)
    if own is None:
        return []
    there = {other.part for other in found.model.candidates}
    near = [
        trial
        for trial in trials
        if trial.candidate.part not in there and merit(trial, method) > method.selection.rival * merit(own, method)
    ]
    return sorted(near, key=lambda trial: -merit(trial, method))[: method.selection.most_rivals]


def _in_two_places(
    laboratory: Laboratory, found: SearchResult, candidate: Candidate, rivals: Sequence[Trial], method: Method
) -> SearchResult | None:
    """Return the search with a rival of an effect in its place and that of another one, if it does as well as both: two channels that are
    late are one drive that is, and two forces that grow are one edge that wears."""
    for other in (other for other in found.model.candidates if other is not candidate):
        asked = [trial for trial in rivals if _may_be_both(trial, candidate, other)]
        if not asked:
            continue
        before = fewer(laboratory, fewer(laboratory, found.model, candidate), other)
        starts = [np.array([trial.model.fitted.by_name[name] for name in trial.candidate.parameters]) for trial in asked]
        tried = side_by_side(
            laboratory,
            before,
            [Asked(trial.candidate, before.candidates, before.free, [start]) for trial, start in zip(asked, starts, strict=True)],
        )
        for trial in sorted((trial for trial in tried if believable(trial, method, 0.0)), key=lambda trial: -merit(trial, method)):
            settled = laboratory.settled(trial.model)
            parameters = len(trial.candidate.parameters) - len(candidate.parameters) - len(other.parameters)
            # one delay is never simulated as well as two shifts are fitted
            held = compare_models(
                Gains(gains_over(settled, found.model, full_band=True).estimation), method, effects=-1, parameters=parameters,
                explained=trial.gain,
            )  # fmt: skip
            if held.as_good and not is_implausible(settled.fitted, method=method):
                laboratory.progress(f"{trial.candidate.name} takes the places of {candidate.name} and {other.name}")
                shared = min(found.removed_by(candidate) + found.removed_by(other), 1.0)
                trials = found.trials_with({trial.candidate.part: [replace(trial, share_of_all=shared)]}, candidate, other)
                return found.accepted(settled, "retry rivals", "one effect explains what two did", trials=trials)
    return None


def _may_be_both(trial: Trial, candidate: Candidate, other: Candidate) -> bool:
    """Return whether the effect of a trial may be what two effects are: late where these are, or with a size in each of several places."""
    late = {trial.candidate.family, candidate.family, other.family} <= _LATE
    return late or (trial.candidate.acts_elsewhere and trial.candidate.shaped is None)


def _is_better(trial: Trial, own: Trial, method: Method) -> bool:
    """Return whether a rival does clearly better, and needs no other machine. Of the same equation at another place less is clear."""
    shape = own.candidate.effect.identification.extended
    other = trial.candidate.effect.identification.extended
    alike = bool(shape) and other == shape and trial.candidate.family == own.candidate.family
    reached = merit(own, method)
    held = compare_models(Gains(merit(trial, method) - reached), method, effects=1, explained=reached, alike=alike)
    return held.better and not is_implausible(trial.model.fitted, method=method)
