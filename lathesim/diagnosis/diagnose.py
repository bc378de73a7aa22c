"""``diagnose``: the method, step by step. Each step is a function in a file of its own."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import replace

from lathesim.diagnosis.answer import describe, recording_fault
from lathesim.diagnosis.explaining.plausible import with_possible_sizes
from lathesim.diagnosis.explaining.search import explain
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explaining.values import IMPLAUSIBLE, deviations
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.preparation import Prepared, prepare
from lathesim.diagnosis.question import Question
from lathesim.diagnosis.recording_checks.checks import against_model, of_a_slow_log, with_a_wrong_unit
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.verdict.added_signals import agrees, with_added_signals
from lathesim.effects.effect import Effect
from lathesim.identification.estimation.estimates import estimates
from lathesim.identification.execution.budget import Progress
from lathesim.identification.replay.experiment import Machine
from lathesim.identification.replay.loading import Recorded


def diagnose(question: Question, tell: Progress | None = None) -> Diagnosis:
    """Name the physics a simulation left out, or say why it cannot be named.

    1. Check the recordings by themselves and against the commands of the lesson's controllers.
    2. Fit the lesson as it stands (the baseline), other values and effects, each judged by what it predicts of the validation recording.
    3. Without an effect, check the recordings against the lesson.
    4. Estimate the sizes with intervals.
    5. Let the flexible explanation predict what is left, decide, and describe.

    Interrupted with Ctrl-C, or where its time is over, the answer holds what was known until then (``complete`` is false).
    """
    began, progress = time.perf_counter(), tell or (lambda text: None)
    if question.before is not None:
        question = replace(question, method=question.method.beside_an_earlier_recording())
    prepared = prepare(question)
    if prepared.faults:
        return recording_fault(prepared.question, prepared.faults, prepared.findings, began)
    study = with_possible_sizes(Study(prepared.experiment, prepared.validation, question.method, progress, prepared.before))
    progress("fitting the lesson as it stands")
    found = replace(explain(study), controller=prepared.controller)
    if not found.model.candidates and (
        faults := against_model(prepared.experiments, found, question.method, two_files=question.validation is not None)
    ):
        return recording_fault(prepared.question, faults, prepared.findings, began)
    progress("fitting the found model to everything")
    values = estimates(found.model, prepared.experiment, prepared.validation, prepared.whole)
    implausible = bool(deviations(found.model.fitted).max(initial=0.0) > IMPLAUSIBLE)
    if faults := with_a_wrong_unit(found, values.values(), question.method, implausible=implausible):
        return recording_fault(prepared.question, faults, prepared.findings, began)
    answer = describe(replace(study, progress=progress), prepared, found, values)
    if faults := of_a_slow_log(prepared.question.fitted.findings, prepared.question.machine, answer):
        return recording_fault(prepared.question, faults, prepared.findings, began)
    if prepared.doubts and not agrees(answer):
        return recording_fault(prepared.question, prepared.doubts, prepared.findings, began)
    answer = with_added_signals(answer, prepared.added)
    spent, complete = time.perf_counter() - began, found.complete and not question.method.ends.is_over
    answer = replace(answer, validation=prepared.validation_name, findings=prepared.findings, untried=_untried(prepared, found))
    return replace(answer, wall_time=spent, complete=complete)


def _untried(prepared: Prepared, found: Found) -> tuple[str, ...]:
    """Return the candidates that a search which was stopped had not fitted."""
    if found.complete:
        return ()
    fitted = {trial.candidate.part for trial in found.tried} | {candidate.part for candidate in found.model.candidates}
    left = [candidate for candidate in prepared.experiment.candidates if candidate.part not in fitted]
    return tuple(f"{candidate.name} at {candidate.at}" for candidate in left)


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
