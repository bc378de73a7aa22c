"""``diagnose``: from a machine and its recordings to what physics the simulation left out.

    recording checked -> baseline refitted within its uncertainties -> mismatch located -> candidates screened, fitted and judged on the
    validation recording -> values and intervals -> is the model adequate? -> verdict

Every step is a function in a file of its own; here they are put in order.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from lathesim.diagnosis.candidates.eligibility import without_one_sided
from lathesim.diagnosis.discovery.generated_plugin import plugin_text
from lathesim.diagnosis.discovery.sparse_regression import discover
from lathesim.diagnosis.location.closed_loop_fit import Compared, compared
from lathesim.diagnosis.location.missing_share import missing_signals, next_to_nothing
from lathesim.diagnosis.location.operating_conditions import resting
from lathesim.diagnosis.location.spindle_orders import told, turn_lines
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.question import Question
from lathesim.diagnosis.recording_checks.change_points import changed_midway, jumped_midway
from lathesim.diagnosis.recording_checks.clipping import clipped_reading
from lathesim.diagnosis.recording_checks.command_consistency import contradicted
from lathesim.diagnosis.recording_checks.controller_law import AnotherLaw, another_law
from lathesim.diagnosis.recording_checks.controller_value import controller_value, with_commands_followed
from lathesim.diagnosis.recording_checks.different_machine import another_machine
from lathesim.diagnosis.recording_checks.exchanged_channels import exchanged_with, swapped
from lathesim.diagnosis.recording_checks.mapped_elsewhere import mapped_elsewhere
from lathesim.diagnosis.recording_checks.mistaken_unit import in_another_unit, wrong_unit
from lathesim.diagnosis.recording_checks.quantisation import coarse_counts
from lathesim.diagnosis.recording_checks.sample_clock import of_another_period
from lathesim.diagnosis.recording_checks.sensor_zero import sensor_zeros
from lathesim.diagnosis.records.diagnosis import VERDICTS, BaselineValue, Diagnosis, FoundEffect, Interval, Verdict, listed, no_surer_than
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.reporting.effect_report import bounded, declared_in, reported
from lathesim.diagnosis.reporting.evidence import gather, located, strongest_variables
from lathesim.diagnosis.reporting.lesson_entry import lesson_entry, on_validation, without_undetermined
from lathesim.diagnosis.reporting.remarks import implausible_values, not_determined, not_shown, still_missing, unseen_forms, value_instead
from lathesim.diagnosis.selection.acceptance import is_of_a_clock
from lathesim.diagnosis.selection.forward import leave_out
from lathesim.diagnosis.selection.laboratory import Laboratory, is_implausible, judged_score
from lathesim.diagnosis.selection.refusal import all_push, is_much_of_it
from lathesim.diagnosis.selection.search import search
from lathesim.diagnosis.verdict.adequacy import Adequacy, adequacy
from lathesim.diagnosis.verdict.ranking import RankedEffect, explains_nothing, rank_effects, removed_share
from lathesim.diagnosis.verdict.residual_tests import degrades_a_channel, hardly_missed, not_adequate
from lathesim.effects.effect import Effect
from lathesim.identification.estimation.estimates import (
    CONFIDENCE,
    Estimate,
    Estimates,
    estimates,
    interval_includes_neutral,
    is_significant,
    only_combination_identifiable,
    with_error_of_form,
)
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.machine.roles import closes_a_loop
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted, with_start
from lathesim.identification.replay.experiment import Experiment, Machine, baseline_free, build_experiments
from lathesim.identification.replay.loading import Recorded
from lathesim.identification.replay.validation_split import parted

Progress = Callable[[str], None]


def diagnose(question: Question, tell: Progress | None = None) -> Diagnosis:
    """Answer a question. Stopped with Ctrl-C, the answer holds what was known until then (``complete`` is false)."""
    began = time.perf_counter()
    progress = tell or (lambda text: None)
    faults = [str(fault) for fault in (*question.fitted.faults, *(question.validation.faults if question.validation else ()))]
    # what both recordings have in common is said once
    findings = tuple(
        dict.fromkeys(str(finding) for recorded in (question.fitted, question.validation) if recorded for finding in recorded.findings)
    )
    if not faults:
        (experiment, validation), whole, held_name = _experiments(question)
        findings = tuple(
            dict.fromkeys((*findings, *sensor_zeros(experiment, method=question.method), *sensor_zeros(validation, method=question.method)))
        )
        faults = [sentence for one in (experiment, validation) if (sentence := exchanged_with(one, _as_given(one), method=question.method))]
    if not faults:
        faults = [sentence for one in (experiment, validation) if (sentence := mapped_elsewhere(one, _as_given(one)))]
    if not faults:
        given = with_commands_followed(experiment, _as_given(experiment))
        # before any value of a controller is doubted: all of them would make up for a clock
        faults = [sentence for one in (experiment, validation) if (sentence := of_another_period(one, given, method=question.method))]
    if not faults:
        if other := controller_value(experiment, validation, given, method=question.method):
            findings = (*findings, str(other))
            question = replace(question, machine=other.in_machine(question.machine))
            (experiment, validation), whole, held_name = _experiments(question)
            given = with_commands_followed(experiment, _as_given(experiment))
        # a feed-forward may be more than all that the lesson's controller does
        laws = {law.channel: law.feed_forward for law in another_law(experiment, validation, given, method=question.method)}
        checks = [
            (
                contradicted(one, given, laws, method=question.method),
                swapped(one, given, method=question.method),
                in_another_unit(one, given, method=question.method),
            )
            for one in (experiment, validation)
        ]
        faults = [sentence for pair in checks for sentence in pair if sentence]
    if faults:
        return _recording_fault(question, faults, findings, began)
    found = search(experiment, validation, question.method, progress)
    found.controller = other
    if question.validation is not None and (stranger := another_machine(found.model, experiment, validation, method=question.method)):
        return _recording_fault(question, [stranger], findings, began)
    judged = ((experiment, found.baseline.fitted), (validation, found.baseline.validation_fit))
    for fault in (changed_midway, clipped_reading, *([] if found.model.candidates else [jumped_midway])):
        if told_of := next((sentence for one, fitted in judged if (sentence := fault(one, fitted, method=question.method))), ""):
            return _recording_fault(question, [told_of], findings, began)
    progress("fitting the found model to everything")
    values = estimates(found.model, experiment, validation, whole)
    doubtful = _doubtful(found, experiment, validation, values, method=question.method)
    if doubtful:
        progress(f"dropping {', '.join(candidate.name for candidate in doubtful)}: its confidence interval includes zero")
        leave_out(found, doubtful, experiment, validation, progress)
        values = estimates(found.model, experiment, validation, whole)
    if found.model.candidates and explains_nothing(
        validation, found.baseline.validation_fit, on_validation(validation, found, values.values()), method=question.method
    ):
        names = ", ".join(candidate.name for candidate in found.model.candidates)
        progress(f"dropping {names}: it does not improve the validation recording")
        leave_out(found, found.model.candidates, experiment, validation, progress)
        values = estimates(found.model, experiment, validation, whole)
    credible = [] if found.far_off or is_implausible(found.model.fitted, method=question.method) else found.model.candidates
    # beside a value of the lesson that is further off than possible a factor on a reading makes up for that
    if mistaken := wrong_unit(
        [candidate for candidate in credible if found.removed_by(candidate) > question.method.verdict.named_share],
        values.values(),
        method=question.method,
    ):
        return _recording_fault(question, [mistaken], findings, began)
    counts = coarse_counts((experiment, validation), found.model.candidates, method=question.method)
    answer = _answer(question, found, experiment, validation, values, counts, progress)
    if found.complete and not answer.adequate:
        answer = _without_doubtful(question, found, answer, (experiment, validation, whole), values, progress) or answer
    if slow := _of_a_slow_log(question, answer):
        return _recording_fault(question, [slow], findings, began)
    return replace(
        answer,
        validation=held_name,
        findings=findings,
        wall_time=time.perf_counter() - began,
        complete=found.complete,
    )


def _doubtful(
    found: SearchResult, experiment: Experiment, validation: Experiment, values: Estimates, method: Method = STANDARD
) -> list[Candidate]:
    """Return the effects whose size may be nothing: those whose sizes the recordings do not agree on, lags of a small part of a sample, and
    such whose intervals hold nothing.
    All go that act at moving parts and explain next to nothing of what acts there.
    Of these a single one goes where nothing that matters was missing, and small ones beside others where no force that matters was missing
    at their place or the lesson's own simulation is further off with the whole model in some channel."""
    trifling = (
        found.model.candidates
        and all_push(experiment, found.model.candidates)
        and not any(is_much_of_it(candidate, found, method=method) for candidate in found.model.candidates)
    )
    if trifling and next_to_nothing(missing_signals(validation, found.baseline, found.model, method=method), method=method):
        return list(found.model.candidates)
    period, model = experiment.machine.assembly.sample_period, found.model.fitted.by_name
    in_time = [
        candidate
        for candidate in found.model.candidates
        if is_of_a_clock(candidate, model, period, len(experiment.record) * period, method=method)
    ]
    doubtful = [candidate for candidate in found.model.candidates if candidate not in in_time or not is_significant(candidate, values)]
    unsure = [
        candidate
        for candidate in found.model.candidates
        if candidate not in doubtful
        and interval_includes_neutral(candidate, values)
        and not only_combination_identifiable(candidate, values)
    ]
    single = len(found.model.candidates) == 1
    unsure = [candidate for candidate in unsure if single or found.removed_by(candidate) < method.verdict.named_share]
    if not unsure:
        return doubtful
    own = _own(validation, found, values)
    if not single and degrades_a_channel(own.fit, method=method):
        return doubtful + unsure
    evidence = gather(experiment, validation, found, own, method=method)
    channels = validation.machine.compare
    return doubtful + [
        candidate for candidate in unsure if hardly_missed(evidence, channels, "" if single else candidate.at, method=method)
    ]


