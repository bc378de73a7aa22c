"""``diagnose``: the method, step by step. Each step is a function in a file of its own."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.diagnosis.answer import describe, recording_fault
from lathesim.diagnosis.explaining.chance import due, is_clear
from lathesim.diagnosis.explaining.plausible import own_residuals, strained
from lathesim.diagnosis.explaining.resolution import as_good, significant
from lathesim.diagnosis.explaining.search import explain, explains_the_motion, is_closed_loop
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explaining.trial import modelled, over, without
from lathesim.diagnosis.isolation.answerable import locked
from lathesim.diagnosis.location import missing_share
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.preparation import PreparedQuestion, Question, as_given, prepare, with_inputs_held, with_other_sign
from lathesim.diagnosis.recording_checks.checks import against_model, fault, of_a_slow_log, with_a_wrong_unit
from lathesim.diagnosis.recording_checks.mapped_elsewhere import against_the_machine
from lathesim.diagnosis.records.comparison import Step
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.records.found import Found
from lathesim.diagnosis.reporting.summary import OF_VALUES, headline, is_worse, names_steps_alone, stays_off
from lathesim.diagnosis.verdict import agrees, doubts, outdone, with_added_signals
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.estimates import as_simulated, estimates
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution import Progress
from lathesim.identification.records import Fitted, Free, Model, Standing, with_start
from lathesim.identification.replay.experiment import Experiment, RecordedMachine
from lathesim.identification.replay.joined import JoinedExperiment, joined
from lathesim.identification.replay.loading import Recorded

_STEPS = (
    "step 1 of 4, checking the recordings",
    "step 2 of 4, comparing explanations",
    "step 3 of 4, estimating sizes",
    "step 4 of 4, looking at what is left",
)


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
    progress(f"{_STEPS[0]}: against the commands of the controllers")
    prepared = prepare(question)
    if prepared.faults:
        return recording_fault(prepared.question, prepared.faults, prepared.findings, began)
    study = _study(prepared, _in_step(_STEPS[1], progress))
    study.progress("the lesson as it stands")
    motion = _Motion(prepared, study)
    found = replace(explain(study, instead=motion.explained), controller=prepared.controller)
    prepared, study = motion.prepared, motion.study
    prepared, study, found = _with_signs(prepared, study, found)
    prepared, study, found = _with_inputs_held(prepared, study, found)
    motion = replace(motion, prepared=prepared, study=study)
    found = motion.otherwise(found) or found if found.complete else found
    prepared, study = motion.prepared, motion.study
    prepared, study, found = _fitted_together(prepared, study, found)
    if not found.model.candidates and (
        faults := against_model(prepared.experiments, found, question.method, two_files=question.validation is not None)
    ):
        return recording_fault(prepared.question, faults, prepared.findings, began)
    study.progress("smooth functions of what the machine does")
    found, doubted = outdone(study, found, doubts(study, found.model))
    study.progress("what these recordings cannot answer")
    found, unanswerable = locked(study, found)
    progress(f"{_STEPS[2]}: fitting both recordings")
    values = estimates(found.model, prepared.experiment, prepared.validation, prepared.whole)
    values = as_simulated(values, found.model, prepared.experiment, prepared.validation)
    if faults := with_a_wrong_unit(found, values.values(), question.method, implausible=bool(strained(found.model.fitted))):
        return recording_fault(prepared.question, faults, prepared.findings, began)
    answer = describe(replace(study, progress=_in_step(_STEPS[3], progress)), prepared, found, values, doubted)
    if prepared.turned and answer.verdict in ("no_mismatch", "parameters_only"):
        return recording_fault(prepared.question, fault("sign", " ".join(prepared.turned)), prepared.findings, began)
    if faults := of_a_slow_log(prepared.question.fitted.findings, prepared.question.machine, answer):
        return recording_fault(prepared.question, faults, prepared.findings, began)
    if prepared.doubts and not agrees(answer):
        return recording_fault(prepared.question, prepared.doubts, prepared.findings, began)
    answer = _completed(replace(answer, rest=replace(answer.rest, unanswerable=unanswerable)), prepared, found)
    return replace(answer, search=replace(answer.search, wall_time=time.perf_counter() - began))


def _completed(answer: Diagnosis, prepared: PreparedQuestion, found: Found) -> Diagnosis:
    """Return an answer with what is known of the recordings, its first line, and what stays off."""
    answer = with_added_signals(answer, prepared.added)
    question = replace(
        answer.question,
        validation=prepared.validation_name,
        findings=(*prepared.findings, *prepared.turned),
        turned=prepared.turned,
        judges_itself=prepared.question.validation is None,
        together=isinstance(prepared.experiment, JoinedExperiment),
    )
    answer = replace(answer, question=question, search=replace(answer.search, untried=_untried(prepared, found)))
    method = prepared.question.method
    answer = replace(answer, sentence=headline(answer, method), complete=found.complete and not prepared.question.ends.is_over)
    if (answer.verdict in OF_VALUES or names_steps_alone(answer)) and (off := stays_off(answer, method)):
        # a lesson that explains a part of a recording is no adequate one, though nothing predicts the rest
        answer = replace(answer, rest=replace(answer.rest, adequate=False, left=(*answer.rest.left, *off)))
    if answer.names and any(is_worse(answer, name) and item.after > method.alike * item.before for name, item in answer.fit.items()):
        # what leads the lesson's own simulation away from the recording stands for something else
        answer = replace(answer, rest=replace(answer.rest, adequate=False))
    return answer


def _study(prepared: PreparedQuestion, progress: Progress) -> Study:
    """Return the recordings of a question as a search takes them; what judges itself asks more of each value."""
    question = prepared.question
    study = Study(prepared.experiment, prepared.validation, question.method, progress, prepared.before, question.ends)
    if study.judges_itself:
        study = replace(study, method=study.method.judged_by_itself(len(prepared.experiment.record)))
    return study


def _with_signs(prepared: PreparedQuestion, study: Study, found: Found) -> tuple[PreparedQuestion, Study, Found]:
    """Return what explains the recordings best, be it with a channel of the other sign.

    A channel that moves against the machine is turned round, and the search is made again: both explanations predict the same recordings.
    Where that predicts better and is not beyond chance, it is said.
    """
    if prepared.added or not found.complete:
        return prepared, study, found
    given = as_given(prepared.experiment)
    for channel in against_the_machine(prepared.experiments, given, method=study.method):
        study.progress(f"trying {channel} with the other sign")
        turned = with_other_sign(prepared, channel)
        study_of_turned = _study(turned, study.progress)
        other = explain(study_of_turned)
        fitted, predicted = over(other.model, found.model)
        if not other.complete or min(fitted.nats, predicted.nats) < due(study.method):
            continue
        if not is_clear(predicted, study.method):
            said = f"{channel} may have the other sign: turned round it is predicted better, but not beyond chance. Check it."
            prepared = replace(prepared, findings=(*prepared.findings, said))
        else:
            why = f"{channel} with the other sign predicts better by {predicted.nats:.0f} nats"
            step = Step("other sign", (), (), fitted.nats, predicted.nats, why)
            prepared, study = turned, study_of_turned
            found = replace(other, controller=prepared.controller, history=(step, *other.history))
    return prepared, study, found


def _with_inputs_held(prepared: PreparedQuestion, study: Study, found: Found) -> tuple[PreparedQuestion, Study, Found]:
    """Return what explains the recordings with driven inputs that are held until the next row, where that does as well with an effect less.

    Nobody said that they are interpolated. What is held acts half a row later on average, so that a lag would be named for it.
    """
    held = with_inputs_held(prepared) if found.worth and found.complete else None
    if held is None:
        return prepared, study, found
    study_of_held = _study(held, study.progress)
    study.progress("trying driven inputs as held until the next row")
    for own in found.worth.values():
        begun = without(study_of_held, found.model, own.candidate)
        if as_good(begun, own, study):
            other = explain(study_of_held, begun)
            fitted, predicted = over(begun, found.model)
            why = "inputs that are held until the next row explain the recordings as well without it"
            step = Step("held inputs", (), (f"{own.candidate.name} at {own.candidate.place}",), fitted.nats, predicted.nats, why)
            history = (*found.history, step, *other.history)
            return held, study_of_held, replace(other, controller=found.controller, history=history)
    return prepared, study, found


def _in_step(step: str, progress: Progress) -> Progress:
    """Return a function that reports lines of progress as those of a step."""

    def tell(text: str) -> None:
        told = f"{step}: {text.strip()}"
        progress(Standing.told(told, text.candidates) if isinstance(text, Standing) else told)

    return tell


@dataclass
class _Motion:
    """The search for what explains the motion itself, where the best explanation under the noise of unmeasured forces does not.

    Such forces would have to be about as large as those that act, or have led a closed loop off, which holds against them, or leave nothing
    to name: what is missing has passed for their noise. The error of the simulation then takes the place of that of its equations for all
    that follows, and ``prepared`` and ``study`` are of it. ``tried`` is what the search was made for in vain.
    """

    prepared: PreparedQuestion
    study: Study
    tried: PreparedQuestion | None = None

    def explained(self, found: Found) -> Found | None:
        """Return what explains the motion in the place of what has grown; none where a channel may have the other sign."""
        given = as_given(self.prepared.experiment)
        if not self.prepared.added and any(against_the_machine(self.prepared.experiments, given, method=self.study.method)):
            return None
        return self.otherwise(found)

    def otherwise(self, found: Found) -> Found | None:
        """Return what explains the motion in the place of what was found; none where this does, or nothing does."""
        prepared, study = self.prepared, self.study
        if (
            prepared is self.tried
            or prepared.before is not None
            or study.estimation.machine.output_error
            or explains_the_motion(study, found.model)
            or not (is_closed_loop(study) or _lacks_much(study, found))
        ):
            return None
        study.progress("the motion is not explained: trying the error of the simulation, without unmeasured forces")
        simulated = prepared.by_output_error()
        study_of_simulated = _study(simulated, study.progress)
        other = explain(study_of_simulated, of_motion=True)
        if not other.model.candidates or not explains_the_motion(study_of_simulated, other.model):
            # without an effect the two errors differ only by which noise they believe
            self.tried = prepared
            return None
        why = "what was named under the noise of unmeasured forces does not explain the motion"
        fitted, predicted = over(other.model, other.baseline)
        step = Step("error of the simulation", (), (), fitted.nats, predicted.nats, why)
        said = "Only large unmeasured forces would explain the motion so far: it was fitted anew, without such forces."
        self.prepared, self.study = replace(simulated, findings=(*simulated.findings, said)), study_of_simulated
        return replace(other, controller=found.controller, history=(step, *other.history))


def _lacks_much(study: Study, found: Found) -> bool:
    """Return whether some force that a model lacks is about as large as what acts there: a small one moves a free body just as far. Where
    nothing is named in the end, and nothing doubted, more than little is enough: a dry friction in one direction is a drift."""
    rows = range(len(study.estimation.machine.compare))
    most = max(missing_share(study.estimation, found.model.fitted, row)[0] for row in rows)
    if most > study.method.larger_part or found.model.candidates or not found.complete or most < study.method.little:
        return most > study.method.larger_part
    return not any(one.clear for one in doubts(study, found.model))


def _fitted_together(prepared: PreparedQuestion, study: Study, found: Found) -> tuple[PreparedQuestion, Study, Found]:
    """Return what explains both recordings fitted together, where each of them wants other values of the same model, or those of the first
    one lead the simulation of the second one astray: further than the lesson alone does, as it is given or fitted.

    One recording may leave a mixture of values open that two determine. The search goes on from what was found. Nothing is left to judge
    the answer, so that each value is due half the logarithm of the samples.
    """
    one_alone = prepared.question.validation is None or prepared.before is not None
    off = np.sqrt(np.mean(np.square(found.model.validation_fit.residual), axis=1))
    # by the error of the simulation, which judges both, an effect has to change a reading by more than errors of laws do
    by_laws = study.method.within_laws * study.validation.sensed.seen_spread
    usual = np.maximum(study.method.tie_errors * study.validation.sensed.replayed_floors, by_laws)
    astray = _is_led_astray(study, found)
    if one_alone or not found.complete or (np.all(off <= usual) and not astray):
        return prepared, study, found
    explained = bool(found.model.candidates) and explains_the_motion(study, found.model)
    if explained and is_closed_loop(study):
        # a loop holds the motion whatever the values are, so that its simulation says less of them than the forces do
        return prepared, study, found
    both = joined(prepared.experiments)
    if not astray and not _want_other_values(both, found.model, study.method):
        return prepared, study, found
    study.progress("each recording wants other values: fitting both together")
    if explained:  # values are left to find: what gained nothing on one recording is no rival on both
        near = {one.candidate.part for one in found.tried if significant(one, study)}
        both = replace(both, candidates=tuple(one for one in both.candidates if one.part in near))
    together = replace(prepared, experiments=(both, both), whole=both)
    study_of_both = _study(together, study.progress)
    begun = modelled(study_of_both, found.model.candidates, _fitted_to_both(both, found.model, _second_start(both, found.model)))
    other = explain(study_of_both, begun)
    if not other.complete or _is_further_off(study, found.model, study_of_both, other.model):
        return prepared, study, found
    gained = over(other.model, begun)[0]
    why = "each recording wants other values of what was found on the first one"
    step = Step("both together", (), (), gained.nats, gained.nats, why)
    return together, study_of_both, replace(other, controller=found.controller, history=(step, *other.history))


def _want_other_values(both: JoinedExperiment, model: Model, method: Method) -> bool:
    """Return whether values that both recordings share leave more than twice the power in a channel that values of their own leave.

    All but the first begin as they were recorded: a start of its own would pass for another value.
    """
    shared = _fitted_to_both(both, model)
    begun = ({}, *both.started({})[1:])
    alone = _powers(_fitted_alone(*one, shared) for one in zip(both.parts, begun, strict=True))
    return bool(np.any(alone < (1.0 - method.larger_part) * _powers((shared,))))


def _is_led_astray(study: Study, found: Found) -> bool:
    """Return whether the lesson's own simulation is further off with what was found than the lesson alone, as it is given or fitted; with
    effects, which recordings have confirmed, clearly further."""
    (as_given, with_it), own = _own_powers(study, found.model), study.validation.own
    size = np.maximum(study.method.errors * own.seen_floors, study.method.within_laws * own.seen_spread)
    resolved = own.seen.shape[1] * size**2
    alone = np.minimum(as_given, _own_powers(study, found.baseline)[1])
    clearly = study.method.alike**2 if found.model.candidates else 1.0
    return bool(np.any(with_it > clearly * np.maximum(alone, resolved)))


def _is_further_off(study: Study, model: Model, study_of_both: Study, other: Model) -> bool:
    """Return whether both recordings as a whole are further off with another model, in the lesson's own simulation, or in the replay that
    confirmed effects: one channel may lose a little of what another one gains."""
    first = replace(study, validation=study.estimation), replace(model, validation_fit=model.fitted)
    ways = [(_own_powers(study, model)[1] + _own_powers(*first)[1], _own_powers(study_of_both, other)[1])]
    if model.candidates:
        ways.append((_powers((model.fitted, model.validation_fit)), _powers((other.fitted,))))
    return not all(np.sum(np.log(after)) <= np.sum(np.log(before)) for before, after in ways)


def _own_powers(study: Study, model: Model) -> FloatArray:
    """Return the sums of squares that the lesson's own simulation leaves, (2, channels): with the values of the lesson, and of a model."""
    return np.asarray(np.sum(np.square(own_residuals(study, model)), axis=2))


