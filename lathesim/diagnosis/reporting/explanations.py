"""Every explanation that a search tried, with what it predicts of held-out data and why it was kept or not: as rows and as text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from lathesim.analysis.text_table import text_table
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.comparison import Explanation
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.reporting.number_text import NOTHING, number, plain
from lathesim.diagnosis.selection.acceptance import gains_enough
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import Trial

HEAD = ("explanation", "kind", "gain", "error", "chance", "kept", "why")
LEGEND = (
    "Gain: by how much the logarithm of the predicted probability density of the held-out data rises above the lesson's (nats).",
    "A gain of 5 makes the data 150 times as probable. Error: the standard error of the gain. Chance: what the best of as many",
    "explanations gains where nothing is hidden. An explanation is kept if its gain is clearly above chance and no other gains more.",
)
LESSON = "the lesson, its uncertain values refitted"


def explanations_of(found: SearchResult, method: Method = STANDARD) -> tuple[Explanation, ...]:
    """Return the explanations of a search: the lesson, the model that was found, every effect that was fitted, and those that were not."""
    model = found.model
    lesson = Explanation(LESSON, "", "lesson", 0.0, 0.0, 0.0, not model.candidates, "every gain is counted from here")
    rows = [lesson]
    if len(model.candidates) > 1:
        gain = model.validation.motion - found.baseline.validation.motion
        parameters = sum(len(candidate.parameters) for candidate in model.candidates)
        name = " + ".join(_text(candidate) for candidate in model.candidates)
        rows.append(Explanation(name, "", "effects", gain, gain_error(gain, parameters), found.null_maximum, True, "the answer"))
    best = best_of_each(found.tried)
    rows += sorted((_of_trial(trial, found, method) for trial in best), key=lambda one: -one.gain)
    fitted = {_text(trial.candidate) for trial in best}
    waiting = (one for one in found.screened if _text(one.candidate) not in fitted)
    return (*rows, *(_not_fitted(one.candidate, one.gain, found) for one in waiting))


def best_of_each(tried: Iterable[Trial]) -> list[Trial]:
    """Return of every candidate that was tried in several ways or rounds the trial that predicts best."""
    best: dict[str, Trial] = {}
    for trial in tried:
        name = _text(trial.candidate)
        if name not in best or (trial.validation_gain, trial.gain) > (best[name].validation_gain, best[name].gain):
            best[name] = trial
    return list(best.values())


def gain_error(gain: float, parameters: int) -> float:
    """Return the standard error of a log-likelihood gain G [nats] of k parameters: the root of 2 G - k/2, that of half a non-central
    chi-squared variable. Source: S. S. Wilks, Annals of Mathematical Statistics 9 (1938)."""
    return math.sqrt(max(2.0 * gain - 0.5 * parameters, 0.5 * parameters)) if math.isfinite(gain) else math.nan


def _of_trial(trial: Trial, found: SearchResult, method: Method) -> Explanation:
    candidate, gain = trial.candidate, trial.validation_gain
    kept = found.holds(candidate)
    reason = _why_kept(candidate, found) if kept else next(_why_not(trial, found, method))
    gain = gain if math.isfinite(gain) else math.nan
    error = gain_error(gain, len(candidate.parameters))
    return Explanation(candidate.name, candidate.at, "effect", gain, error, found.null_maximum, kept, reason)


def _not_fitted(candidate: Candidate, promised: float, found: SearchResult) -> Explanation:
    reason = f"not fitted: {promised:.0f} is the most that it can gain on the recording that is fitted"
    return Explanation(candidate.name, candidate.at, "effect", math.nan, math.nan, found.null_maximum, False, reason)


def _why_kept(candidate: Candidate, found: SearchResult) -> str:
    steps = (step.why for step in found.history if _text(candidate) in step.came_in)
    return next(steps, "") or "it predicts better than what was tried in its place"


def _why_not(trial: Trial, found: SearchResult, method: Method) -> Iterator[str]:
    """Yield what speaks against a trial, the weightiest first."""
    if not np.isfinite(trial.validation_gain):
        yield "gains too little on the recording that is fitted to be judged"
    if trial.validation_gain <= 0.0:
        yield "predicts the held-out data worse"
    if not gains_enough(trial, method, found.null_maximum):
        yield "gains no more than chance may"
    if trial.implausible or trial.becomes_implausible:
        yield "needs a value that the lesson holds impossible"
    if trial.closed_loop_degradation > method.shared.alike:
        yield "the simulation of the whole machine gets worse with it"
    if trial.share_of_all <= method.share_of_all:
        yield f"explains only {trial.share_of_all:.1%} of the error"
    kept = [one.validation_gain for one in found.tried if found.holds(one.candidate)]
    if found.model.candidates:
        kept.append(found.model.validation.motion - found.baseline.validation.motion)
    if max(kept, default=-math.inf) >= trial.validation_gain:
        yield "another one predicts as well or better"
    yield "left out by a rule on sizes, and not for its gain"


def _text(candidate: Candidate) -> str:
    return f"{candidate.name} at {candidate.at}"


def explanation_lines(diagnosis: Diagnosis, most_waiting: int = 5) -> list[str]:
    """Return the table of a decision as lines of text; of effects that were not fitted the ``most_waiting`` that promise most."""
    if not diagnosis.explanations:
        return ["", "No explanation was tried: a check of the recording decided."]
    rows = [tuple(plain(cell) for cell in row) for row in explanation_rows(diagnosis.explanations)]
    judged = sum(math.isfinite(one.gain) for one in diagnosis.explanations)
    shown = judged + most_waiting
    more = [f"{len(rows) - shown} more were not fitted: they can gain no more than the last of these."] if len(rows) > shown else []
    return ["", "How it was decided:", *text_table([HEAD, *rows[:shown]]), *more, *LEGEND]


def explanation_rows(explanations: tuple[Explanation, ...]) -> list[tuple[str, ...]]:
    """Return a row for each explanation, those that gain most first and those without a gain last."""
    ordered = sorted(explanations, key=lambda one: -one.gain if math.isfinite(one.gain) else math.inf)
    return [(one.text, one.kind, *_numbers(one), "yes" if one.kept else "no", one.reason) for one in ordered]


def _numbers(one: Explanation) -> tuple[str, str, str]:
    gain, error, chance = (number(value, 0) if math.isfinite(value) else NOTHING for value in (one.gain, one.standard_error, one.chance))
    return gain, error, chance
