"""The answer of a diagnosis in at most six lines: what is missing, where, how large, how sure, compared with what, what to do next.

They are read by somebody who knows machines and controllers and not this program. Everything comes from the :class:`Diagnosis`, so that no
line contradicts another one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from lathesim.diagnosis.location import FORCES
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.comparison import NEVER_REACHED, Explanation
from lathesim.diagnosis.records.diagnosis import VERDICTS, BaselineValue, ChannelTrace, Diagnosis, FoundEffect, Unnamed
from lathesim.diagnosis.records.shown import Shown
from lathesim.diagnosis.reporting.number_text import interval_texts, least_probable_text, number, percent, probability_text, quantity_text
from lathesim.diagnosis.reporting.remarks import next_step, untested, with_places
from lathesim.errors import listed
from lathesim.identification.signal import LARGER_PART, root_mean_square
from lathesim.recordings.raw_table import counted

OF_RECORDING = "recording"
"""The family of effects that are faults of a recording and not of a machine."""
OF_VALUES = ("no_mismatch", "parameters_only")
"""The verdicts that find no physics missing."""


def summary_lines(diagnosis: Diagnosis, method: Method = STANDARD) -> list[str]:
    """Return the answer in at most six lines, the first of which has no label."""
    labelled = {
        "Where": _where(diagnosis),
        "Size": _size(diagnosis),
        "Sure": _sure(diagnosis),
        "Compared": _compared(diagnosis, method),
        "Next": _next(diagnosis, method),
    }
    return [headline(diagnosis, method), *(f"{label}: {text}" for label, text in labelled.items() if text)]


def headline(diagnosis: Diagnosis, method: Method = STANDARD) -> str:
    """Return what is missing, and beside it what stays unexplained."""
    if names_steps_alone(diagnosis) and still_off(diagnosis, method):
        beside = f"Beside it, the simulation left out {_rivalled(diagnosis.effects)}."
        return " ".join([*diagnosis.question.turned, _in_part(diagnosis, method), *_left_over(diagnosis), beside])
    if diagnosis.names:
        return " ".join([*diagnosis.question.turned, _named(diagnosis), *_left_over(diagnosis), *stays_off(diagnosis, method)])
    if diagnosis.verdict == "recording_fault" or diagnosis.sentence != VERDICTS[diagnosis.verdict]:
        return diagnosis.sentence
    if diagnosis.verdict == "unknown":
        place = f" at {diagnosis.location.components[0]}" if diagnosis.location.components else ""
        return " ".join([f"Physics is missing{place} that no known effect explains.", *_left_over(diagnosis), *_untested(diagnosis)])
    told = _in_part(diagnosis, method) if still_off(diagnosis, method) else _nothing_missing(diagnosis, method)
    return " ".join([told, *_untested(diagnosis)])


def names_steps_alone(diagnosis: Diagnosis) -> bool:
    """Return whether nothing is named but steps in which something is read: they explain no error that is larger."""
    return diagnosis.names and all(effect.is_step for effect in diagnosis.effects)


def _untested(diagnosis: Diagnosis) -> list[str]:
    """Return which effects fit the first recording clearly better and cannot be validated by the other one, as it does not show them."""
    names, question = untested(diagnosis), diagnosis.question
    if not names:
        return []
    never = all(one.reason == NEVER_REACHED for one in diagnosis.search.explanations if one.is_untested)
    fits, them = ("fit", "them") if len(names) > 1 else ("fits", "it")
    reaches = f"{question.validation} {'never' if never else 'hardly'} reaches {them}"
    return [f"{with_places(names)} {fits} {question.recording} clearly better, but {reaches} and cannot validate {them}."]


def _next(diagnosis: Diagnosis, method: Method) -> str:
    worse = _worse(diagnosis)
    values = [name for name, _ in shown_values(diagnosis)]
    return next_step(diagnosis, worse, values, needed=needs_other_values(diagnosis, method), off=bool(still_off(diagnosis, method)))


def _named(diagnosis: Diagnosis) -> str:
    """Return what was left out, with what may be in its place. An effect whose size may be zero is no find. Nor is one with which
    every channel is further off, where none drifts."""
    finds, worse = found_effects(diagnosis), _worse(diagnosis)
    adrift = {trace.channel for trace in diagnosis.evidence.traces if not trace.held}
    spoils = all(effect.family != OF_RECORDING for effect in finds) and not adrift and len(worse) == len(diagnosis.fit) > 0
    if not finds or spoils:
        return _described(diagnosis, finds, worse)
    # what may as well be another effect, as one of the machine, is no sure fault
    faults = [effect for effect in finds if effect.family == OF_RECORDING and not effect.tied_with]
    physics = [effect for effect in finds if effect not in faults]
    begins = f"New since {diagnosis.question.before}: " if diagnosis.question.before else "The simulation left out "
    sentences = [f"{begins}{_rivalled(physics)}."] if physics else []
    sentences += [f"The recording has a fault: {_rivalled(faults)}."] if faults else []
    return " ".join(sentences)


def _described(diagnosis: Diagnosis, finds: Sequence[FoundEffect], worse: Sequence[str]) -> str:
    """Return what describes best what is missing, and why that is no find; a step in which something is read is certain beside it."""
    doubtful = [effect for effect in diagnosis.effects if effect.sizes.may_be_zero or not effect.is_step] or list(diagnosis.effects)
    certain = [effect for effect in diagnosis.effects if effect not in doubtful]
    names = with_places([(effect.effect, effect.at) for effect in doubtful])
    verb, sizes = ("describe", "their sizes are") if len(doubtful) > 1 else ("describes", "its size is")
    but = f"the error of {listed(worse)} is larger than with the lesson alone" if finds else f"{sizes} not determined"
    beside = f" Beside it, the simulation left out {_rivalled(certain)}." if certain else ""
    return f"Something is missing. {names} {verb} it best, but {but}: it may be something else.{beside}"


def _rivalled(effects: Sequence[FoundEffect]) -> str:
    """Return effects with their places, and in brackets those that may be in the place of each."""
    rivals = [f" (or {' or '.join(effect.tied_with)})" if effect.tied_with else "" for effect in effects]
    return with_places([(f"{effect.effect}{or_}", effect.at) for effect, or_ in zip(effects, rivals, strict=True)])


def _left_over(diagnosis: Diagnosis) -> list[str]:
    """Return what is left that could be predicted and has no name, the largest gain first."""
    return [without_name(diagnosis.rest.unnamed[0])] if diagnosis.rest.unnamed else []


def without_name(left: Unnamed) -> str:
    """Return that something is left at a place which no effect explains, and on what it depends."""
    return f"The unexplained error at {left.at} {left.depends_on[0] if left.depends_on else 'remains'}."


def _nothing_missing(diagnosis: Diagnosis, method: Method) -> str:
    nothing = f"{diagnosis.question.validation} shows no missing physics" if untested(diagnosis) else "No physics is missing"
    since = f"Nothing is new since {diagnosis.question.before}" if diagnosis.question.before else nothing
    if diagnosis.verdict == "parameters_only":
        return (
            f"{since}, but {_far_off(diagnosis)}"
            if diagnosis.rest.far_off
            else f"{since}: other values of the lesson explain the recording."
        )
    if worse := _worse(diagnosis):
        return f"No effect that is missing shows, and the fitted values predict {listed(worse)} worse than the given ones."
    others = ", with other values than the given ones" if needs_other_values(diagnosis, method) else ""
    return f"{since}: the lesson explains the recording{others}."


def _worse(diagnosis: Diagnosis) -> list[str]:
    return [name for name in diagnosis.fit if is_clearly_worse(diagnosis, name)]


def _far_off(diagnosis: Diagnosis) -> str:
    off = diagnosis.rest.far_off
    return f"{listed(off)} {'are' if len(off) > 1 else 'is'} further off than the lesson declares possible."


def _in_part(diagnosis: Diagnosis, method: Method) -> str:
    """Return that neither the lesson nor an effect explains all of the recording, and which channel shows that."""
    explains = "The lesson explains a part of the recording."
    if diagnosis.verdict == "parameters_only":
        explains = "Other values of the lesson explain a part of the recording."
        explains = f"{explains} {_far_off(diagnosis)}" if diagnosis.rest.far_off else explains
    since = [f"Nothing is new since {diagnosis.question.before}."] if diagnosis.question.before else []
    # an effect that predicts it and is too small to be named stands in the line on how sure the answer is
    known = diagnosis.rest.unnamed or untested(diagnosis) or any(one.is_clear for one in _rivals(diagnosis))
    nothing = [] if known else ["No known effect and no recorded signal predicts it."]
    return " ".join([*since, explains, *stays_off(diagnosis, method), *nothing])


def stays_off(diagnosis: Diagnosis, method: Method = STANDARD) -> list[str]:
    """Return which channel stays furthest beyond its noise, and how far; nothing where none does."""
    free = {trace.channel: trace for trace in diagnosis.evidence.traces if not trace.held}
    over = still_off(diagnosis, method)
    adrift = [free[name] for name in over if name in free]
    return [*_beyond_noise(diagnosis, [name for name in over if name not in free]), *_adrift(diagnosis, adrift)]


def _beyond_noise(diagnosis: Diagnosis, off: Sequence[str]) -> list[str]:
    if not off:
        return []
    item, others = diagnosis.fit[off[0]], off[1:]
    also = f"{len(others)} more channels exceed their" if others[1:] else f"{others[0]} also exceeds its" if others else ""
    times = number(float(f"{item.after / item.floor:.2g}"), digits=2)
    more = f"; {also} noise" if also else ""
    return [f"The error of {off[0]} remains {_shown(item.after, item.unit)}, {times} times its noise{more}."]


def _adrift(diagnosis: Diagnosis, free: Sequence[ChannelTrace]) -> list[str]:
    """Return how far channels are off that nothing brings back: they sum up small errors, and their travel says more than their noise."""
    if not free:
        return []
    worst = free[0]
    off, travel = diagnosis.fit[worst.channel].after, float(np.nanmax(worst.recorded) - np.nanmin(worst.recorded))
    said = f"{worst.channel if free[1:] else 'it'} is off by {_shown(off, worst.unit)}"
    if travel > 0.0:
        times = off / travel
        said += f", {f'{number(100.0 * times, digits=2)} % of' if times < 1.0 else f'{number(times, digits=2)} times'} its travel"
    return [f"Nothing brings back {listed([trace.channel for trace in free])}, so small errors add up: {said}."]


def still_off(diagnosis: Diagnosis, method: Method = STANDARD) -> list[str]:
    """Return the channels that stay clearly further off than the recording resolves, the worst first."""
    over = {name: item.after / item.floor for name, item in diagnosis.fit.items() if item.floor > 0.0 and math.isfinite(item.after)}
    return sorted((name for name, times in over.items() if times > method.errors), key=lambda name: -over[name])


def found_effects(diagnosis: Diagnosis) -> list[FoundEffect]:
    """Return the effects that may be presented as a find: an effect whose size may be zero is none, and beside such ones alone neither is
    the step in which something is read."""
    sure = [effect for effect in diagnosis.effects if not effect.sizes.may_be_zero]
    return sure if len(sure) == len(diagnosis.effects) or not all(effect.is_step for effect in sure) else []


def _shown(value: float, unit: str) -> str:
    return quantity_text(value, unit, 3)


def _where(diagnosis: Diagnosis) -> str:
    """Return where physics is missing and on what it depends, nothing where none is."""
    places = list(diagnosis.location.components) or list(diagnosis.location.channels)[:1]
    return "" if diagnosis.verdict in OF_VALUES or not places else f"{listed(places)}."


def _size(diagnosis: Diagnosis) -> str:
    """Return the sizes with their intervals: of effects and values that moved, and of what has no name."""
    sentences = []
    if diagnosis.names:
        finds = found_effects(diagnosis)
        sentences.append(f"{'; '.join(f'{effect.effect} {_size_text(effect)}' for effect in finds or diagnosis.effects)}.")
        doubtful = [effect.effect for effect in diagnosis.effects if finds and effect.sizes.may_be_zero]
        if doubtful:
            many = len(doubtful) > 1
            absent = "Their sizes are not determined: they" if many else "Its size is not determined: it"
            sentences.append(f"{listed(doubtful)} {'make' if many else 'makes'} the prediction better too. {absent} may be absent.")
        sentences += _explained_text(diagnosis)
    elif diagnosis.verdict in OF_VALUES and (values := shown_values(diagnosis)) and not _worse(diagnosis):
        most = Shown.most_named
        sizes = [_moved_text(name, item) for name, item in values[:most]]
        together = [] if moved_values(diagnosis) else ["only together do these values explain more"]
        sentences.append("; ".join([*sizes, *([f"{len(values) - most} more below"] if len(values) > most else []), *together]) + ".")
    return " ".join([*sentences, *(_unnamed_text(left, diagnosis) for left in diagnosis.rest.unnamed[:1])])


def _explained_text(diagnosis: Diagnosis) -> list[str]:
    """Return which share of the error the effects explain under recorded inputs; nothing where that is less than half, and the whole
    simulation loses more than half at each channel: a reader would take the two for a contradiction."""
    share = diagnosis.rest.removed_share
    left = max(((one.after / one.before) ** 2 for one in diagnosis.fit.values() if one.before > 0.0), default=1.0)
    if share <= 0.0 or share < LARGER_PART < 1.0 - left:
        return []
    return [f"With each part driven by its recorded inputs and slow drift left out, this explains {percent(share)} of the squared error."]


def _unnamed_text(left: Unnamed, diagnosis: Diagnosis) -> str:
    """Return how large what has no name is, a force beside all that acts there."""
    size = f"Unexplained: {quantity_text(left.size, left.unit, 2)} RMS at {left.at}"
    acts = next((root_mean_square(one.total) for one in diagnosis.evidence.missing if one.at == left.at and one.unit in FORCES), 0.0)
    return f"{size}, {percent(left.size / acts)} of the total there." if acts > left.size else f"{size}."


def _size_text(effect: FoundEffect) -> str:
    """Return a size of an effect with its interval: the first that is surely not zero, else the first that the recording determines; of a
    product, of a pure number, and of one that is not the effect's first, which one it is."""
    named = [
        ("" if place == 0 and item.unit != "1" else f"{name.replace('_', ' ')} ", name, item)
        for place, (name, item) in enumerate(effect.parameters.items())
    ]
    sizes = [(label, item) for label, name, item in named if name not in effect.sizes.undetermined]
    sizes.sort(key=lambda one: not (math.isfinite(one[1].high - one[1].low) and one[1].low * one[1].high > 0.0))
    products = [(f"{name.replace('_', ' ')} ", item) for name, item in effect.sizes.products.items()]
    if not (products or sizes):
        return "is not determined" + (", may be zero" if effect.sizes.may_be_zero else "")
    name, item = (products or sizes)[0]
    value, interval = interval_texts(item.value, item.low, item.high, item.unit, item.ends)
    return f"{name}{value} (95 % interval {interval})" + (", may be zero" if effect.sizes.may_be_zero else "")


