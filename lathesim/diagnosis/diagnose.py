"""``diagnose``: from a machine and its recordings to what physics the simulation left out.

    recording checked -> baseline refitted within its uncertainties -> mismatch located -> candidates screened, fitted and judged on the
    held-out recording -> values and intervals -> is the model adequate? -> verdict

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
from lathesim.diagnosis.question import Question
from lathesim.diagnosis.recording_checks.change_points import changed_midway, jumped_midway
from lathesim.diagnosis.recording_checks.clipping import clipped_reading
from lathesim.diagnosis.recording_checks.command_consistency import contradicted
from lathesim.diagnosis.recording_checks.controller_law import AnotherLaw, another_law
from lathesim.diagnosis.recording_checks.controller_value import controller_value, with_commands_followed
from lathesim.diagnosis.recording_checks.different_machine import another_machine
from lathesim.diagnosis.recording_checks.exchanged_channels import exchanged_with, swapped
from lathesim.diagnosis.recording_checks.mistaken_unit import in_another_unit, wrong_unit
from lathesim.diagnosis.recording_checks.quantisation import coarse_counts
from lathesim.diagnosis.recording_checks.sample_clock import of_another_period
from lathesim.diagnosis.recording_checks.sensor_zero import zeros_told
from lathesim.diagnosis.records.diagnosis import VERDICTS, BaselineValue, Diagnosis, FoundEffect, Interval, Verdict, listed, no_surer_than
from lathesim.diagnosis.records.search import Found
from lathesim.diagnosis.reporting.effect_report import bounded, declared_in, reported
from lathesim.diagnosis.reporting.evidence import gather, located, strongest_variables
from lathesim.diagnosis.reporting.lesson_entry import lesson_entry, on_held_out, without_undetermined
from lathesim.diagnosis.reporting.remarks import not_determined, not_shown, still_missing, strained_values, unseen_forms, value_instead
from lathesim.diagnosis.selection.acceptance import is_of_a_clock
from lathesim.diagnosis.selection.forward import leave_out
from lathesim.diagnosis.selection.laboratory import Bench, is_strained, judged_score
from lathesim.diagnosis.selection.refusal import all_push, is_much_of_it
from lathesim.diagnosis.selection.search import search
from lathesim.diagnosis.verdict.adequacy import Adequacy, adequacy
from lathesim.diagnosis.verdict.ranking import NAMED_SHARE, Standing, removed_share, standing, takes_nothing
from lathesim.diagnosis.verdict.residual_tests import hardly_missed, not_adequate, spoils_something
from lathesim.effects.effect import Effect
from lathesim.identification.estimation.estimates import (
    CONFIDENCE,
    Estimate,
    Estimates,
    estimates,
    hangs_together,
    is_open,
    is_significant,
    with_error_of_form,
)
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.machine.roles import closes_a_loop
from lathesim.identification.records.candidate import Term
from lathesim.identification.records.fit import Fitted, with_start
from lathesim.identification.replay.experiment import Machine, Rig, baseline_free, build_rigs
from lathesim.identification.replay.loading import Recorded
from lathesim.identification.replay.validation_split import parted

Tell = Callable[[str], None]
_NEARLY_OPEN = 0.05
"""Share of its size down to which the interval of an effect may come for the size not to be called determined."""
MOVED = 0.05
"""Share of the error that a refit of the baseline must remove for its values to be called off."""


def diagnose(question: Question, tell: Tell | None = None) -> Diagnosis:
    """Answer a question. Stopped with Ctrl-C, the answer holds what was known until then (``complete`` is false)."""
    began = time.perf_counter()
    say = tell or (lambda text: None)
    faults = [str(fault) for fault in (*question.fitted.faults, *(question.held_out.faults if question.held_out else ()))]
    # what both recordings have in common is said once
    findings = tuple(
        dict.fromkeys(str(finding) for recorded in (question.fitted, question.held_out) if recorded for finding in recorded.findings)
    )
    if not faults:
        (rig, held_out), whole, held_name = _rigs(question)
        findings = tuple(dict.fromkeys((*findings, *zeros_told(rig), *zeros_told(held_out))))
        faults = [sentence for one in (rig, held_out) if (sentence := exchanged_with(one, _as_given(one)))]
    if not faults:
        given = with_commands_followed(rig, _as_given(rig))
        # before any value of a controller is doubted: all of them would make up for a clock
        faults = [sentence for one in (rig, held_out) if (sentence := of_another_period(one, given))]
    if not faults:
        if other := controller_value(rig, held_out, given):
            findings = (*findings, str(other))
            question = replace(question, machine=other.in_machine(question.machine))
            (rig, held_out), whole, held_name = _rigs(question)
            given = with_commands_followed(rig, _as_given(rig))
        # a feed-forward may be more than all that the lesson's controller does
        laws = {law.channel: law.feed_forward for law in another_law(rig, held_out, given)}
        checks = [(contradicted(one, given, laws), swapped(one, given), in_another_unit(one, given)) for one in (rig, held_out)]
        faults = [sentence for pair in checks for sentence in pair if sentence]
    if faults:
        return _recording_fault(question, faults, findings, began)
    found = search(rig, held_out, question.settings, say)
    found.controller = other
    if question.held_out is not None and (stranger := another_machine(found.model, rig, held_out)):
        return _recording_fault(question, [stranger], findings, began)
    judged = ((rig, found.baseline.fitted), (held_out, found.baseline.held_out_fit))
    for fault in (changed_midway, clipped_reading, *([] if found.model.terms else [jumped_midway])):
        if told_of := next((sentence for one, fitted in judged if (sentence := fault(one, fitted))), ""):
            return _recording_fault(question, [told_of], findings, began)
    say("fitting the found model to everything")
    values = estimates(found.model, rig, held_out, whole)
    doubtful = _doubtful(found, rig, held_out, values)
    if doubtful:
        say(f"leaving out again {', '.join(term.name for term in doubtful)}: its size may be nothing")
        leave_out(found, doubtful, rig, held_out, say)
        values = estimates(found.model, rig, held_out, whole)
    if found.model.terms and takes_nothing(held_out, found.baseline.held_out_fit, on_held_out(held_out, found, values.values())):
        say(f"leaving out again {', '.join(term.name for term in found.model.terms)}: nothing is taken away of the recording that judges")
        leave_out(found, found.model.terms, rig, held_out, say)
        values = estimates(found.model, rig, held_out, whole)
    credible = [] if found.far_off or is_strained(found.model.fitted) else found.model.terms
    # beside a value of the lesson that is further off than possible a factor on a reading makes up for that
    if mistaken := wrong_unit([term for term in credible if found.removed_by(term) > NAMED_SHARE], values.values()):
        return _recording_fault(question, [mistaken], findings, began)
    counts = coarse_counts((rig, held_out), found.model.terms)
    answer = _answer(question, found, rig, held_out, values, counts, say)
    if found.complete and not answer.adequate:
        answer = _without_doubtful(question, found, answer, (rig, held_out, whole), values, say) or answer
    if slow := _of_a_slow_log(question, answer):
        return _recording_fault(question, [slow], findings, began)
    return replace(
        answer,
        held_out=held_name,
        findings=findings,
        wall_time=time.perf_counter() - began,
        complete=found.complete,
    )


def _doubtful(found: Found, rig: Rig, held_out: Rig, values: Estimates) -> list[Term]:
    """Give the effects whose size may be nothing: those whose sizes the recordings do not agree on, lags of a small part of a sample, and
    such whose intervals hold nothing.
    All go that act at moving parts and take away next to nothing of what acts there.
    Of these a single one goes where nothing that matters was missing, and small ones beside others where no force that matters was missing
    at their place or the lesson's own simulation is further off with the whole model in some channel."""
    trifling = found.model.terms and all_push(rig, found.model.terms) and not any(is_much_of_it(term, found) for term in found.model.terms)
    if trifling and next_to_nothing(missing_signals(held_out, found.baseline, found.model)):
        return list(found.model.terms)
    period, model = rig.machine.assembly.sample_period, found.model.fitted.by_name
    in_time = [term for term in found.model.terms if is_of_a_clock(term, model, period, len(rig.record) * period)]
    doubtful = [term for term in found.model.terms if term not in in_time or not is_significant(term, values)]
    unsure = [term for term in found.model.terms if term not in doubtful and is_open(term, values) and not hangs_together(term, values)]
    single = len(found.model.terms) == 1
    unsure = [term for term in unsure if single or found.removed_by(term) < NAMED_SHARE]
    if not unsure:
        return doubtful
    own = _own(held_out, found, values)
    if not single and spoils_something(own.fit):
        return doubtful + unsure
    evidence = gather(rig, held_out, found, own)
    channels = held_out.machine.compare
    return doubtful + [term for term in unsure if hardly_missed(evidence, channels, "" if single else term.at)]