def _without_doubtful(
    question: Question,
    found: SearchResult,
    answer: Diagnosis,
    experiments: tuple[Experiment, Experiment, Experiment | None],
    values: Estimates,
    progress: Progress,
) -> Diagnosis | None:
    """Return the answer without effects whose size may be nothing, or without any where all take nothing away of the validation recording,
    if nothing speaks against that; else none."""
    experiment, validation, whole = experiments
    useless = bool(found.model.candidates) and answer.removed_share <= 0.0 and question.method.against_null_maximum
    doubtful = [
        candidate
        for candidate in found.model.candidates
        if useless or (interval_includes_neutral(candidate, values) and not only_combination_identifiable(candidate, values))
    ]
    if not doubtful or (len(doubtful) == len(found.model.candidates) and not useless):
        return None
    why = "which take nothing away" if useless else "whose size may be nothing"
    progress(f"asking whether {', '.join(candidate.name for candidate in doubtful)} can go, {why}")
    leaner = replace(found)
    leave_out(leaner, doubtful, experiment, validation, progress)
    counts = coarse_counts((experiment, validation), leaner.model.candidates, method=question.method)
    other = _answer(
        question,
        leaner,
        experiment,
        validation,
        estimates(leaner.model, experiment, validation, whole),
        counts,
        progress,
    )
    return other if other.adequate and (useless or other.verdict in ("named", "tied")) else None