def moved_values(diagnosis: Diagnosis) -> list[tuple[str, BaselineValue]]:
    """Return the values of the lesson whose interval does not hold the given value, those that moved most first."""
    return most_moved((name, item) for name, item in diagnosis.baseline.items() if item.low > item.given or item.high < item.given)


def shown_values(diagnosis: Diagnosis) -> list[tuple[str, BaselineValue]]:
    """Return the values of the lesson that an answer gives: those that moved, or all where other values explain and none moved alone."""
    moved = moved_values(diagnosis)
    return moved if moved or diagnosis.verdict != "parameters_only" else most_moved(diagnosis.baseline.items())


def most_moved(values: Iterable[tuple[str, BaselineValue]]) -> list[tuple[str, BaselineValue]]:
    """Return values of a lesson, those that moved most as a share of what they were first."""
    return sorted(values, key=lambda pair: -abs((pair[1].refit_with - pair[1].given) / (pair[1].given or 1.0)))


def needs_other_values(diagnosis: Diagnosis, method: Method = STANDARD) -> bool:
    """Return whether the lesson explains the recording with other values, and not with the given ones: these leave a channel clearly
    further off than its noise and than the others do."""
    if diagnosis.verdict != "no_mismatch" or not moved_values(diagnosis):
        return diagnosis.verdict == "parameters_only"
    return any(item.before > max(method.errors * item.floor, Shown.hardly_worse * item.after) for item in diagnosis.fit.values())