def _without_doubtful(
    question: Question, found: Found, answer: Diagnosis, rigs: tuple[Rig, Rig, Rig | None], values: Estimates, say: Tell
) -> Diagnosis | None:
    """Give the answer without effects whose size may be nothing, or without any where all take nothing away of the recording that judges,
    if nothing speaks against that; else none."""
    rig, held_out, whole = rigs
    useless = bool(found.model.terms) and answer.removed_share <= 0.0 and question.settings.against_chance
    doubtful = [term for term in found.model.terms if useless or (is_open(term, values) and not hangs_together(term, values))]
    if not doubtful or (len(doubtful) == len(found.model.terms) and not useless):
        return None
    why = "which take nothing away" if useless else "whose size may be nothing"
    say(f"asking whether {', '.join(term.name for term in doubtful)} can go, {why}")
    leaner = replace(found)
    leave_out(leaner, doubtful, rig, held_out, say)
    counts = coarse_counts((rig, held_out), leaner.model.terms)
    other = _answer(question, leaner, rig, held_out, estimates(leaner.model, rig, held_out, whole), counts, say)
    return other if other.adequate and (useless or other.verdict in ("named", "tied")) else None


def _own(held_out: Rig, found: Found, values: Estimates) -> Compared:
    return compared(held_out, found.baseline.held_out_fit.by_name, on_held_out(held_out, found, values.values()).by_name)


