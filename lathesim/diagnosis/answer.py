"""The answer of a diagnosis, put together from the search, the estimates and the tests of what is left."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.diagnosis.discovery.generated_plugin import plugin_text
from lathesim.diagnosis.discovery.sparse_regression import discover
from lathesim.diagnosis.location.closed_loop_fit import Compared, compared
from lathesim.diagnosis.location.operating_conditions import resting
from lathesim.diagnosis.location.spindle_orders import told, turn_lines
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.preparation import Prepared, as_measured, other_laws
from lathesim.diagnosis.question import Question
from lathesim.diagnosis.recording_checks.checks import SLOW_LOG
from lathesim.diagnosis.records.diagnosis import (
    NAMING,
    TOO_SLOW,
    VERDICTS,
    BaselineValue,
    Diagnosis,
    Evidence,
    FoundEffect,
    Interval,
    Location,
    PossibleEffect,
    Verdict,
    no_surer_than,
)
from lathesim.diagnosis.records.discovered import Discovered
from lathesim.diagnosis.records.residual_test import Criterion, all_of, held
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.reporting.effect_report import bounded, declared_in, reported
from lathesim.diagnosis.reporting.evidence import gather, located, strongest_variables
from lathesim.diagnosis.reporting.explanations import explanations_of
from lathesim.diagnosis.reporting.lesson_entry import lesson_entry, on_validation, without_undetermined
from lathesim.diagnosis.reporting.remarks import implausible_values, not_determined, not_shown, still_missing, unseen_forms, value_instead
from lathesim.diagnosis.selection.laboratory import Laboratory, judged_score
from lathesim.diagnosis.verdict.adequacy import Adequacy, adequacy
from lathesim.diagnosis.verdict.deciding_channel import deciding_channel
from lathesim.diagnosis.verdict.decision import CLOSEST, decide, sentence_of
from lathesim.diagnosis.verdict.further_effects import Possible, further_effects
from lathesim.diagnosis.verdict.grounds import gathered
from lathesim.diagnosis.verdict.ranking import RankedEffect, rank_effects, removed_share
from lathesim.diagnosis.verdict.stability import stability
from lathesim.identification.estimation.estimates import (
    CONFIDENCE,
    Estimate,
    Estimates,
    estimates,
    with_error_of_form,
)
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution.budget import Progress
from lathesim.identification.records.candidate import Candidate
from lathesim.identification.records.fit import Fitted, Free, with_start
from lathesim.identification.replay.experiment import Experiment
from lathesim.lessons.sensor_sides import assumed_sides
from lathesim.recordings.finding import Finding


@dataclass(frozen=True)
class _Outcome:
    """What the answer is drawn from: the recordings, what was found, the lesson's own simulation, what is missing, what was decided."""

    prepared: Prepared
    found: SearchResult
    own: Compared
    evidence: Evidence
    baseline: dict[str, BaselineValue]
    judged: Adequacy
    names: bool
    """Whether the verdict names effects."""

    @property
    def method(self) -> Method:
        """The numbers that decide."""
        return self.prepared.question.method


def describe(
    prepared: Prepared,
    found: SearchResult,
    values: Estimates,
    counts: Sequence[tuple[Candidate, Estimate]],
    progress: Progress,
) -> Diagnosis:
    """Return the answer: effects ranked, what is left tested, the verdict decided, and all of it in words."""
    question, (experiment, validation), method = prepared.question, prepared.experiments, prepared.question.method
    progress("simulating the lesson before and after")
    moved = _values_moved(experiment, found, as_measured(experiment, found).by_name, method=method)
    before = found.baseline.validation_fit if found.model.candidates else as_measured(validation, found)
    reported_fit = on_validation(validation, found, values.values())
    own = _own_simulation(validation, found, before, reported_fit)
    evidence = gather(experiment, validation, found, own, method=method)
    ranked = _ranked(experiment, found, counts, method)
    taken = removed_share(validation, before, reported_fit, method=method)
    baseline, laws = _baseline(experiment, found, values), other_laws(question, found, experiment, validation)
    judged = adequacy(experiment, validation, found, evidence, own, baseline, taken, laws, values, method=method)
    sure = with_error_of_form(values, found.model.candidates, judged.form_left) if judged.form_left else values
    further = _further_effects(prepared, found)
    grounds = gathered(found, ranked, judged, moved, sure, bool(further), method)
    rule = decide(grounds)
    outcome = _Outcome(prepared, found, own, evidence, baseline, judged, rule.verdict in NAMING)
    effects = _effects(outcome, ranked, replace(sure, by_name={**sure.by_name, **_read(counts)}), taken)
    formula, possible = _formula(outcome, progress), _possible(outcome, further, rule.verdict)
    return Diagnosis(
        verdict=rule.verdict,
        sentence=sentence_of(rule, effects, found.values_off, found.jointly_off, changed=question.before is not None),
        lesson=question.lesson,
        recording=question.fitted.name,
        validation="",
        effects=effects,
        location=_location(outcome, effects, [candidate for candidate, _ in counts]),
        fit=own.fit,
        removed_share=taken,
        adequate=judged.adequate,
        shortfall=judged.shortfall if outcome.names or rule.reason == CLOSEST else "",
        baseline=baseline,
        insert=_entries(outcome, effects, ranked),
        left=_left(outcome, possible),
        not_told=(*not_determined(effects), *unseen_forms(ranked), *_sides(outcome, ranked)) if outcome.names else (),
        discovered=f"{formula.formula}, which explains {formula.share:.0%} of what is left at {formula.at}" if formula else "",
        plugin=plugin_text(formula) if formula else "",
        evidence=evidence,
        rule=rule.reason,
        history=found.history,
        residual_tests=judged.tests,
        possible=possible,
        stability=stability(grounds),
        explanations=explanations_of(found, method),
    )


