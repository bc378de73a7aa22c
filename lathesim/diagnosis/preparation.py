"""Recordings made ready to be answered: their experiments, a controller value that is another one, and checks on the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from lathesim.diagnosis.candidates.eligibility import without_one_sided
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.recording_checks.added_input import UnrecordedInput, unrecorded_inputs, with_inputs, with_signals
from lathesim.diagnosis.recording_checks.checks import (
    CHECKS_OF_CLOCK,
    CHECKS_OF_MAPPING,
    against_commands,
    first_found,
    found_by,
    too_slow_for_commands,
)
from lathesim.diagnosis.recording_checks.controllers import AnotherLaw, another_law, controller_value, with_commands_followed
from lathesim.diagnosis.recording_checks.wrong_readings import sensor_zeros
from lathesim.diagnosis.records.found import ControllerValue, Found
from lathesim.effects.effect import Effect
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution import Deadline
from lathesim.identification.records import Fitted
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, baseline_free, build_experiments
from lathesim.identification.replay.loading import Recorded
from lathesim.identification.replay.validation_split import parted
from lathesim.recordings.raw_table import Finding


@dataclass(frozen=True)
class Question:
    """What a diagnosis is asked: a machine, the recording it is fitted to, the one it is judged on, and the effects to be tried.

    With a recording from ``before`` the machine changed the question is what changed, and no longer what the lesson left out.
    """

    lesson: str
    machine: RecordedMachine
    fitted: Recorded
    validation: Recorded | None
    effects: tuple[type[Effect], ...]
    method: Method = field(default_factory=Method)
    before: Recorded | None = None
    ends: Deadline = field(default_factory=Deadline)
    """Before it the answer stands, with what is known by then."""


@dataclass(frozen=True)
class PreparedQuestion:
    """The experiments of a question, and what was found out before anything is searched.

    ``whole`` is the experiment of the whole file where both recordings are parts of one. ``controller`` is a value that replaces the
    lesson's; ``question`` is the one with that value. With ``faults`` the recordings are not fit to be answered, and there are no
    experiments where the reader found them. ``added`` are signals that nobody recorded and that the experiments know of; ``doubts`` are
    the faults that there are unless the rest of the machine agrees. ``turned`` says which channels are read with the other sign.
    """

    question: Question
    findings: tuple[str, ...] = ()
    faults: tuple[Finding, ...] = ()
    experiments: tuple[Experiment, ...] = ()
    whole: Experiment | None = None
    validation_name: str = ""
    controller: ControllerValue | None = None
    added: tuple[UnrecordedInput, ...] = ()
    doubts: tuple[Finding, ...] = ()
    turned: tuple[str, ...] = ()

    @cached_property
    def before(self) -> Experiment | None:
        """The recording from before the change, in the machine of the question."""
        earlier, question = self.question.before, self.question
        return None if earlier is None else build_experiments(question.machine, [(earlier.name, earlier.record)], question.effects)[0]

    def by_output_error(self) -> PreparedQuestion:
        """Return the recordings whose errors are weighed alike at all frequencies of the motion."""
        whole = None if self.whole is None else self.whole.by_output_error()
        return replace(self, experiments=tuple(one.by_output_error() for one in self.experiments), whole=whole)

    @property
    def experiment(self) -> Experiment:
        """The estimation recording."""
        return self.experiments[0]

    @property
    def validation(self) -> Experiment:
        """The validation recording."""
        return self.experiments[1]


def prepare(question: Question) -> PreparedQuestion:
    """Return the experiments of a question, checked by themselves and against the commands of the lesson's controllers.

    The order matters: a wrong sample period is asked for before any value of a controller is doubted, as all of them would make up for it.
    """
    method, findings = question.method, _findings(question)
    if faults := tuple(fault for recorded in _recordings(question) for fault in recorded.faults):
        return PreparedQuestion(question, findings, faults)
    experiments, whole, name = _experiments(question)
    findings = tuple(dict.fromkeys((*findings, *(zero for one in experiments for zero in sensor_zeros(one, method=method)))))
    prepared = PreparedQuestion(question, findings, (), tuple(experiments), whole, name)
    if faults := first_found(CHECKS_OF_MAPPING, [(one, as_given(one)) for one in experiments], method):
        return replace(prepared, faults=faults)
    given = with_commands_followed(prepared.experiment, as_given(prepared.experiment))
    if faults := found_by(CHECKS_OF_CLOCK, [(one, given) for one in experiments], method):
        return replace(prepared, faults=faults)
    if other := controller_value(prepared.experiment, prepared.validation, given, method=method):
        prepared = _with_controller_value(prepared, other)
        given = with_commands_followed(prepared.experiment, as_given(prepared.experiment))
    return _against_commands(prepared, given)


def _against_commands(prepared: PreparedQuestion, given: Mapping[str, float]) -> PreparedQuestion:
    """Return the recordings checked against the controllers' commands, with signals that nobody recorded where these explain one."""
    question, method = prepared.question, prepared.question.method
    # a feed-forward may be more than all that the lesson's controller does
    laws = {law.channel: law.feed_forward for law in another_law(prepared.experiment, prepared.validation, given, method=method)}
    recorded = prepared.experiments if prepared.whole is None else (prepared.whole,)
    added = unrecorded_inputs(recorded, given, laws, method=method)
    faults = against_commands(prepared.experiments, given, laws, method, [one.command for one in added])
    if added and not faults and not slow_log(question):
        return _with_inputs(prepared, given, added, against_commands(prepared.experiments, given, laws, method))
    slow = too_slow_for_commands(question.fitted.findings, question.machine.compare) if faults else ()
    return replace(prepared, faults=slow or faults)


