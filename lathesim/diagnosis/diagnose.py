"""``diagnose``: the method, step by step. Each step is a function in a file of its own."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import replace

from lathesim.diagnosis.answer import describe, recording_fault
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.preparation import Prepared, prepare
from lathesim.diagnosis.pruning import leaner_model, prune_undetermined
from lathesim.diagnosis.question import Question
from lathesim.diagnosis.recording_checks.checks import against_model, of_a_slow_log, with_a_wrong_unit
from lathesim.diagnosis.recording_checks.quantisation import coarse_counts
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.selection.elimination import leave_out
from lathesim.diagnosis.selection.laboratory import is_implausible
from lathesim.diagnosis.selection.search import search
from lathesim.diagnosis.verdict.added_signals import agrees, with_added_signals
from lathesim.effects.effect import Effect
from lathesim.identification.estimation.estimates import Estimates, estimates
from lathesim.identification.execution.budget import Progress
from lathesim.identification.replay.experiment import Machine
from lathesim.identification.replay.loading import Recorded


def diagnose(question: Question, tell: Progress | None = None) -> Diagnosis:
    """Name the physics a simulation left out, or say why it cannot be named.

    1. Check the recordings by themselves and against the commands of the lesson's controllers.
    2. Fit the lesson as it stands (the baseline), and select effects of the catalogue, judged on the validation recording.
    3. Check the recordings against the model that was found.
    4. Estimate the sizes with intervals; drop effects whose interval includes nothing.
    5. Rank the effects, test what is left, decide; where the model stays inadequate, look for a formula.

    Interrupted with Ctrl-C, or where its time is over, the answer holds what was known until then (``complete`` is false).
    """
    began, progress = time.perf_counter(), tell or (lambda text: None)
    if question.before is not None:
        question = replace(question, method=question.method.beside_an_earlier_recording())
    prepared = prepare(question)
    if prepared.faults:
        return recording_fault(prepared.question, prepared.faults, prepared.findings, began)
    found = search(prepared.experiment, prepared.validation, question.method, progress, prepared.before)
    found = replace(found, controller=prepared.controller)
    if faults := against_model(prepared.experiments, found, question.method, two_files=question.validation is not None):
        return recording_fault(prepared.question, faults, prepared.findings, began)
    progress("fitting the found model to everything")
    found, values = prune_undetermined(prepared, found, progress)
    implausible = is_implausible(found.model.fitted, method=question.method)
    if faults := with_a_wrong_unit(found, values.values(), question.method, implausible=implausible):
        return recording_fault(prepared.question, faults, prepared.findings, began)
    answer = _answer(prepared, found, values, progress)
    if found.complete and not answer.adequate and not question.method.ends.is_over:
        answer = _leaner_answer(prepared, found, answer, values, progress)
        answer = answer if question.method.ends.is_over else _answer_without_effects(prepared, found, answer, progress)
    if faults := of_a_slow_log(prepared.question.fitted.findings, prepared.question.machine, answer):
        return recording_fault(prepared.question, faults, prepared.findings, began)
    if prepared.doubts and not agrees(answer):
        return recording_fault(prepared.question, prepared.doubts, prepared.findings, began)
    answer = with_added_signals(answer, prepared.added)
    spent, complete = time.perf_counter() - began, found.complete and not question.method.ends.is_over
    answer = replace(answer, validation=prepared.validation_name, findings=prepared.findings, untried=_untried(prepared, found))
    return replace(answer, wall_time=spent, complete=complete)


def _untried(prepared: Prepared, found: SearchResult) -> tuple[str, ...]:
    """Return the candidates that a search which was stopped had not fitted, those first that the last screening gave most."""
    if found.complete:
        return ()
    fitted = {trial.candidate.part for trial in found.tried} | {candidate.part for candidate in found.model.candidates}
    gains = {item.candidate.part: item.gain for item in found.screened}
    left = [candidate for candidate in prepared.experiment.candidates if candidate.part not in fitted]
    left.sort(key=lambda candidate: -gains.get(candidate.part, 0.0))
    return tuple(f"{candidate.name} at {candidate.at}" for candidate in left)


def _answer(prepared: Prepared, found: SearchResult, values: Estimates, progress: Progress) -> Diagnosis:
    counts = coarse_counts(prepared.experiments, found.model.candidates, method=prepared.question.method)
    return describe(prepared, found, values, counts, progress)


def _leaner_answer(prepared: Prepared, found: SearchResult, answer: Diagnosis, values: Estimates, progress: Progress) -> Diagnosis:
    """Return the answer without effects whose size may be nothing, or that explain nothing, where that one is adequate; else ``answer``."""
    leaner = leaner_model(prepared, found, answer, values, progress)
    if leaner is None:
        return answer
    without, useless = leaner
    kept = estimates(without.model, prepared.experiment, prepared.validation, prepared.whole)
    other = _answer(prepared, without, kept, progress)
    return other if other.adequate and (useless or other.names) else answer


def _answer_without_effects(prepared: Prepared, found: SearchResult, answer: Diagnosis, progress: Progress) -> Diagnosis:
    """Return the answer without any effect where those that were taken in are no explanation, and nothing speaks against the lesson.

    What speaks against effects, that they explain little or that their size may be nothing, is no reason to believe that physics is
    missing: that rests on what the lesson leaves by itself.
    """
    if answer.verdict != "unknown" or not found.model.candidates:
        return answer
    progress("asking whether anything is missing without them")
    without = leave_out(found, found.model.candidates, prepared.experiment, prepared.validation, progress, method=prepared.question.method)
    kept = estimates(without.model, prepared.experiment, prepared.validation, prepared.whole)
    other = _answer(prepared, without, kept, progress)
    return other if other.adequate else answer


def ask(
    lesson: str,
    machine: Machine,
    recordings: tuple[Recorded, ...],
    effects: Iterable[type[Effect]],
    method: Method = STANDARD,
    *,
    changed: bool = False,
) -> Question:
    """Return a question; the second of the recordings, if there are two, is the one that judges.

    Where the machine has ``changed`` the last one is from before that.
    """
    before = recordings[-1] if changed else None
    asked = recordings[:-1] if changed else recordings
    return Question(lesson, machine, asked[0], asked[1] if len(asked) > 1 else None, tuple(effects), method, before)