def _moved_text(name: str, item: BaselineValue) -> str:
    value, interval = interval_texts(item.refit_with, item.low, item.high, item.unit, item.ends)
    return f"{name} is {value} (95 % interval {interval}) and not {quantity_text(item.given, item.unit)}"


def _sure(diagnosis: Diagnosis) -> str:
    """Return how sure the answer is."""
    if diagnosis.verdict == "recording_fault":
        return ""
    stopped = [] if diagnosis.complete else ["The search was stopped before it had tried everything."]
    if diagnosis.names:
        return " ".join([*stopped, *_sure_of_names(diagnosis)])
    if diagnosis.verdict == "unknown":
        return " ".join([*stopped, *_certainly_missing(diagnosis)])
    return " ".join([*stopped, *_nothing_else(diagnosis)])


def _sure_of_names(diagnosis: Diagnosis) -> list[str]:
    """Return how probable the names are, what they cannot be told from, and else why the next best was not taken."""
    finds = found_effects(diagnosis) or list(diagnosis.effects)
    least = min((effect.probability for effect in finds), default=math.nan)
    probable = f"Each is {least_probable_text(least)}" if len(finds) > 1 else f"{probability_text(least)} probable"
    said = [f"{probable} among all explanations compared."]
    if diagnosis.question.is_one_stroke:
        said = ["Less than the fit suggests: one stroke cannot validate itself, and there is no second one."]
    elif diagnosis.question.together:
        said.append("Both recordings were fitted, so none was left to validate it.")
    elif worse := _worse(diagnosis):
        errors = "have larger errors" if len(worse) > 1 else "has a larger error"
        said = [f"Less than the fit suggests: {listed(worse)} {errors} than with the lesson alone."]
    tied = [f"{effect.effect} from {listed(list(effect.tied_with))}" for effect in finds if effect.tied_with]
    if tied:
        return [*said, f"This recording cannot tell {', nor '.join(tied)}."]
    return [*said, *(f"The closest rival, {best.text}, {best.reason}." for best in _rivals(diagnosis)[:1])]


