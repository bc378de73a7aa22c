"""``diagnose``: from a machine and its recordings to what physics the simulation left out.

    recording checked -> baseline refitted within its uncertainties -> mismatch located -> candidates screened, fitted and judged on the
    held-out recording -> values and intervals -> is the model adequate? -> verdict

Every step is a function in a file of its own; here they are put in order.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lathesim.diagnosis.coarse_counts import coarse_counts
from lathesim.diagnosis.contradiction import contradicted, wrong_unit
from lathesim.diagnosis.diagnosis import VERDICTS, BaselineValue, Diagnosis, FoundEffect, Interval, Verdict
from lathesim.diagnosis.discovery import discover, plugin_text
from lathesim.diagnosis.evidence import compared, gather, located, strongest_variables
from lathesim.diagnosis.fit import Fitted, fit, with_start
from lathesim.diagnosis.half_turn import phases_to_turn
from lathesim.diagnosis.held_out import parted
from lathesim.diagnosis.loading import Recorded
from lathesim.diagnosis.narrow_band import narrow_bands
from lathesim.diagnosis.parameters import CONFIDENCE, Estimate, Estimates, estimates, is_significant
from lathesim.diagnosis.problem import Machine, Rig, baseline_free, build_rigs
from lathesim.diagnosis.same_machine import another_machine
from lathesim.diagnosis.search import Found, Settings, leave_out, search
from lathesim.diagnosis.terms import Term
from lathesim.diagnosis.trial import STRAINED, Bench, is_wide, judged_score
from lathesim.diagnosis.turn_lines import told, turn_lines
from lathesim.diagnosis.variables import resting
from lathesim.diagnosis.verdict import ADEQUATE, NAMED_SHARE, Standing, removed_in_band, removed_share, standing, structured_share
from lathesim.effects.effect import Effect

Tell = Callable[[str], None]
MOVED = 0.05
"""Share of the error that a refit of the baseline must remove for its values to be called off."""


@dataclass(frozen=True)
class Question:
    """What a diagnosis is asked: a machine, the recording it is fitted to, the one it is judged on, and the effects to be tried."""

    lesson: str
    machine: Machine
    fitted: Recorded
    held_out: Recorded | None
    effects: tuple[type[Effect], ...]
    settings: Settings = field(default_factory=Settings)


def diagnose(question: Question, tell: Tell | None = None) -> Diagnosis:
    """Answer a question. Stopped with Ctrl-C, the answer holds what was known until then (``complete`` is false)."""
    began = time.perf_counter()
    say = tell or (lambda text: None)
    faults = [str(fault) for fault in (*question.fitted.faults, *(question.held_out.faults if question.held_out else ()))]
    findings = tuple(str(finding) for recorded in (question.fitted, question.held_out) if recorded for finding in recorded.findings)
    if not faults:
        (rig, held_out), whole, held_name = _rigs(question)
        faults = [sentence for one in (rig, held_out) if (sentence := contradicted(one, _as_given(one)))]
    if faults:
        return _recording_fault(question, faults, findings, began)
    found = search(rig, held_out, question.settings, say)
    if question.held_out is not None and (stranger := another_machine(found.model, rig, held_out)):
        return _recording_fault(question, [stranger], findings, began)
    say("fitting the found model to everything")
    values = estimates(found.model, rig, held_out, whole)
    doubtful = [term for term in found.model.terms if not is_significant(term, values)]
    if doubtful:
        say(f"leaving out again {', '.join(term.name for term in doubtful)}: the recordings do not agree on its size")
        leave_out(found, doubtful, rig, held_out, say)
        values = estimates(found.model, rig, held_out, whole)
    if mistaken := wrong_unit(found.model.terms, values.values()):
        return _recording_fault(question, [mistaken], findings, began)
    counts = coarse_counts((rig, held_out), found.model.terms)
    return replace(
        _answer(question, found, rig, held_out, values, counts, say),
        held_out=held_name,
        findings=findings,
        wall_time=time.perf_counter() - began,
        complete=found.complete,
    )


def _recording_fault(question: Question, faults: list[str], findings: tuple[str, ...], began: float) -> Diagnosis:
    return Diagnosis(
        "recording_fault",
        f"{VERDICTS['recording_fault']} {faults[0]}",
        question.lesson,
        question.fitted.name,
        question.held_out.name if question.held_out else question.fitted.name,
        findings=(*findings, *[fault for fault in faults if fault not in findings]),
        wall_time=time.perf_counter() - began,
    )


def _rigs(question: Question) -> tuple[list[Rig], Rig | None, str]:
    """Give the rigs of the fitted and of the held-out recording, and of the whole where both are parts of one file."""
    fitted = question.fitted
    if question.held_out is not None:
        pairs = [(fitted.name, fitted.record), (question.held_out.name, question.held_out.record)]
        return build_rigs(question.machine, pairs, question.effects), None, question.held_out.name
    rig, held_out, whole = parted(question.machine, fitted.name, fitted.record, question.effects)
    return [rig, held_out], whole, held_out.name


def _answer(
    question: Question, found: Found, rig: Rig, held_out: Rig, values: Estimates, counts: Sequence[tuple[Term, Estimate]], say: Tell
) -> Diagnosis:
    say("simulating the lesson before and after")
    moved = _values_are_off(rig, found, _given(rig, found).by_name)
    before, reported = found.baseline.held_out_fit if found.model.terms else _given(held_out, found), _on_held_out(held_out, found, values)
    own = compared(held_out, before.by_name, reported.by_name)
    evidence = gather(rig, held_out, found, own)
    location = located(held_out, found, evidence)
    if counts:
        hosts = [term.at.partition(".")[0] for term in (*found.model.terms, *[term for term, _ in counts])]
        others = location.components if found.model.terms else ()
        location = replace(location, components=tuple(dict.fromkeys([*hosts, *others])))
    standings = [*standing(found, question.settings), *[Standing(term, 1.0, (), (), np.nan, np.nan) for term, _ in counts]]
    read = {f"{term.part}.{term.effect.spacing}": count for term, count in counts}
    after = strongest_variables(evidence.bars, [], after=True)
    told_removed = removed_share(held_out, before, reported)
    removed = min(removed_in_band(found), 1.0 if told_removed > 0.0 else 0.0)
    baseline = _baseline(rig, found, values)
    strained = tuple(
        name
        for name, item in baseline.items()
        if name not in found.far_off[:1] and abs(item.refit_with - item.given) > STRAINED * rig.machine.uncertain[name]
    )
    bands = narrow_bands(held_out, found.model.held_out_fit) or narrow_bands(rig, found.model.fitted)
    adequate = structured_share(evidence, rig.machine.compare) < ADEQUATE and not strained and not bands
    adequate = adequate and (told_removed > 0.0 or not standings)
    verdict = _verdict(found, standings, moved, adequate, removed)
    told_of = replace(values, by_name={**values.by_name, **read})
    effects = tuple(_effect(item, told_of, rig, adequate) for item in standings)
    if effects and found.values_instead:
        effects = (replace(effects[0], tied_with=(*effects[0].tied_with, *found.values_instead)), *effects[1:])
    term = None
    if not adequate:
        say("looking for a formula for what is left")
        term = discover(rig, found.model.fitted, held_out, found.model.held_out_fit)
    return Diagnosis(
        verdict=verdict,
        sentence=_sentence(verdict, effects, found.far_off),
        lesson=question.lesson,
        recording=question.fitted.name,
        held_out="",
        effects=effects,
        location=location,
        fit=own.fit,
        removed_share=told_removed,
        adequate=adequate,
        baseline=baseline,
        insert=tuple(_insert(*pair, found) for pair in zip(effects, standings, strict=True)) if verdict in ("named", "tied") else (),
        left=(
            *_left(evidence, after, found, question.settings),
            *resting(held_out, found.model.held_out_fit),
            *map(str, bands),
            *told(turn_lines(held_out, found.model.held_out_fit), {name: item.unit for name, item in own.fit.items()}),
            *_strain(strained, baseline),
            *_far_off(found.far_off, baseline),
        ),
        not_told=(*_not_told(effects, told_of), *_unseen(standings)),
        discovered=f"{term.formula}, which explains {term.share:.0%} of what is left at {term.at}" if term else "",
        plugin=plugin_text(term) if term else "",
        evidence=evidence,
    )


def _given(rig: Rig, found: Found) -> Fitted:
    """Give the values as the lesson has them, with the start of the recording fitted."""
    constant = {item.name: item.given for item in found.baseline.fitted.free if item.name in rig.machine.uncertain}
    starts = rig.start_states(rig.sensed.plan)
    return fit(rig.sensed, starts, constant, rounds=2, iterations=6, fresh=False)


def _as_given(rig: Rig) -> dict[str, float]:
    """Give the uncertain values as the lesson has them."""
    return {item.name: item.given for item in baseline_free(rig.machine)}


def _values_are_off(rig: Rig, found: Found, given: dict[str, float]) -> bool:
    """Say whether other values of the uncertain parameters explain much that the given ones leave."""
    bench = Bench(rig, rig, lambda text: None, found.baseline.fitted.noise)
    names = [item for item in with_start(found.baseline.fitted) if item.name not in rig.machine.uncertain]
    constant = {name: given[name] for name in rig.machine.uncertain}
    as_given = fit(rig.sensed, names, constant, rounds=2, iterations=6, fresh=False)
    error, refitted = bench.error(rig, as_given), found.baseline.error
    gain = found.baseline.score.motion - judged_score(rig, as_given).motion
    return bool(gain > 10.0 and np.max((error - refitted) / error) > MOVED)


def _verdict(found: Found, standings: list[Standing], moved: bool, adequate: bool, removed: float) -> Verdict:
    if not standings:
        if not adequate:
            return "unknown"
        return "parameters_only" if moved else "no_mismatch"
    if not adequate and removed < NAMED_SHARE:
        return "unknown"
    return "tied" if standings[0].tied or found.values_instead else "named"


def _sentence(verdict: Verdict, effects: tuple[FoundEffect, ...], far_off: tuple[str, ...]) -> str:
    if verdict == "parameters_only" and far_off:
        others = f" (or {' or '.join(far_off[1:])})" if len(far_off) > 1 else ""
        return f"No physics is missing, but {far_off[0]}{others} is further off than the lesson holds possible."
    if verdict not in ("named", "tied") or not effects:
        return VERDICTS[verdict]
    names = [f"{effect.effect} at {effect.at}" + (f" (or {', '.join(effect.tied_with)})" if effect.tied_with else "") for effect in effects]
    listed = names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
    return f"The simulation left out {listed}."


def _effect(item: Standing, values: Estimates, rig: Rig, adequate: bool) -> FoundEffect:
    term = item.term
    parameters, undetermined = {}, []
    for name, scale in zip(term.parameters, np.abs(term.points).max(axis=0, initial=0.0), strict=True):
        short = name.partition(".")[2]
        if name not in values.by_name:
            continue
        estimate = values.by_name[name]
        half = CONFIDENCE * estimate.error
        value = estimate.value
        if short == "order":
            # a whole number; what it seems to be off is the speed
            half, value = max(half, abs(value - round(value))), float(round(value))
        parameters[short] = Interval(value, rig.sensed.plan.unit(name), value - half, value + half)
        if estimate.error <= 0.0 or estimate.error > 0.5 * max(float(scale), abs(estimate.value)):
            undetermined.append(short)
    others = (*item.tied, *item.forms)
    tied = tuple(dict.fromkeys(other.name if other.name != term.name else f"{other.name} at {other.at}" for other in others))
    unseen = next((other.effect.experiment for other in item.unseen), None)
    experiment = term.effect.experiment if tied or undetermined else unseen
    return FoundEffect(
        term.name,
        term.at,
        term.family,
        item.probability,
        _turned(term, parameters),
        tied,
        experiment,
        item.share,
        item.removes,
        _first_line(term),
        tuple(undetermined),
    )


def _first_line(term: Term) -> str:
    return (term.effect.__doc__ or "").strip().splitlines()[0]


def _on_held_out(held_out: Rig, found: Found, values: Estimates) -> Fitted:
    """Give the reported values with what belongs to the held-out recording fitted beside them."""
    judged = found.model.held_out_fit
    own = {item.name for item in held_out.start_states(held_out.sensed.plan)}
    own |= {name for term in found.model.terms for name in term.nuisance}
    free = [item for item in with_start(judged) if item.name in own]
    constant = {name: value for name, value in {**judged.by_name, **values.values()}.items() if name not in own}
    return fit(held_out.sensed, free, constant, rounds=2, iterations=6, wide=is_wide(found.model.terms), fresh=False)


def _turned(term: Term, parameters: dict[str, Interval]) -> dict[str, Interval]:
    """Give each wave with a negative size as the same wave of positive size, half a turn on."""
    values = {f"{term.part}.{name}": item.value for name, item in parameters.items()}
    turned = dict(parameters)
    sizes = [size for phase in phases_to_turn(term, values) for size in term.waves[phase] if size in values]
    for name in (size.partition(".")[2] for size in sizes):
        item = parameters[name]
        turned[name] = Interval(-item.value, item.unit, -item.high, -item.low)
    return turned


def _insert(effect: FoundEffect, item: Standing, found: Found) -> dict[str, str]:
    """Give the entry for the lesson; what belongs to a recording is that of the fitted one."""
    term = item.term
    quantities = {name: _quantity(value) for name, value in effect.parameters.items()}
    fitted = found.model.fitted.by_name
    for name in term.nuisance:
        short = name.partition(".")[2]
        if name in fitted:
            half_turn = np.pi if name in phases_to_turn(term, fitted) else 0.0
            quantities[short] = f"{fitted[name] + half_turn:.6g} {term.effect.declarations[short].unit}".removesuffix(" 1")
    return {"effect": effect.effect, "at": effect.at, **quantities}


def _quantity(item: Interval) -> str:
    number = f"{item.value:.6g}"
    return number if item.unit == "1" else f"{number} {item.unit}"


def _baseline(rig: Rig, found: Found, values: Estimates) -> dict[str, BaselineValue]:
    result = {}
    for item in found.baseline.fitted.free:
        if item.name not in rig.machine.uncertain:
            continue
        estimate = values.by_name[item.name]
        half = CONFIDENCE * estimate.error
        unit = rig.sensed.plan.unit(item.name)
        without = found.baseline.fitted.by_name[item.name]
        result[item.name] = BaselineValue(unit, item.given, without, estimate.value, estimate.value - half, estimate.value + half)
    return result


def _left(evidence: object, variables: tuple[str, ...], found: Found, settings: Settings) -> tuple[str, ...]:
    """Say what is still missing, where, and what it depends on."""
    sentences = []
    for item in evidence.missing:  # type: ignore[attr-defined]
        size = float(np.sqrt(np.mean(item.after**2)))
        shares = f"{item.share_after:.1%} of what acts there, {item.share_before:.1%} before"
        sentences.append(f"{size:.3g} {item.unit} is still missing at {item.at} ({shares}).")
    if variables:
        sentences.append(f"What is left depends on {', '.join(variables[:3])}.")
    for trial in found.tried:
        small = trial.gain > settings.margin and trial.held_out_gain > settings.margin and trial.term not in found.model.terms
        if small and trial.share_of_rest > settings.share_of_rest and found.complete and trial.share_of_all <= settings.share_of_all:
            shares = f"{trial.share_of_rest:.0%} of the rest, which is {trial.share_of_all:.1%} of all"
            sentences.append(f"{trial.term.name} at {trial.term.at} would take away {shares}: too little to name it.")
    return tuple(dict.fromkeys(sentences))


def _strain(strained: tuple[str, ...], baseline: Mapping[str, BaselineValue]) -> list[str]:
    """Say which values would have to be further off than the lesson holds possible."""
    sentences = []
    for name in strained:
        item = baseline[name]
        off = f" ({item.refit_with / item.given - 1.0:+.0%})" if item.given else ""
        sentences.append(f"{name} would have to be {item.refit_with:.4g} {item.unit}{off}, further off than the lesson holds possible.")
    return sentences


def _far_off(names: tuple[str, ...], baseline: Mapping[str, BaselineValue]) -> list[str]:
    """Say which value explains the recordings by itself, and which others would as well."""
    if not names:
        return []
    item = baseline[names[0]]
    off = f" ({item.refit_with / item.given - 1.0:+.0%})" if item.given else ""
    told = f"{names[0]} of {item.refit_with:.4g} {item.unit}{off} explains by itself what is missing, though the lesson holds it impossible"
    others = f"; so would another value of {' or of '.join(names[1:])}" if len(names) > 1 else ""
    return [f"{told}{others}. Measure it, and say in the lesson how sure it is."]


def _not_told(effects: tuple[FoundEffect, ...], values: Estimates) -> tuple[str, ...]:
    sentences = []
    for effect in effects:
        if effect.tied_with:
            sentences.append(f"{effect.effect} cannot be told from {', '.join(effect.tied_with)} here. {effect.separating_experiment}")
        for name in effect.undetermined:
            sentences.append(f"{name} of {effect.effect} is not determined by this recording. {effect.separating_experiment or ''}".strip())
    return tuple(sentences)


def _unseen(standings: Iterable[Standing]) -> list[str]:
    """Say which refined forms of what is named the recording could not have shown."""
    pairs = [(item.term, other) for item in standings for other in item.unseen]
    return [f"Whether {term.name} is {other.name} this recording cannot tell. {other.effect.experiment}" for term, other in pairs]


def ask(lesson: str, machine: Machine, recordings: tuple[Recorded, ...], effects: Iterable[type[Effect]]) -> Question:
    """Put a question together."""
    return Question(lesson, machine, recordings[0], recordings[1] if len(recordings) > 1 else None, tuple(effects))
