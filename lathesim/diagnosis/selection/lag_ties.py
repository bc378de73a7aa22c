"""What acts late and what shows late, held against each other with forces that may be slow.

A search takes forces that nobody modelled for white, which is quickly worked out. A filter in a sensor then explains how a slow load shows
in its reading, and gains what a lag of the drive, which filters no load, does not, though both leave the same of the motion. With forces
of any colour what only the noise had told apart is a tie.
Source: Ljung, System Identification, 2nd ed. 1999, section 7.4 (the likelihood of a model with its noise).
"""

from __future__ import annotations

from dataclasses import replace

from lathesim.diagnosis.method import Method
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.acceptance import merit
from lathesim.diagnosis.selection.compare_models import Gains, compare_models
from lathesim.diagnosis.selection.laboratory import Laboratory
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import with_start
from lathesim.identification.records.model import Model, Trial

_LATE = ("lag", "recording")
"""Families of what acts or shows late."""


def ties_of_late_effects(laboratory: Laboratory, found: SearchResult, method: Method) -> SearchResult:
    """Return the search in which what is as good as a late effect of the model, once forces may be slow, is tied with it."""
    for candidate in found.model.candidates:
        trials = found.trials.get(candidate.part, ())
        own = found.trial_of(candidate)
        if own is None or candidate.family not in _LATE:
            continue
        near = [trial for trial in trials if _is_near(trial, own, found.model, method)]
        if not near:
            continue
        laboratory.progress(
            f"holding {', '.join(trial.candidate.name for trial in near)} against {candidate.name} with forces that may be slow"
        )
        reached = _with_slow_forces(laboratory, own.model)
        gains = {trial.candidate.part: Gains(_with_slow_forces(laboratory, trial.model) - reached) for trial in near}
        alike = {part for part, gain in gains.items() if compare_models(gain, method, explained=own.full_band_gain).as_good}
        its_own = [_as_good_as(trial, own) if trial.candidate.part in alike else trial for trial in trials]
        found = replace(found, trials={**found.trials, candidate.part: its_own})
    return found


def _is_near(trial: Trial, own: Trial, model: Model, method: Method) -> bool:
    """Return whether a trial of another late effect came near and stood beside the same effects."""
    other: Candidate = trial.candidate
    beside = {candidate.part for candidate in trial.model.candidates} - {other.part} == {
        candidate.part for candidate in own.model.candidates
    } - {own.candidate.part}
    alike = other.family in _LATE and other not in model.candidates and beside
    return (
        alike
        and other.part != own.candidate.part
        and method.selection.rival * merit(own, method) < merit(trial, method) < merit(own, method)
    )


def _with_slow_forces(laboratory: Laboratory, model: Model) -> float:
    """Return the log-likelihood of the estimation recording with forces of any colour [nats]."""
    return fit(laboratory.experiment.sensed, with_start(model.fitted), model.fitted.constant, rounds=2, full_band=True, coloured=True).score


def _as_good_as(trial: Trial, own: Trial) -> Trial:
    return replace(
        trial,
        gain=own.gain,
        validation_gain=own.validation_gain,
        full_band_gain=own.full_band_gain,
        full_band_validation_gain=own.full_band_validation_gain,
        share_of_all=own.share_of_all,
    )