def _certainly_missing(diagnosis: Diagnosis) -> list[str]:
    """Return that something is surely missing: a smooth function predicts it, or a rule of the decision says why."""
    kept = [one for one in diagnosis.search.explanations if one.kind == "flexible" and one.kept]
    if not kept:
        return [f"{diagnosis.search.rule[0].upper()}{diagnosis.search.rule[1:]}."] if diagnosis.search.rule else []
    best = max(kept, key=lambda one: one.gain)
    level = f"the log-likelihood gains {best.gain:.0f}, and by chance at most {best.chance:.0f}"
    return [f"A smooth function of the motion predicts {best.place} clearly better: {level}."]


def _nothing_else(diagnosis: Diagnosis) -> list[str]:
    """Return that no effect predicts better than chance, or which one does and yet was left out."""
    rivals = [one for one in _rivals(diagnosis) if one.is_clear]
    if rivals:
        return [f"No effect is named: the best one, {rivals[0].text}, {rivals[0].reason}."]
    return (
        ["No effect predicts the recording better than chance could."]
        if any(one.kind == "effect" for one in diagnosis.search.explanations)
        else []
    )


def _rivals(diagnosis: Diagnosis) -> list[Explanation]:
    """Return the effects that are judged and not kept, the best first."""
    judged = [one for one in diagnosis.search.explanations if one.kind == "effect" and not one.kept and math.isfinite(one.gain)]
    return sorted(judged, key=lambda one: -one.gain)