def _sides(outcome: _Outcome, ranked: Sequence[RankedEffect]) -> list[str]:
    """Return what is assumed of the sensors at the springs that are named."""
    hosts = dict.fromkeys(item.candidate.at.partition(".")[0] for item in ranked if item.candidate.effect.beyond)
    return [told for host in hosts if (told := assumed_sides(outcome.prepared.question.machine.assembly, host))]


def _own_simulation(validation: Experiment, found: SearchResult, before: Fitted, reported_fit: Fitted) -> Compared:
    """Return how far the lesson's own simulation is off, before and after; before, the controller is as the lesson says."""
    as_the_lesson = {found.controller.name: found.controller.given} if found.controller else {}
    return compared(validation, {**before.by_name, **as_the_lesson}, reported_fit.by_name)


def _ranked(
    experiment: Experiment, found: SearchResult, counts: Sequence[tuple[Candidate, Estimate]], method: Method
) -> list[RankedEffect]:
    """Return the effects that were found, ranked, and then those whose size was read off a count of the recordings."""
    return [
        *rank_effects(found, method, experiment.one_sided),
        *[RankedEffect(candidate, 1.0, (), (), np.nan, np.nan) for candidate, _ in counts],
    ]


def _read(counts: Sequence[tuple[Candidate, Estimate]]) -> dict[str, Estimate]:
    """Return the estimates that were read off a count of the recordings, by the name of their parameter."""
    return {f"{candidate.part}.{candidate.effect.identification.spacing}": count for candidate, count in counts}


def _effects(outcome: _Outcome, ranked: Sequence[RankedEffect], values: Estimates, taken: float) -> tuple[FoundEffect, ...]:
    """Return the effects as they are reported: of those that are named what the recordings determine, of others no more than is surely
    explained."""
    found, validation = outcome.found, outcome.prepared.validation
    experiment, method = outcome.prepared.experiment, outcome.method
    channels = [deciding_channel(experiment, found, item, method) if outcome.names else None for item in ranked]
    effects = tuple(reported(item, values, experiment, str(one or "")) for item, one in zip(ranked, channels, strict=True))
    if outcome.names:
        candidates = [item.candidate for item in ranked]
        effects = tuple(without_undetermined(effects, candidates, validation, found, values.values(), method=outcome.method))
    else:
        effects = tuple(no_surer_than(max(0.0, taken), effect) for effect in effects)
    if effects and found.values_instead:
        effects = (replace(effects[0], tied_with=(*effects[0].tied_with, *found.values_instead)), *effects[1:])
    return effects


def _location(outcome: _Outcome, effects: Sequence[FoundEffect], counted: Sequence[Candidate]) -> Location:
    """Return where the difference is; ``counted`` are the effects whose size was read off a count of the recordings."""
    found, judged = outcome.found, outcome.judged
    location = located(outcome.prepared.validation, found, outcome.evidence, named=outcome.names, method=outcome.method)
    if found.controller and not effects:
        location = replace(location, components=(found.controller.name.partition(".")[0],))
    if judged.judged.laws and not outcome.names:
        location = replace(location, components=tuple(law.controller for law in judged.judged.laws))
    if counted:
        hosts = [candidate.at.partition(".")[0] for candidate in (*found.model.candidates, *counted)]
        others = location.components if found.model.candidates else ()
        location = replace(location, components=tuple(dict.fromkeys([*hosts, *others])))
    return location


def _formula(outcome: _Outcome, progress: Progress) -> Discovered | None:
    """Return a formula for what a model that is not adequate leaves, where there is one."""
    if outcome.judged.adequate or outcome.method.ends.is_over:
        return None
    progress("looking for a formula for what is left")
    model, prepared = outcome.found.model, outcome.prepared
    return discover(prepared.experiment, model.fitted, prepared.validation, model.validation_fit, method=outcome.method)


