"""Every explanation that a search tried, with what it predicts of held-out data and why it was kept or not: as rows and as text."""

from __future__ import annotations

import math
from collections.abc import Iterable

from lathesim.analysis.display_unit import text_table
from lathesim.diagnosis.explaining.chance import due, is_clear
from lathesim.diagnosis.explaining.density import gain
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.comparison import Explanation
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.records.search import Found, Tried
from lathesim.diagnosis.reporting.number_text import NOTHING, number, plain
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.model import is_full_band

HEAD = ("explanation", "kind", "gain", "error", "chance", "kept", "why")
LEGEND = (
    "Gain: by how much the logarithm of the predicted probability density of the held-out data rises above the lesson's (nats).",
    "A gain of 5 makes the data 150 times as probable. Error: the standard error of the gain. Chance: what the best of as many",
    "explanations gains where nothing is hidden. An explanation is kept if its gain is clearly above chance and no other gains more.",
)
LESSON = "the lesson, its uncertain values refitted"


def explanations_of(found: Found, method: Method = STANDARD) -> tuple[Explanation, ...]:
    """Return the explanations of a search: the lesson, the model that was found, and every effect that was fitted."""
    model = found.model
    rows = [Explanation(LESSON, "", "lesson", 0.0, 0.0, 0.0, not model.candidates, "every gain is counted from here")]
    if len(model.candidates) > 1:
        whole = gain(model.validation_fit, found.baseline.validation_fit, full_band=is_full_band(model.candidates))
        name = " + ".join(_text(candidate) for candidate in model.candidates)
        rows.append(Explanation(name, "", "effects", whole.nats, whole.error, due(method), True, "the answer"))
    return (*rows, *sorted((_of_trial(trial, found, method) for trial in best_of_each(found.tried)), key=lambda one: -one.gain))


def _of_trial(trial: Tried, found: Found, method: Method) -> Explanation:
    candidate, kept = trial.candidate, found.holds(trial.candidate)
    reason = _why_kept(candidate, found) if kept else _why_not(trial, method)
    chance = due(method, len(candidate.parameters))
    return Explanation(candidate.name, candidate.at, "effect", trial.predicted.nats, trial.predicted.error, chance, kept, reason)


def _why_not(trial: Tried, method: Method) -> str:
    """Return what speaks against a trial, the weightiest first."""
    if trial.fitted.nats <= due(method):
        return "gains too little on the recording that is fitted to be judged"
    if trial.predicted.nats <= 0.0:
        return "predicts the held-out data worse"
    if not is_clear(trial.predicted, method, len(trial.candidate.parameters)):
        return "gains no more than chance may"
    return "another explanation of the same error predicts as well or better, or is simpler"


def best_of_each(tried: Iterable[Tried]) -> list[Tried]:
    """Return of every candidate that was tried in several ways or rounds the trial that predicts best."""
    best: dict[str, Tried] = {}
    for trial in tried:
        other = best.get(trial.name)
        if other is None or (trial.predicted.nats, trial.fitted.nats) > (other.predicted.nats, other.fitted.nats):
            best[trial.name] = trial
    return list(best.values())


def _why_kept(candidate: Candidate, found: Found) -> str:
    steps = (step.why for step in found.history if _text(candidate) in step.came_in)
    return next(steps, "") or "it predicts better than what was tried in its place"


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