def _recording_fault(question: Question, faults: list[str], findings: tuple[str, ...], began: float) -> Diagnosis:
    return Diagnosis(
        "recording_fault",
        f"{VERDICTS['recording_fault']} {faults[0]}",
        question.lesson,
        question.fitted.name,
        question.held_out.name if question.held_out else question.fitted.name,
        findings=tuple(dict.fromkeys((*findings, *faults))),
        wall_time=time.perf_counter() - began,
    )


def _rigs(question: Question) -> tuple[list[Rig], Rig | None, str]:
    """Give the rigs of the fitted and of the held-out recording, and of the whole where both are parts of one file."""
    fitted = question.fitted
    if question.held_out is not None:
        pairs = [(fitted.name, fitted.record), (question.held_out.name, question.held_out.record)]
        return without_one_sided(build_rigs(question.machine, pairs, question.effects)), None, question.held_out.name
    rig, held_out, whole = without_one_sided(parted(question.machine, fitted.name, fitted.record, question.effects))
    return [rig, held_out], whole, held_out.name


def _answer(
    question: Question, found: Found, rig: Rig, held_out: Rig, values: Estimates, counts: Sequence[tuple[Term, Estimate]], say: Tell
) -> Diagnosis:
    say("simulating the lesson before and after")
    moved = _values_are_off(rig, found, _given(rig, found).by_name)
    before = found.baseline.held_out_fit if found.model.terms else _given(held_out, found)
    reported_fit = on_held_out(held_out, found, values.values())
    as_the_lesson = {found.controller.name: found.controller.given} if found.controller else {}
    own = compared(held_out, {**before.by_name, **as_the_lesson}, reported_fit.by_name)
    evidence = gather(rig, held_out, found, own)
    standings = [*standing(found, question.settings, rig.one_sided), *[Standing(term, 1.0, (), (), np.nan, np.nan) for term, _ in counts]]
    read = {f"{term.part}.{term.effect.spacing}": count for term, count in counts}
    after = strongest_variables(evidence.bars, [], after=True)
    baseline = _baseline(rig, found, values)
    taken = removed_share(held_out, before, reported_fit)
    unsized = [term for term in found.model.terms if is_open(term, values, _NEARLY_OPEN)]
    judged = adequacy(rig, held_out, found, evidence, own, baseline, taken, _other_laws(question, found, rig, held_out), unsized)
    sure = with_error_of_form(values, found.model.terms, judged.form_left) if judged.form_left else values
    verdict = _verdict(found, standings, moved, judged, sure)
    names = verdict in ("named", "tied")
    told_of = replace(sure, by_name={**sure.by_name, **read})
    terms = [item.term for item in standings]
    effects = tuple(reported(item, told_of, rig) for item in standings)
    if names:
        effects = tuple(without_undetermined(effects, terms, held_out, found, told_of.values()))
    else:
        effects = tuple(no_surer_than(max(0.0, taken), effect) for effect in effects)
    if effects and found.values_instead:
        effects = (replace(effects[0], tied_with=(*effects[0].tied_with, *found.values_instead)), *effects[1:])
    location = located(held_out, found, evidence, named=names)
    if found.controller and not effects:
        location = replace(location, components=(found.controller.name.partition(".")[0],))
    if judged.laws and not names:
        location = replace(location, components=tuple(law.controller for law in judged.laws))
    if counts:
        hosts = [term.at.partition(".")[0] for term in (*found.model.terms, *[term for term, _ in counts])]
        others = location.components if found.model.terms else ()
        location = replace(location, components=tuple(dict.fromkeys([*hosts, *others])))
    term = None
    if not judged.adequate:
        say("looking for a formula for what is left")
        term = discover(rig, found.model.fitted, held_out, found.model.held_out_fit)
    return Diagnosis(
        verdict=verdict,
        sentence=_sentence(verdict, effects, found.values_off),
        lesson=question.lesson,
        recording=question.fitted.name,
        held_out="",
        effects=effects,
        location=location,
        fit=own.fit,
        removed_share=taken,
        adequate=judged.adequate,
        shortfall=not_adequate((*judged.reasons, *judged.weak)) if names else "",
        baseline=baseline,
        insert=tuple(lesson_entry(*pair, found.model.fitted, rig) for pair in zip(effects, terms, strict=True)) if names else (),
        left=(
            *(f"{law}." if law.feed_forward else f"{law}: a filter, a feed-forward, another gain." for law in judged.laws),
            *still_missing(evidence, after, found, question.settings),
            *resting(held_out, found.model.held_out_fit),
            *map(str, judged.bands),
            *(f"{told}." for told in judged.commanded),
            *(f"{name} is off by no more than its loop swings by chance between two steps of a converter." for name in judged.by_chance),
            *told(turn_lines(held_out, found.model.held_out_fit), {name: item.unit for name, item in own.fit.items()}),
            *strained_values(judged.strained, baseline),
            *not_shown(found.baseline.fitted, rig.machine.uncertain, rig.sensed.seen_floors),
            *value_instead(found.far_off, baseline, found.factor_instead, whole=judged.adequate or names),
        ),
        not_told=(*not_determined(effects), *unseen_forms(standings)) if names else (),
        discovered=f"{term.formula}, which explains {term.share:.0%} of what is left at {term.at}" if term else "",
        plugin=plugin_text(term) if term else "",
        evidence=evidence,
    )