def _own(validation: Experiment, found: SearchResult, values: Estimates) -> Compared:
    return compared(validation, found.baseline.validation_fit.by_name, on_validation(validation, found, values.values()).by_name)


def _recording_fault(question: Question, faults: list[str], findings: tuple[str, ...], began: float) -> Diagnosis:
    return Diagnosis(
        "recording_fault",
        f"{VERDICTS['recording_fault']} {faults[0]}",
        question.lesson,
        question.fitted.name,
        question.validation.name if question.validation else question.fitted.name,
        findings=tuple(dict.fromkeys((*findings, *faults))),
        wall_time=time.perf_counter() - began,
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


def _answer(
    question: Question,
    found: SearchResult,
    experiment: Experiment,
    validation: Experiment,
    values: Estimates,
    counts: Sequence[tuple[Candidate, Estimate]],
    progress: Progress,
) -> Diagnosis:
    progress("simulating the lesson before and after")
    moved = _values_are_off(experiment, found, _given(experiment, found).by_name, method=question.method)
    before = found.baseline.validation_fit if found.model.candidates else _given(validation, found)
    reported_fit = on_validation(validation, found, values.values())
    as_the_lesson = {found.controller.name: found.controller.given} if found.controller else {}
    own = compared(validation, {**before.by_name, **as_the_lesson}, reported_fit.by_name)
    evidence = gather(experiment, validation, found, own, method=question.method)
    ranked = [
        *rank_effects(found, question.method, experiment.one_sided),
        *[RankedEffect(candidate, 1.0, (), (), np.nan, np.nan) for candidate, _ in counts],
    ]
    read = {f"{candidate.part}.{candidate.effect.spacing}": count for candidate, count in counts}
    after = strongest_variables(evidence.bars, [], after=True, method=question.method)
    baseline = _baseline(experiment, found, values)
    taken = removed_share(validation, before, reported_fit)
    unsized = [
        candidate
        for candidate in found.model.candidates
        if interval_includes_neutral(candidate, values, question.method.verdict.undetermined_size)
    ]
    judged = adequacy(
        experiment,
        validation,
        found,
        evidence,
        own,
        baseline,
        taken,
        _other_laws(question, found, experiment, validation),
        unsized,
        method=question.method,
    )
    sure = with_error_of_form(values, found.model.candidates, judged.form_left) if judged.form_left else values
    verdict = _verdict(found, ranked, moved, judged, sure, method=question.method)
    names = verdict in ("named", "tied")
    told_of = replace(sure, by_name={**sure.by_name, **read})
    candidates = [item.candidate for item in ranked]
    effects = tuple(reported(item, told_of, experiment) for item in ranked)
    if names:
        effects = tuple(without_undetermined(effects, candidates, validation, found, told_of.values(), method=question.method))
    else:
        effects = tuple(no_surer_than(max(0.0, taken), effect) for effect in effects)
    if effects and found.values_instead:
        effects = (replace(effects[0], tied_with=(*effects[0].tied_with, *found.values_instead)), *effects[1:])
    location = located(validation, found, evidence, named=names, method=question.method)
    if found.controller and not effects:
        location = replace(location, components=(found.controller.name.partition(".")[0],))
    if judged.laws and not names:
        location = replace(location, components=tuple(law.controller for law in judged.laws))
    if counts:
        hosts = [candidate.at.partition(".")[0] for candidate in (*found.model.candidates, *[candidate for candidate, _ in counts])]
        others = location.components if found.model.candidates else ()
        location = replace(location, components=tuple(dict.fromkeys([*hosts, *others])))
    candidate = None
    if not judged.adequate:
        progress("looking for a formula for what is left")
        candidate = discover(experiment, found.model.fitted, validation, found.model.validation_fit, method=question.method)
    return Diagnosis(
        verdict=verdict,
        sentence=_sentence(verdict, effects, found.values_off),
        lesson=question.lesson,
        recording=question.fitted.name,
        validation="",
        effects=effects,
        location=location,
        fit=own.fit,
        removed_share=taken,
        adequate=judged.adequate,
        shortfall=not_adequate((*judged.reasons, *judged.weak)) if names else "",
        baseline=baseline,
        insert=tuple(lesson_entry(*pair, found.model.fitted, experiment) for pair in zip(effects, candidates, strict=True))
        if names
        else (),
        left=(
            *(f"{law}." if law.feed_forward else f"{law}: a filter, a feed-forward, another gain." for law in judged.laws),
            *still_missing(evidence, after, found, question.method),
            *resting(validation, found.model.validation_fit, method=question.method),
            *map(str, judged.bands),
            *(f"{told}." for told in judged.commanded),
            *(f"{name} is off by no more than its loop swings by chance between two steps of a converter." for name in judged.by_chance),
            *told(
                turn_lines(validation, found.model.validation_fit, method=question.method),
                {name: item.unit for name, item in own.fit.items()},
            ),
            *implausible_values(judged.implausible, baseline),
            *not_shown(found.baseline.fitted, experiment.machine.uncertain, experiment.sensed.seen_floors, method=question.method),
            *value_instead(found.far_off, baseline, found.factor_instead, whole=judged.adequate or names),
        ),
        not_told=(*not_determined(effects), *unseen_forms(ranked)) if names else (),
        discovered=f"{candidate.formula}, which explains {candidate.share:.0%} of what is left at {candidate.at}" if candidate else "",
        plugin=plugin_text(candidate) if candidate else "",
        evidence=evidence,
    )


def _other_laws(question: Question, found: SearchResult, experiment: Experiment, validation: Experiment) -> list[AnotherLaw]:
    """Return the controllers that have another law; a slower log, or a reading that is late, makes another one of the lesson's own."""
    slow_log = any(finding.kind in ("coarse", "interpolated") for finding in question.fitted.findings)
    if slow_log or any(candidate.effect.late_by for candidate in found.model.candidates):
        return []
    return another_law(experiment, validation, with_commands_followed(experiment, _as_given(experiment)), method=question.method)


def _of_a_slow_log(question: Question, answer: Diagnosis) -> str:
    """Return a sentence where what nothing explains sits in a controller that decided more often than was recorded; empty where it does
    not."""
    slow = next((finding for finding in question.fitted.findings if finding.kind == "coarse"), None)
    suspect = next(iter(answer.location.components), "")
    part = next((part for part in question.machine.assembly.parts if part.name == suspect), None)
    if answer.verdict != "unknown" or slow is None or part is None or not closes_a_loop(part):
        return ""
    fact = f"{slow.fact[:1].upper()}{slow.fact[1:]}"
    return f"{fact}: what nothing explains of {suspect} may be what happened between two samples. Record each decision, or every k-th."


def _given(experiment: Experiment, found: SearchResult) -> Fitted:
    """Return the values as the lesson has them, with the start of the recording fitted."""
    constant = {item.name: item.given for item in found.baseline.fitted.free if item.name in experiment.machine.uncertain}
    starts = experiment.start_states(experiment.sensed.plan)
    return fit(experiment.sensed, starts, constant, rounds=2, iterations=6, slopes="kept")


def _as_given(experiment: Experiment) -> dict[str, float]:
    """Return the uncertain values as the lesson has them."""
    return {item.name: item.given for item in baseline_free(experiment.machine)}


def _values_are_off(experiment: Experiment, found: SearchResult, given: dict[str, float], method: Method = STANDARD) -> bool:
    """Return whether other values of the uncertain parameters explain much that the given ones leave."""
    laboratory = Laboratory(experiment, experiment, lambda text: None, found.baseline.fitted.noise)
    names = [item for item in with_start(found.baseline.fitted) if item.name not in experiment.machine.uncertain]
    constant = {name: given[name] for name in experiment.machine.uncertain}
    as_given = fit(experiment.sensed, names, constant, rounds=2, iterations=6, slopes="kept")
    error, refitted = laboratory.error(experiment, as_given), found.baseline.error
    gain = found.baseline.score.motion - judged_score(experiment, as_given).motion
    return bool(gain > 10.0 and np.max((error - refitted) / error) > method.verdict.values_moved)


def _verdict(
    found: SearchResult, ranked: list[RankedEffect], moved: bool, judged: Adequacy, sure: Estimates, method: Method = STANDARD
) -> Verdict:
    """Return what comes of it. A model that leaves something is a name as far as it takes most of the error away, and no error of its form
    makes its first effect nothing."""
    if not ranked:
        if judged.reasons:
            return "unknown"
        return "parameters_only" if moved or found.values_off else "no_mismatch"
    first = ranked[0].candidate
    if judged.reasons and (
        judged.removed < method.verdict.named_share or (first in found.model.candidates and interval_includes_neutral(first, sure))
    ):
        return "unknown"
    return "tied" if ranked[0].tied or found.values_instead else "named"


def _sentence(verdict: Verdict, effects: tuple[FoundEffect, ...], far_off: tuple[str, ...]) -> str:
    if verdict == "parameters_only" and far_off:
        others = f" (or {' or '.join(far_off[1:])})" if len(far_off) > 1 else ""
        return f"No physics is missing, but {far_off[0]}{others} is further off than the lesson holds possible."
    if verdict not in ("named", "tied") or not effects:
        return VERDICTS[verdict]
    names = [f"{effect.effect} at {effect.at}" + (f" (or {', '.join(effect.tied_with)})" if effect.tied_with else "") for effect in effects]
    return f"The simulation left out {listed(names)}."


def _baseline(experiment: Experiment, found: SearchResult, values: Estimates) -> dict[str, BaselineValue]:
    result = {}
    for item in found.baseline.fitted.free:
        if item.name not in experiment.machine.uncertain:
            continue
        estimate = values.by_name[item.name]
        half = CONFIDENCE * estimate.error
        declared = declared_in(experiment, item.name)
        interval = bounded(Interval(estimate.value, declared.unit, estimate.value - half, estimate.value + half), declared)
        without = found.baseline.fitted.by_name[item.name]
        result[item.name] = BaselineValue(declared.unit, item.given, without, estimate.value, interval.low, interval.high)
    if other := found.controller:
        half = CONFIDENCE * other.error
        result[other.name] = BaselineValue(other.unit, other.given, other.value, other.value, other.value - half, other.value + half)
    return result


def ask(lesson: str, machine: Machine, recordings: tuple[Recorded, ...], effects: Iterable[type[Effect]]) -> Question:
    """Put a question together."""
    return Question(lesson, machine, recordings[0], recordings[1] if len(recordings) > 1 else None, tuple(effects))