def _powers(fits: Iterable[Fitted]) -> FloatArray:
    """Return the sum of squares that fits of several recordings leave of each channel, (channels,)."""
    return np.asarray(np.sum([np.sum(np.square(one.residual), axis=1) for one in fits], axis=0))


def _second_start(both: JoinedExperiment, model: Model) -> list[Free]:
    """Return the states with which the second recording starts as free values, from where a model has them."""
    names = dict(zip(both.begun[-1], both.started({})[-1], strict=True))
    found = model.validation_fit.by_name
    free = [one for one in both.start_states(both.sensed.plan) if one.name in names]
    return [replace(one, start=found.get(names[one.name], one.start)) for one in free]


def _fitted_to_both(both: JoinedExperiment, model: Model, starts: Sequence[Free] = ()) -> Fitted:
    """Return the fit of a model gone on with on both recordings; the second one begins as it was recorded, or with ``starts``."""
    constant = {name: model.fitted.constant[name] for name in both.sensed.settable(model.fitted.constant)}
    return fit(both.sensed, [*with_start(model.fitted), *starts], constant, rounds=2)


def _fitted_alone(part: Experiment, begun: Mapping[str, float], shared: Fitted) -> Fitted:
    """Return the fit to both recordings gone on with on one of them alone, which begins with the values ``begun`` if they are given."""
    constant = {name: shared.constant[name] for name in part.sensed.settable(shared.constant)} | dict(begun)
    return fit(part.sensed, [one for one in with_start(shared) if one.name not in constant], constant, rounds=2)


def _untried(prepared: PreparedQuestion, found: Found) -> tuple[str, ...]:
    """Return the candidates that a search which was stopped had not fitted."""
    if found.complete:
        return ()
    fitted = {trial.candidate.part for trial in found.tried} | {candidate.part for candidate in found.model.candidates}
    left = [candidate for candidate in prepared.experiment.candidates if candidate.part not in fitted]
    return tuple(f"{candidate.name} at {candidate.place}" for candidate in left)


def ask(
    lesson: str,
    machine: RecordedMachine,
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