def _other_laws(question: Question, found: Found, rig: Rig, held_out: Rig) -> list[AnotherLaw]:
    """Give the controllers that have another law; a slower log, or a reading that is late, makes another one of the lesson's own."""
    slow_log = any(finding.kind in ("coarse", "interpolated") for finding in question.fitted.findings)
    if slow_log or any(term.effect.late_by for term in found.model.terms):
        return []
    return another_law(rig, held_out, with_commands_followed(rig, _as_given(rig)))


def _of_a_slow_log(question: Question, answer: Diagnosis) -> str:
    """Give a sentence where what nothing explains sits in a controller that decided more often than was recorded; empty where it does
    not."""
    slow = next((finding for finding in question.fitted.findings if finding.kind == "coarse"), None)
    suspect = next(iter(answer.location.components), "")
    part = next((part for part in question.machine.assembly.parts if part.name == suspect), None)
    if answer.verdict != "unknown" or slow is None or part is None or not closes_a_loop(part):
        return ""
    fact = f"{slow.fact[:1].upper()}{slow.fact[1:]}"
    return f"{fact}: what nothing explains of {suspect} may be what happened between two samples. Record each decision, or every k-th."


def _given(rig: Rig, found: Found) -> Fitted:
    """Give the values as the lesson has them, with the start of the recording fitted."""
    constant = {item.name: item.given for item in found.baseline.fitted.free if item.name in rig.machine.uncertain}
    starts = rig.start_states(rig.sensed.plan)
    return fit(rig.sensed, starts, constant, rounds=2, iterations=6, slopes="kept")