def _entries(outcome: _Outcome, effects: Sequence[FoundEffect], ranked: Sequence[RankedEffect]) -> tuple[dict[str, str], ...]:
    """Return the lines to paste into the lesson, of effects that are named."""
    if not outcome.names:
        return ()
    fitted, experiment = outcome.found.model.fitted, outcome.prepared.experiment
    return tuple(lesson_entry(effect, item.candidate, fitted, experiment) for effect, item in zip(effects, ranked, strict=True))


def _further_effects(prepared: Prepared, found: SearchResult) -> tuple[Possible, ...]:
    """Return what is possible beside the model; a search that was stopped has not asked."""
    if not found.complete or prepared.question.method.ends.is_over:
        return ()
    laboratory = Laboratory(prepared.experiment, prepared.validation, lambda text: None, method=prepared.question.method)
    laboratory.weigh(found.baseline.fitted)
    return further_effects(laboratory, found, prepared.question.method)


def _possible(outcome: _Outcome, further: Sequence[Possible], verdict: Verdict) -> tuple[PossibleEffect, ...]:
    """Return what is told of further effects, where physics is missing: the sizes are those of the fit with each."""
    prepared, told = outcome.prepared, list[PossibleEffect]()
    for one in further if verdict in (*NAMING, "unknown") else ():
        trial = one.trial
        values = estimates(trial.model, prepared.experiment, prepared.validation, prepared.whole)
        ranked = RankedEffect(trial.candidate, one.probability, (), (), trial.share_of_all, trial.share_of_rest)
        names = tuple(candidate.name for candidate in one.replaces)
        told.append(PossibleEffect(reported(ranked, values, prepared.experiment), names))
    return tuple(told)


def _left(outcome: _Outcome, possible: Sequence[PossibleEffect]) -> tuple[str, ...]:
    """Return what is left and what speaks against the values, each in a sentence, in the order in which it is told."""
    found, judged, method = outcome.found, outcome.judged, outcome.method
    experiment, validation = outcome.prepared.experiment, outcome.prepared.validation
    strongest = strongest_variables(outcome.evidence.bars, [], after=True, method=method)
    left_by_model, by_chance = found.model.validation_fit, [name for name in outcome.own.fit if name in judged.judged.by_chance]
    return (
        *(f"{law}." if law.feed_forward else f"{law}: a filter, a feed-forward, another gain." for law in judged.judged.laws),
        *still_missing(outcome.evidence, strongest, found, possible, method),
        *resting(validation, left_by_model, method=method),
        *map(str, judged.bands),
        *(f"{coherence}." for coherence in judged.commanded),
        *(f"{name} is off by no more than its loop swings by chance between two steps of a converter." for name in by_chance),
        *told(turn_lines(validation, left_by_model, method=method), {name: item.unit for name, item in outcome.own.fit.items()}),
        *implausible_values(judged.implausible, outcome.baseline),
        *not_shown(found.baseline.fitted, experiment.machine.uncertain, experiment.sensed.seen_floors, method=method),
        *value_instead(found.far_off, outcome.baseline, found.factor_instead, whole=judged.adequate or outcome.names),
    )


def recording_fault(question: Question, faults: Sequence[Finding], findings: tuple[str, ...], began: float) -> Diagnosis:
    """Return the answer to recordings that are at fault, or too slow for the controllers of the machine."""
    too_slow = faults[0].kind == SLOW_LOG
    return Diagnosis(
        "recording_fault",
        f"{TOO_SLOW if too_slow else VERDICTS['recording_fault']} {faults[0]}",
        question.lesson,
        question.fitted.name,
        question.validation.name if question.validation else question.fitted.name,
        findings=tuple(dict.fromkeys((*findings, *(str(one) for one in faults)))),
        rule="a check of the recordings fails",
        wall_time=time.perf_counter() - began,
    )


def _values_moved(experiment: Experiment, found: SearchResult, given: dict[str, float], method: Method = STANDARD) -> Criterion:
    """Return the criterion that other values of the uncertain parameters explain much that the given ones leave."""
    laboratory = Laboratory(experiment, experiment, lambda text: None, found.baseline.fitted.noise, method=method)
    constant = {name: given[name] for name in experiment.machine.uncertain}
    as_given = fit(experiment.sensed, _not_of_the_lesson(experiment, found), constant, rounds=2, iterations=6, slopes="kept")
    error, refitted = laboratory.error(experiment, as_given), found.baseline.error
    gain = found.baseline.score.motion - judged_score(experiment, as_given).motion
    moved = float(np.max((error - refitted) / error))
    return all_of(held(gain, ">", method.margin, np.sqrt(2.0 * max(gain, 0.0))), held(moved, ">", method.share_of_all))


def _not_of_the_lesson(experiment: Experiment, found: SearchResult) -> list[Free]:
    """Return what is free in the baseline beside the lesson's uncertain values: how a recording starts."""
    return [item for item in with_start(found.baseline.fitted) if item.name not in experiment.machine.uncertain]


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