def _recordings(question: Question) -> list[Recorded]:
    return [recorded for recorded in (question.fitted, question.validation, question.before) if recorded]


def _findings(question: Question) -> tuple[str, ...]:
    """Return what the reader found, with the recording where not all of them have it, and what the question is about."""
    recordings = _recordings(question)
    common = set.intersection(*(set(recorded.findings) for recorded in recordings))
    found = dict.fromkeys(
        str(finding) if finding.serious or not finding.channel or finding in common else f"{recorded.name}, {finding}"
        for recorded in recordings
        for finding in recorded.findings
    )
    if question.before is not None:
        found[f"Held beside {question.before.name}, from before the change: what explains as much of that is no part of the change."] = None
    return tuple(found)


def _with_controller_value(prepared: PreparedQuestion, other: ControllerValue) -> PreparedQuestion:
    """Return the experiments of the machine with another value of a controller."""
    question = replace(prepared.question, machine=other.in_machine(prepared.question.machine))
    experiments, whole, name = _experiments(question)
    return PreparedQuestion(question, (*prepared.findings, str(other)), (), tuple(experiments), whole, name, other)


def _with_inputs(
    prepared: PreparedQuestion, given: Mapping[str, float], added: Sequence[UnrecordedInput], doubts: tuple[Finding, ...]
) -> PreparedQuestion:
    """Return the recordings with signals that nobody recorded as known inputs."""
    question, recorded = prepared.question, prepared.experiments if prepared.whole is None else (prepared.whole,)
    records = [with_signals(one, given, added) for one in recorded]
    question = replace(question, machine=with_inputs(question.machine, added), fitted=replace(question.fitted, record=records[0]))
    if question.validation is not None:
        question = replace(question, validation=replace(question.validation, record=records[1]))
    experiments, whole, _ = _experiments(question)
    return replace(prepared, question=question, experiments=tuple(experiments), whole=whole, added=tuple(added), doubts=doubts)


def with_other_sign(prepared: PreparedQuestion, channel: str) -> PreparedQuestion:
    """Return the recordings with a channel of the other sign, and a sentence that says so."""
    question = prepared.question
    fitted = _turned(question.fitted, channel)
    validation, before = (one and _turned(one, channel) for one in (question.validation, question.before))
    question = replace(question, fitted=fitted, validation=validation, before=before)
    experiments, whole, _ = _experiments(question)
    finding = f"{channel} is recorded with the other sign. Write scale: -1 for its column."
    return replace(prepared, question=question, experiments=tuple(experiments), whole=whole, turned=(*prepared.turned, finding))


def _turned(recorded: Recorded, channel: str) -> Recorded:
    column = recorded.record.channels[channel]
    return replace(recorded, record=recorded.record.with_channel(channel, column.unit, -column.values, column.description))


def with_inputs_held(prepared: PreparedQuestion) -> PreparedQuestion | None:
    """Return the recordings with driven inputs held until the next row that were assumed to be interpolated; none without such inputs."""
    question, between = prepared.question, prepared.question.machine.between
    assumed = {name: replace(one, moves=False, held=True) for name, one in between.items() if one.assumed and one.moves}
    if not assumed:
        return None
    fact, done = "held until the next row it explains the recordings as well, with fewer effects", "write 'held: true' if it was commanded"
    said = {str(one): str(replace(one, fact=fact, done=done)) for one in question.fitted.findings if one.channel in assumed}

    def held(one: Experiment) -> Experiment:
        return replace(one, machine=replace(one.machine, between={**between, **assumed}))

    return replace(
        prepared,
        question=replace(question, machine=replace(question.machine, between={**between, **assumed})),
        findings=tuple(said.get(one, one) for one in prepared.findings),
        experiments=tuple(map(held, prepared.experiments)),
        whole=prepared.whole and held(prepared.whole),
    )


def _experiments(question: Question) -> tuple[list[Experiment], Experiment | None, str]:
    """Return the experiments of the fitted and of the validation recording, and of the whole where both are parts of one file."""
    fitted = question.fitted
    if question.validation is not None:
        pairs = [(fitted.name, fitted.record), (question.validation.name, question.validation.record)]
        return (
            without_one_sided(build_experiments(question.machine, pairs, question.effects), method=question.method),
            None,
            question.validation.name,
        )
    experiment, validation, whole = without_one_sided(
        parted(question.machine, fitted.name, fitted.record, question.effects), method=question.method
    )
    return [experiment, validation], whole, validation.name


def as_given(experiment: Experiment) -> dict[str, float]:
    """Return the uncertain values as the lesson has them."""
    return {item.name: item.given for item in baseline_free(experiment.machine)}


def as_measured(experiment: Experiment, found: Found) -> Fitted:
    """Return the values as the lesson has them, with the start of the recording fitted."""
    constant = {item.name: item.given for item in found.baseline.fitted.free if item.name in experiment.machine.uncertain}
    return fit(experiment.sensed, experiment.start_states(experiment.sensed.plan), constant, rounds=2, iterations=6, slopes="kept")


def slow_log(question: Question) -> bool:
    """Return whether the recording has not every decision of the controllers."""
    return any(finding.kind in ("coarse", "interpolated") for finding in question.fitted.findings)


def other_laws(question: Question, found: Found, experiment: Experiment, validation: Experiment) -> list[AnotherLaw]:
    """Return the controllers that have another law; a slower log, or a reading that is late, makes another one of the lesson's own."""
    if slow_log(question) or any(candidate.effect.identification.delay for candidate in found.model.candidates):
        return []
    return another_law(experiment, validation, with_commands_followed(experiment, as_given(experiment)), method=question.method)