def _as_given(rig: Rig) -> dict[str, float]:
    """Give the uncertain values as the lesson has them."""
    return {item.name: item.given for item in baseline_free(rig.machine)}


def _values_are_off(rig: Rig, found: Found, given: dict[str, float]) -> bool:
    """Say whether other values of the uncertain parameters explain much that the given ones leave."""
    bench = Bench(rig, rig, lambda text: None, found.baseline.fitted.noise)
    names = [item for item in with_start(found.baseline.fitted) if item.name not in rig.machine.uncertain]
    constant = {name: given[name] for name in rig.machine.uncertain}
    as_given = fit(rig.sensed, names, constant, rounds=2, iterations=6, slopes="kept")
    error, refitted = bench.error(rig, as_given), found.baseline.error
    gain = found.baseline.score.motion - judged_score(rig, as_given).motion
    return bool(gain > 10.0 and np.max((error - refitted) / error) > MOVED)


def _verdict(found: Found, standings: list[Standing], moved: bool, judged: Adequacy, sure: Estimates) -> Verdict:
    """Say what comes of it. A model that leaves something is a name as far as it takes most of the error away, and no error of its form
    makes its first effect nothing."""
    if not standings:
        if judged.reasons:
            return "unknown"
        return "parameters_only" if moved or found.values_off else "no_mismatch"
    first = standings[0].term
    if judged.reasons and (judged.removed < NAMED_SHARE or (first in found.model.terms and is_open(first, sure))):
        return "unknown"
    return "tied" if standings[0].tied or found.values_instead else "named"


def _sentence(verdict: Verdict, effects: tuple[FoundEffect, ...], far_off: tuple[str, ...]) -> str:
    if verdict == "parameters_only" and far_off:
        others = f" (or {' or '.join(far_off[1:])})" if len(far_off) > 1 else ""
        return f"No physics is missing, but {far_off[0]}{others} is further off than the lesson holds possible."
    if verdict not in ("named", "tied") or not effects:
        return VERDICTS[verdict]
    names = [f"{effect.effect} at {effect.at}" + (f" (or {', '.join(effect.tied_with)})" if effect.tied_with else "") for effect in effects]
    return f"The simulation left out {listed(names)}."


def _baseline(rig: Rig, found: Found, values: Estimates) -> dict[str, BaselineValue]:
    result = {}
    for item in found.baseline.fitted.free:
        if item.name not in rig.machine.uncertain:
            continue
        estimate = values.by_name[item.name]
        half = CONFIDENCE * estimate.error
        declared = declared_in(rig, item.name)
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