def _compared(diagnosis: Diagnosis, method: Method) -> str:
    """Return what competed, which recording judged, and how far off the channels are there before and after."""
    return " ".join([*_competitors(diagnosis), *_before_and_after(diagnosis, method)]) if diagnosis.fit else ""


def _competitors(diagnosis: Diagnosis) -> list[str]:
    """Return what was compared, and what judged it."""
    effects = [one for one in diagnosis.search.explanations if one.kind == "effect"]
    values, names = len(diagnosis.baseline), len({one.name for one in effects})
    competed = [f"other values of {counted(values, 'uncertain parameter')} of the lesson"] if values else []
    competed += [f"{names} effects at {len(effects)} places" if names > 1 else f"{effects[0].text}"] if effects else []
    competed += ["smooth functions of the motion"] if any(one.kind == "flexible" for one in diagnosis.search.explanations) else []
    judged = (
        listed(diagnosis.question.judges) if diagnosis.question.judges else diagnosis.question.validation or "the recording that judges"
    )
    fitted = f"Each was fitted to {diagnosis.question.recording} and validated on {judged}."
    if diagnosis.question.is_one_stroke:
        fitted = (
            f"{diagnosis.question.recording} holds one stroke with unlike halves: it was fitted whole, and nothing is left for validation."
        )
    elif diagnosis.question.together:
        fitted = f"{diagnosis.question.recording} and {judged} were fitted together, as neither alone determines all values."
    elif diagnosis.question.judges_itself:
        part = judged.removeprefix(f"{diagnosis.question.recording}, ")
        fitted = f"Each was fitted to one part of {diagnosis.question.recording} and validated on the other ({part})."
    return [f"with {listed(competed)}.", fitted] if competed else []


