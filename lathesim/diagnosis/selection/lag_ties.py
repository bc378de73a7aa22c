"""What acts late and what shows late, held against each other with forces that may be slow.

A search takes forces that nobody modelled for white, which is quickly worked out. A filter in a sensor then explains how a slow load shows
in its reading, and gains what a lag of the drive, which filters no load, does not, though both leave the same of the motion. With forces
of any colour what only the noise had told apart is a tie.
Source: Ljung, System Identification, 2nd ed. 1999, section 7.4 (the likelihood of a model with its noise).
"""

from __future__ import annotations

from dataclasses import replace

from lathesim.diagnosis.method import Settings
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.selection.acceptance import EQUAL_SHARE, merit
from lathesim.diagnosis.selection.laboratory import Bench
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.fit import with_start
from lathesim.identification.records.model import Model, Trial

_LATE = ("lag", "recording")
"""Families of what acts or shows late."""
_NEAR = 0.9
"""Share of what a late effect gained that another one must have gained to be held against it."""
_EQUAL = 4.0
"""Nats within which they are alike, or the usual share of what the effect gained."""


def ties_of_late_effects(bench: Bench, found: Found, settings: Settings) -> None:
    """Tell what is as good as a late effect of the model, once forces may be slow, as tied with it."""
    for term in found.model.terms:
        trials = found.trials.get(term.part, [])
        own = next((trial for trial in trials if trial.term.part == term.part), None)
        if own is None or term.family not in _LATE:
            continue
        near = [trial for trial in trials if _is_near(trial, own, found.model, settings)]
        if not near:
            continue
        bench.say(f"holding {', '.join(trial.term.name for trial in near)} against {term.name} with forces that may be slow")
        reached = _with_slow_forces(bench, own.model)
        width = max(_EQUAL, EQUAL_SHARE * own.wide_gain)
        alike = {trial.term.part for trial in near if _with_slow_forces(bench, trial.model) > reached - width}
        found.trials[term.part] = [_as_good_as(trial, own) if trial.term.part in alike else trial for trial in trials]


def _is_near(trial: Trial, own: Trial, model: Model, settings: Settings) -> bool:
    """Say whether a trial of another late effect came near and stood beside the same effects."""
    other: Term = trial.term
    beside = {term.part for term in trial.model.terms} - {other.part} == {term.part for term in own.model.terms} - {own.term.part}
    alike = other.family in _LATE and other not in model.terms and beside
    return alike and other.part != own.term.part and _NEAR * merit(own, settings) < merit(trial, settings) < merit(own, settings)


def _with_slow_forces(bench: Bench, model: Model) -> float:
    """Give the log-likelihood of the fitted recording with forces of any colour [nats]."""
    return fit(bench.rig.sensed, with_start(model.fitted), model.fitted.constant, rounds=2, wide=True, coloured=True).score


def _as_good_as(trial: Trial, own: Trial) -> Trial:
    return replace(
        trial,
        gain=own.gain,
        held_out_gain=own.held_out_gain,
        wide_gain=own.wide_gain,
        wide_held_out_gain=own.wide_held_out_gain,
        share_of_all=own.share_of_all,
    )
