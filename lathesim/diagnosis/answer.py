"""The answer of a diagnosis, put together from the search, the estimates and the tests of what is left."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.discovery.generated_plugin import plugin_text
from lathesim.diagnosis.discovery.sparse_regression import Discovered, discover
from lathesim.diagnosis.explaining.chance import is_clear
from lathesim.diagnosis.explaining.density import gain
from lathesim.diagnosis.explaining.plausible import strained
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explanations.conditions import ONE_SPEED, Term, at_one_speed
from lathesim.diagnosis.explanations.of_recording import conditions_of
from lathesim.diagnosis.location import Compared, _showing, compared, resting
from lathesim.diagnosis.method import Method
from lathesim.diagnosis.preparation import PreparedQuestion, Question, as_measured, other_laws
from lathesim.diagnosis.recording_checks.checks import SLOW_LOG
from lathesim.diagnosis.recording_checks.controllers import AnotherLaw
from lathesim.diagnosis.recording_checks.wrong_readings import coarse_counts
from lathesim.diagnosis.records.diagnosis import (
    NAMING,
    TOO_SLOW,
    VERDICTS,
    AnsweredQuestion,
    BaselineValue,
    Diagnosis,
    Evidence,
    FoundEffect,
    Interval,
    LessonLines,
    Location,
    Rest,
    Searched,
    Unnamed,
    Verdict,
)
from lathesim.diagnosis.records.found import Found, Gain, RankedEffect
from lathesim.diagnosis.reporting.effect_report import bounded, declared_in, reported
from lathesim.diagnosis.reporting.evidence import gather, located
from lathesim.diagnosis.reporting.explanations import explanations_of, faults_as_explanations
from lathesim.diagnosis.reporting.lesson_entry import lesson_entry, on_validation, without_undetermined
from lathesim.diagnosis.reporting.number_text import percent
from lathesim.diagnosis.reporting.remarks import at_their_bounds, not_determined, not_shown, value_instead
from lathesim.diagnosis.reporting.summary import without_name
from lathesim.diagnosis.verdict import Doubt, decided, deciding_channel, ranked, recordable, removed_share
from lathesim.engine.assembly import Place
from lathesim.identification.estimation.estimates import CONFIDENCE, Estimates
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution import Progress
from lathesim.identification.records import Candidate, Fitted, with_start
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.measured_motion import measured_output
from lathesim.lessons.sensor_sides import assumed_sides
from lathesim.recordings.raw_table import Finding


@dataclass(frozen=True)
class _Outcome:
    """What the answer is drawn from: the recordings, what was found, what is missing, what was decided."""

    prepared: PreparedQuestion
    found: Found
    evidence: Evidence
    baseline: dict[str, BaselineValue]
    doubts: tuple[Doubt, ...]
    laws: tuple[AnotherLaw, ...]
    names: bool
    """Whether the verdict names effects."""

    @property
    def method(self) -> Method:
        """The numbers that decide."""
        return self.prepared.question.method

    @property
    def adequate(self) -> bool:
        """Whether nothing is left that could be predicted, and no value of the lesson strains beside the effects."""
        return not self.unnamed and not self.laws and not self.strained

    @property
    def strained(self) -> tuple[str, ...]:
        """The values of the lesson that end where it holds no other one possible, though effects are named beside them."""
        return strained(self.found.model.fitted) if self.names and self.found.values is None else ()

    @property
    def unnamed(self) -> tuple[Unnamed, ...]:
        """What is left that could be predicted, what gains most first."""
        clear = sorted((doubt for doubt in self.doubts if doubt.clear), key=lambda doubt: -doubt.gain)
        return tuple(Unnamed(one.at, one.structured, one.unit, tuple(f"{term}{self.or_else(term)}" for term in one.terms)) for one in clear)

    def or_else(self, term: Term) -> str:
        """Return what a wave may be over as well, where the recording that judges does not tell."""
        return at_one_speed(term, conditions_of(self.prepared.validation), self.method) if term.wave else ""


def describe(study: Study, prepared: PreparedQuestion, found: Found, values: Estimates, doubted: tuple[Doubt, ...]) -> Diagnosis:
    """Return the answer: effects ranked, the verdict from these and from what the flexible explanation makes of the rest, all in words."""
    question, (experiment, validation), method = prepared.question, prepared.experiments, study.method
    study.progress("simulating the lesson before and after")
    moved = _over_given(study, found, as_measured(experiment, found).by_name)
    before = found.baseline.validation_fit if found.model.candidates else as_measured(validation, found)
    reported_fit = on_validation(validation, found, values.values())
    own = _own_simulation(validation, found, before, reported_fit)
    evidence = gather(validation, found, own)
    counts = coarse_counts(prepared.experiments, found.model.candidates, method=method)
    effects_found = [*ranked(study, found), *(RankedEffect(candidate, 1.0, (), np.nan) for candidate, _ in counts)]
    # a step in which something is read comes last, however much it gains: it is no physics of the machine
    effects_found.sort(key=lambda one: bool(one.candidate.effect.identification.spacing))
    taken = removed_share(validation, before, reported_fit)
    laws = other_laws(question, found, experiment, validation)
    tied = bool(effects_found and effects_found[0].tied)
    differ = is_clear(moved, method) and moved.share > study.least_share
    values_differ = differ or bool(found.values_off)
    verdict, rule = decided(bool(effects_found), doubted, tied=tied, values_differ=values_differ, another_law=bool(laws))
    outcome = _Outcome(prepared, found, evidence, _baseline(experiment, found, values), doubted, tuple(laws), verdict in NAMING)
    read_off = {f"{candidate.part}.{candidate.effect.identification.spacing}": count for candidate, count in counts}
    effects = _effects(outcome, effects_found, replace(values, by_name={**values.by_name, **read_off}))
    location = _location(outcome, effects, [candidate for candidate, _ in counts])
    formula = _formula(outcome, verdict, study.progress)
    return Diagnosis(
        verdict=verdict,
        sentence=VERDICTS[verdict],
        question=AnsweredQuestion(question.lesson, question.fitted.name, before=question.before.name if question.before else ""),
        effects=effects,
        location=location,
        fit=own.fit,
        baseline=outcome.baseline,
        rest=Rest(
            taken,
            outcome.adequate,
            outcome.unnamed,
            _formula_in_words(formula) if formula else "",
            _left(outcome),
            (*not_determined(effects), *_sides(outcome, effects_found)) if outcome.names else (),
            found.jointly_off or found.values_off,
            easiest=_easiest(experiment),
        ),
        lines=LessonLines(_entries(outcome, effects, effects_found), _sides_found(found), plugin_text(formula) if formula else ""),
        search=Searched(rule, found.history, explanations_of(study, found, moved, doubted, differ=differ)),
        evidence=evidence,
    )


def _easiest(experiment: Experiment) -> str:
    """Return the channel, easiest to log, that shows more than the place or speed that a compared one shows; empty where none does."""
    for name in recordable(experiment):
        part, port = Place.of(measured_output(experiment.machine.assembly, name))
        ports = experiment.machine.assembly.ports(part)
        if port not in (ports.get("displacement"), ports.get("flow")) or not _showing(experiment, part):
            return name
    return ""


def _sides(outcome: _Outcome, ranked: Sequence[RankedEffect]) -> list[str]:
    """Return what is assumed of the sensors at the springs that are named."""
    hosts = dict.fromkeys(Place.of(item.candidate.at).part for item in ranked if item.candidate.effect.beyond)
    found = _sides_found(outcome.found)
    return [told for host in hosts if (told := assumed_sides(outcome.prepared.question.machine.assembly, host, found))]


def _sides_found(found: Found) -> dict[str, str]:
    """Return the sensors that sit at the motor by what was found, though nobody says so."""
    constant, candidates = found.model.fitted.constant, found.model.candidates
    return {sensor: "motor" for one in candidates for sensor, setting in one.seat.unsaid_side.items() if constant.get(setting) == 0.0}


def _own_simulation(validation: Experiment, found: Found, before: Fitted, reported_fit: Fitted) -> Compared:
    """Return how far the lesson's own simulation is off, before and after; before, the controller is as the lesson says.

    The lesson alone has its fitted values, or its given ones where these leave clearly less: a fit of each part with recorded inputs may
    lead away from them.
    """
    as_the_lesson = {found.controller.name: found.controller.given} if found.controller else {}
    given = {item.name: item.given for item in found.baseline.fitted.free if item.name in validation.machine.uncertain}
    alone = [{**before.by_name, **as_the_lesson}, {**before.by_name, **given, **as_the_lesson}]
    return compared(validation, alone, reported_fit.by_name)


def _effects(outcome: _Outcome, ranked: Sequence[RankedEffect], values: Estimates) -> tuple[FoundEffect, ...]:
    """Return the effects as they are reported, with what the recordings determine of them."""
    found, validation = outcome.found, outcome.prepared.validation
    experiment, method = outcome.prepared.experiment, outcome.method
    channels = [deciding_channel(experiment, found, item, method) for item in ranked]
    effects = tuple(reported(item, values, experiment, one) for item, one in zip(ranked, channels, strict=True))
    candidates = [item.candidate for item in ranked]
    return tuple(without_undetermined(effects, candidates, validation, found, values.values(), method=method))


def _location(outcome: _Outcome, effects: Sequence[FoundEffect], counted: Sequence[Candidate]) -> Location:
    """Return where the difference is; ``counted`` are the effects whose size was read off a count of the recordings."""
    found = outcome.found
    goes_with = [name for doubt in outcome.doubts if doubt.clear or not outcome.names for name in doubt.variables]
    location = located(outcome.prepared.validation, found, outcome.evidence, goes_with, named=outcome.names, method=outcome.method)
    if found.controller and not effects:
        location = replace(location, components=(Place.of(found.controller.name).part,))
    if outcome.unnamed and not outcome.names:
        parts = [Place.of(left.at).part for left in outcome.unnamed]
        location = replace(location, components=tuple(dict.fromkeys([*parts, *location.components])))
    if outcome.laws and not outcome.names:
        location = replace(location, components=tuple(law.controller for law in outcome.laws))
    if counted:
        hosts = [Place.of(candidate.at).part for candidate in (*found.model.candidates, *counted)]
        others = location.components if found.model.candidates else ()
        location = replace(location, components=tuple(dict.fromkeys([*hosts, *others])))
    return location


def _formula_in_words(formula: Discovered) -> str:
    size = shown_with_unit(formula.size, formula.unit, 3)
    return f"{formula.formula}, which explains {percent(formula.share)} of the {size} left at {formula.at} at the frequencies of the motion"


def _formula(outcome: _Outcome, verdict: Verdict, progress: Progress) -> Discovered | None:
    """Return a formula for what no effect of the catalogue explains, where there is one."""
    if verdict != "unknown" or outcome.prepared.question.ends.is_over:
        return None
    progress("looking for a formula")
    model, prepared = outcome.found.model, outcome.prepared
    return discover(prepared.experiment, model.fitted, prepared.validation, model.validation_fit, method=outcome.method)


def _entries(outcome: _Outcome, effects: Sequence[FoundEffect], ranked: Sequence[RankedEffect]) -> tuple[dict[str, str], ...]:
    """Return the lines to paste into the lesson, of effects that are named."""
    if not outcome.names:
        return ()
    fitted, experiment = outcome.found.model.fitted, outcome.prepared.experiment
    return tuple(lesson_entry(effect, item.candidate, fitted, experiment) for effect, item in zip(effects, ranked, strict=True))


def _left(outcome: _Outcome) -> tuple[str, ...]:
    """Return what is left and what speaks against the values, each in a sentence, in the order in which it is reported."""
    found = outcome.found
    experiment = outcome.prepared.experiment
    return (
        *(f"{law}." if law.feed_forward else f"{law}: a filter, a feed-forward, another gain." for law in outcome.laws),
        *(f"{one} explains as much of the recording from before the change." for one in _there_before(found)),
        *map(without_name, outcome.unnamed[1:]),
        *at_their_bounds(outcome.strained),
        *([ONE_SPEED] if any(outcome.or_else(term) for doubt in outcome.doubts if doubt.clear for term in doubt.terms) else []),
        *resting(outcome.prepared.validation, found.model.candidates, method=outcome.method),
        *not_shown(found.baseline.fitted, experiment.machine.uncertain, experiment.sensed.seen_floors),
        *value_instead(found.far_off, outcome.baseline, whole=outcome.adequate or outcome.names),
    )


def _there_before(found: Found) -> list[str]:
    """Return the effects of the model that a recording from before a change shows too, with their places."""
    return [f"{one.name} at {one.place}" for one in found.model.candidates if one.part in found.there_before]


def recording_fault(question: Question, faults: Sequence[Finding], findings: tuple[str, ...], began: float) -> Diagnosis:
    """Return the answer to recordings that are at fault, or too slow for the controllers of the machine."""
    too_slow = faults[0].kind == SLOW_LOG
    return Diagnosis(
        "recording_fault",
        f"{TOO_SLOW if too_slow else VERDICTS['recording_fault']} {faults[0]}",
        AnsweredQuestion(
            question.lesson,
            question.fitted.name,
            question.validation.name if question.validation else question.fitted.name,
            findings=tuple(dict.fromkeys((*findings, *(str(one) for one in faults)))),
        ),
        search=Searched(
            "a check of the recordings fails", explanations=faults_as_explanations(faults), wall_time=time.perf_counter() - began
        ),
    )


def _over_given(study: Study, found: Found, given: dict[str, float]) -> Gain:
    """Return what other values of the uncertain parameters gain over the given ones, on the recording that is fitted."""
    experiment = study.estimation
    constant = {name: given[name] for name in experiment.machine.uncertain}
    starts = [item for item in with_start(found.baseline.fitted) if item.name not in experiment.machine.uncertain]
    return gain(found.baseline.fitted, fit(experiment.sensed, starts, constant, rounds=2, iterations=6, slopes="kept"), full_band=False)


def _baseline(experiment: Experiment, found: Found, values: Estimates) -> dict[str, BaselineValue]:
    result = {}
    for item in found.baseline.fitted.free:
        if item.name not in experiment.machine.uncertain:
            continue
        estimate = values.by_name[item.name]
        half = CONFIDENCE * estimate.error
        declared = declared_in(experiment, item.name)
        interval = bounded(Interval(estimate.value, declared.unit, estimate.value - half, estimate.value + half), declared)
        without = found.baseline.fitted.by_name[item.name]
        result[item.name] = BaselineValue(declared.unit, item.given, without, estimate.value, interval.low, interval.high, interval.ends)
    if other := found.controller:
        half = CONFIDENCE * other.error
        result[other.name] = BaselineValue(other.unit, other.given, other.value, other.value, other.value - half, other.value + half)
    return result