def _before_and_after(diagnosis: Diagnosis, method: Method) -> list[str]:
    """Return how far off channels are before and after: the worst and those that change most; each that is worse says so."""
    sized = {name: item for name, item in diagnosis.fit.items() if item.after > 0.0 and item.before > 0.0}
    change = {name: abs(math.log(item.after / item.before)) for name, item in sized.items()}
    worst = still_off(diagnosis, method)[:1]
    order = sorted(diagnosis.fit, key=lambda name: (name not in worst, -change.get(name, 0.0)))
    shown = [name for place, name in enumerate(order) if place < Shown.most_named or is_worse(diagnosis, name)]
    states = "lesson alone -> with this" if diagnosis.effects else "values as given -> fitted"
    asked = diagnosis.question
    both = f"{asked.recording} and " if asked.together else ""
    there = f" on {both}{asked.validation}" if asked.validation else ""
    off = f"RMS error of the whole simulation{there} ({states})"
    return [f"{off}: {'; '.join(_change_of(diagnosis, name) for name in shown)}."] if shown else []


def is_worse(diagnosis: Diagnosis, name: str) -> bool:
    """Return whether a channel is further off after than before, in the digits that are shown."""
    item = diagnosis.fit[name]
    return item.after > item.before and _shown(item.after, item.unit) != _shown(item.before, item.unit)


def is_clearly_worse(diagnosis: Diagnosis, name: str) -> bool:
    """Return whether a channel is further off after than before by more than next to nothing."""
    item = diagnosis.fit[name]
    return is_worse(diagnosis, name) and item.after > Shown.hardly_worse * item.before


def _change_of(diagnosis: Diagnosis, name: str) -> str:
    item = diagnosis.fit[name]
    before, after = (_shown(value, item.unit) for value in (item.before, item.after))
    worse = ", WORSE" if is_clearly_worse(diagnosis, name) else ", slightly worse" if is_worse(diagnosis, name) else ""
    return f"{name} {after}" if before == after else f"{name} {before} -> {after}{worse}"
