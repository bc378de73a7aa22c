"""The table of the decision: every explanation that competed, with its gain, the error of that, and why it was kept or not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import reduce

from lathesim.analysis.display_unit import text_table
from lathesim.diagnosis.explaining.chance import chance_level, due, is_clear
from lathesim.diagnosis.explaining.plausible import IMPLAUSIBLE, Implausible, Objection, deviations, implausible, is_plausible
from lathesim.diagnosis.explaining.resolution import as_good, best_of, changed_readings, significant
from lathesim.diagnosis.explaining.rounds import is_finer
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.explaining.trial import over
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.comparison import HARDLY_REACHED, KINDS, NEVER_REACHED, Explanation, Kind
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.diagnosis.records.found import Found, Gain, Tried
from lathesim.diagnosis.reporting.effect_report import declared_in
from lathesim.diagnosis.reporting.number_text import NOTHING, number, percent, plain, quantity_text
from lathesim.diagnosis.verdict import Doubt
from lathesim.engine.assembly import Place
from lathesim.errors import listed
from lathesim.identification.signal import LARGER_PART, root_mean_square
from lathesim.recordings.raw_table import Finding, counted
from lathesim.units import product_unit

HEAD = ("explanation", "gain", "error", "chance level", "kept", "why")
ON_NOTHING = "depends on nothing recorded"
NOT_FITTED = "gains too little, by a linear estimate, to be fitted"
NOT_REACHED = "was not fitted before the search was stopped"
_OBJECTIONS: dict[Objection, str] = {
    "lag": "is a lag much shorter than a sample",
    "instant": "is an event from before the recording",
    "drift": "changes nothing once the recording has begun",
    "damping": "is so damped that nothing resonates",
    "wave": "is a wave longer than the recorded way",
    "passing": "lets next to nothing through",
    "runs away": "makes the simulation run away from the recording",
}
"""What speaks against the values of an effect, after its name."""
UNKNOWN = Gain(math.nan, math.nan)


def legend(method: Method = STANDARD) -> tuple[str, ...]:
    """Return what the columns of the table mean."""
    each = f"{method.margin:.0f} and {method.per_parameter:.0f} for each fitted value"
    return (
        "Gain: how much better the recording that judges is predicted with an explanation than without it.",
        "It is the logarithm of a ratio of probabilities: 0 is as probable, 5 is 150 times as probable. Error: its standard error.",
        f"Chance level: smaller gains may be chance. It is {method.errors:.0f} errors, or {each} if that is more.",
    )


def explanations_of(study: Study, found: Found, moved: Gain, doubted: Sequence[Doubt], *, differ: bool) -> tuple[Explanation, ...]:
    """Return the explanations of an answer: the lesson, other values (``moved`` is their gain over the given ones, from which they
    ``differ`` or not), effects, a fault of the recording, and smooth functions of what is left."""
    method, model = study.method, found.model
    name, why = "the lesson, its uncertain values fitted", "the others compete with it"
    lesson = Explanation(name, "", "lesson", 0.0, 0.0, 0.0, not (model.candidates or any(doubt.clear for doubt in doubted)), why)
    effects = [_effect(study, found, one) for one in best_of_each(found)]
    tried = {one.candidate.part for one in found.tried}
    waiting = [
        _row((one.name, one.place, "effect"), UNKNOWN, method, kept=False, why=NOT_FITTED if found.complete else NOT_REACHED)
        for one in study.estimation.candidates
        if one.part not in tried
    ]
    sound = _row(("a fault of the recording", "", "fault"), UNKNOWN, method, kept=False, why="no check of the recording finds one")
    flexible = [_flexible(doubt, method) for doubt in doubted]
    return (lesson, *_values(study, found, moved, differ=differ), *_together(study, found), *effects, *waiting, sound, *flexible)


def faults_as_explanations(faults: Sequence[Finding]) -> tuple[Explanation, ...]:
    """Return the findings of checks that decided, as explanations."""
    rows = (Explanation(one.kind, one.channel, "fault", math.nan, math.nan, math.nan, True, one.fact) for one in faults)
    return tuple(dict.fromkeys(rows))


def _row(what: tuple[str, str, Kind], gain: Gain, method: Method, *, kept: bool, why: str, parameters: int = 0) -> Explanation:
    level = chance_level(gain, method, parameters) if math.isfinite(gain.nats) else math.nan
    return Explanation(*what, gain.nats, gain.error, level, kept, why)


def _values(study: Study, found: Found, moved: Gain, *, differ: bool) -> list[Explanation]:
    """Return the rows of other values of the lesson: within their uncertainty, and beyond it."""
    method = study.method
    why = f"fit the first recording {'clearly' if differ else 'hardly'} better than the given values"
    rows = [_row(("other values, within their uncertainty", "", "values"), moved, method, kept=differ, why=why)]
    beyond: tuple[str, str, Kind] = ("other values, beyond their uncertainty", "", "values")
    if found.values is not None:
        _, gained = over(found.values, found.baseline)
        rows.append(_row(beyond, gained, method, kept=True, why="no effect predicts better"))
    else:
        strains = deviations(found.baseline.fitted).max(initial=0.0) >= IMPLAUSIBLE
        why = "gain no more than chance, or less than an effect" if strains else "not tried: no value is far from the given one"
        rows.append(_row(beyond, UNKNOWN, method, kept=False, why=why))
    return rows


def _together(study: Study, found: Found) -> list[Explanation]:
    """Return the row of several effects together."""
    candidates = found.model.candidates
    if len(candidates) < 2:
        return []
    _, gained = over(found.model, found.values or found.baseline)
    name = " + ".join(f"{one.name} at {one.place}" for one in candidates)
    return [_row((name, "", "effects"), gained, study.method, kept=True, why="all of these together")]


def best_of_each(found: Found) -> list[Tried]:
    """Return for each effect what it is worth in the model, or else the trial of it that predicts best."""
    best = {one.name: one for one in sorted(found.tried, key=gains)}
    return list({**best, **{one.name: one for one in found.worth.values()}}.values())


def gains(one: Tried) -> tuple[float, float]:
    """Return by what trials of one effect are ordered: what they gain on the validation and on the estimation recording [nats]."""
    return one.predicted.nats, one.fitted.nats


def _effect(study: Study, found: Found, one: Tried) -> Explanation:
    kept = any(one.candidate.part == candidate.part for candidate in found.model.candidates)
    judged = one.fitted.nats >= due(study.method)
    why = _why_kept(found, one) if kept else _why_not(study, found, one)
    what: tuple[str, str, Kind] = (one.candidate.name, one.candidate.place, "effect")
    return _row(what, one.predicted if judged else UNKNOWN, study.method, kept=kept, why=why, parameters=one.parameters)


def _why_kept(found: Found, one: Tried) -> str:
    if one.candidate.part in found.there_before:
        return "explains the recording from before the change as well"
    rivals = [rival.name for rival in found.rivals.get(one.candidate.part, ())]
    return f"predicts as well as {listed(rivals)}" if rivals else "predicts clearly better than without it"


def _why_not(study: Study, found: Found, one: Tried) -> str:
    """Return what speaks against a trial, the weightiest first."""
    method = study.method
    if one.fitted.nats < due(method, one.parameters):
        return "fits the first recording hardly better"
    if untested := _untested(one, study):
        return untested
    if one.predicted.nats <= 0.0:
        return "predicts worse than without it"
    if not is_clear(one.predicted, method, one.parameters):
        return "gains no more than chance could"
    if not significant(one, study):
        return _too_small(one, study)
    if (objection := implausible(study, one.model)) is not None:
        return _why_implausible(objection, one, study)
    return _why_another(study, found, one)


def _untested(one: Tried, study: Study) -> str:
    """Return why the recording that judges cannot validate an effect that fits the first one clearly better: it is simulated alike with the
    effect and without it, all other values as they are. Empty where it can."""
    method, judging, after = study.method, study.validation, one.model.validation_fit
    if is_clear(one.predicted, method, one.parameters) or not is_clear(one.fitted, method, one.parameters):
        return ""
    without = dict(zip(one.candidate.parameters, one.candidate.neutral.tolist(), strict=True))
    changed = after.residual - judging.sensed.one({**after.by_name, **without})
    judged = changed if judging.weights is None else changed[:, judging.weights > LARGER_PART]
    most = max(root_mean_square(row) / floor for row, floor in zip(judged, judging.sensed.seen_floors, strict=True))
    if most >= 1.0 or not is_plausible(study, one.model):
        return ""
    return HARDLY_REACHED if most > 0.0 else NEVER_REACHED


def _why_implausible(objection: Implausible, one: Tried, study: Study) -> str:
    """Return why an effect is not believed with its values, or the one that it needs beside it: of a size which one, and the bound."""
    other = objection.candidate if objection.candidate is not None and objection.candidate.part != one.candidate.part else None
    if objection.objection == "size":
        unit = reduce(product_unit, (declared_in(study.estimation, name).unit for name in objection.names))
        size, bound = (quantity_text(value, unit, 3) for value in (objection.size, objection.bound))
        what = " x ".join(Place.of(name).port.replace("_", " ") for name in objection.names)
        where = "below" if objection.size < objection.bound else "beyond"
        why = f"needs {'an' if what[0] in 'aeiou' else 'a'} {what} of {size}, {where} the plausible {bound}"
    else:
        why = _OBJECTIONS[objection.objection]
    return f"needs {other.name} beside it, which {why}" if other else why


def _too_small(one: Tried, study: Study) -> str:
    """Return why a clear gain is too small a find: its share of what is left, else what it changes beside noise and errors of laws."""
    share = max(0.0, min(one.predicted.share, one.fitted.share))
    least = study.method.larger_part if one.candidate.effect.identification.size_of_recording else study.least_share
    if share <= least:
        return f"explains {percent(share)} of the remaining error, less than the {percent(least)} required"
    if not changed_readings(study, one.before, one.model):
        return "changes no reading by more than its noise"
    return f"changes forces by less than {percent(study.method.within_laws)}, which the model error may reach"


def _why_another(study: Study, found: Found, one: Tried) -> str:
    """Return which explanation was taken in the place of a trial that is good by itself."""
    kept = found.model.candidates
    dropped = [step.why for step in found.history if step.move == "drop" and one.name in step.went]
    if dropped:
        return f"was dropped, as {dropped[-1]}"
    for candidate in kept:
        if any(one.candidate.part == rival.candidate.part for rival in found.rivals.get(candidate.part, ())):
            return f"predicts as well as {candidate.name} at {candidate.place}, and may be there in its place"
        if is_finer(one.candidate, [candidate]):
            return f"refines {candidate.name} and explains little more"
    beside = [other for other in found.tried if other.before is one.before and any(other.candidate.part == of.part for of in kept)]
    taken = best_of(study, beside)
    if taken is None and found.values is not None:
        return "predicts no better than other values of the lesson"
    if taken is None:
        return "is not needed beside what was kept" if kept else "was not taken, as the best of its round was dropped"
    if as_good(one.model, taken, study):
        return f"predicts about as well as {taken.name}, which has no more values"
    return f"predicts worse than {taken.name}, and is not needed beside it"


def _flexible(doubt: Doubt, method: Method) -> Explanation:
    """Return the smooth functions of what is left behind a channel as one of the explanations that compete."""
    gained = Gain(doubt.gain, doubt.error)
    small = "less than the model error or the noise" if is_clear(gained, method) else "predicts nothing of the remaining error"
    why = "predicts the remaining error, which no effect explains" if doubt.clear else small
    on = doubt.depends_on[0] if doubt.depends_on else ON_NOTHING
    return _row((on, doubt.channel, "flexible"), gained, method, kept=doubt.clear, why=why)


def explanation_lines(diagnosis: Diagnosis, method: Method = STANDARD) -> list[str]:
    """Return the table of a decision as lines of text; effects that were not fitted are counted."""
    shown, more = _judged(diagnosis.search.explanations)
    rows = [tuple(plain(cell) for cell in row) for row in map(explanation_row, shown)]
    gained = any(math.isfinite(one.gain) for one in diagnosis.search.explanations)
    return ["", "How it was decided:", *text_table([HEAD, *rows]), *more, *(legend(method) if gained else ())]


def explanation_rows(diagnosis: Diagnosis, most: int) -> tuple[list[tuple[str, ...]], list[str]]:
    """Return the rows of what was kept and of what else gains most, at most so many, and a sentence on the others."""
    shown, more = _judged(diagnosis.search.explanations)
    likeliest = sorted(shown, key=lambda one: (not one.kept, -one.gain if math.isfinite(one.gain) else math.inf))
    left_out = max(0, len(shown) - most)
    printed = [f"{left_out} more stand in the table of lathesim diagnose --explain-decision."] if left_out else []
    return [explanation_row(one) for one in shown if one in likeliest[:most]], [*printed, *more]


def _judged(explanations: Sequence[Explanation]) -> tuple[list[Explanation], list[str]]:
    """Return the explanations in the order of the table, without effects that were not judged, and sentences on those."""
    shown = [one for one in explanations if one.kind != "effect" or math.isfinite(one.gain)]
    waiting = [one.reason for one in explanations if one.kind == "effect" and not math.isfinite(one.gain)]
    ordered = sorted(shown, key=lambda one: (KINDS.index(one.kind), not one.kept, -one.gain if math.isfinite(one.gain) else math.inf))
    said = (
        ("Not fitted, as a linear estimate promises too little", waiting.count(NOT_FITTED)),
        ("Not fitted, as the search was stopped", waiting.count(NOT_REACHED)),
        ("Not judged, as the first recording is fitted hardly better", sum(why not in (NOT_FITTED, NOT_REACHED) for why in waiting)),
    )
    return ordered, [f"{text}: {counted(many, 'effect')}." for text, many in said if many]


def explanation_row(one: Explanation) -> tuple[str, ...]:
    """Return a row of the table."""
    text, why = one.text, one.reason
    if one.kind == "flexible":
        text, why = (
            f"smooth functions, for the remaining error at {one.place}",
            f"{why}; it {one.name}" if one.kept and one.name != ON_NOTHING else why,
        )
    numbers = (number(value, 0) if math.isfinite(value) else NOTHING for value in (one.gain, one.standard_error, one.chance))
    return text, *numbers, "yes" if one.kept else "no", why
