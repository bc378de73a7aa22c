"""The answer of a diagnosis in at most six lines: what is missing, where, how large, how sure, compared with what, what to do next.

They are read by somebody who knows machines and controllers and not this program. Everything comes from the :class:`Diagnosis`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from lathesim.analysis.display_unit import known_share
from lathesim.diagnosis.location.missing_share import FORCES
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import VERDICTS, BaselineValue, Diagnosis, FoundEffect, MissingSignal, listed
from lathesim.diagnosis.reporting.evidence import strongest_variables
from lathesim.diagnosis.reporting.next_step import next_step
from lathesim.diagnosis.reporting.number_text import interval_texts, percent, probability_text, quantity_text

_BEST_CASE = "No physics is missing, but "
"""How a sentence begins that is not to be believed where a channel is still off."""


def summary_lines(diagnosis: Diagnosis, method: Method = STANDARD) -> list[str]:
    """Return the answer in at most six lines, the first of which has no label."""
    off, worse = unexplained(diagnosis, method), [name for name in diagnosis.fit if is_clearly_worse(diagnosis, name, method)]
    labelled = {
        "Where": _where(diagnosis, method),
        "Size": _size(diagnosis, method),
        "Sure": _sure(diagnosis, method),
        "Compared": _compared(diagnosis, method),
        "Next": next_step(diagnosis, off, worse),
    }
    return [headline(diagnosis, method), *(f"{label}: {text}" for label, text in labelled.items() if text)]


def still_off(diagnosis: Diagnosis, method: Method = STANDARD) -> list[str]:
    """Return the channels that stay clearly further off than the recording resolves, the worst first."""
    over = {name: item.after / item.floor for name, item in diagnosis.fit.items() if item.floor > 0.0 and math.isfinite(item.after)}
    return sorted((name for name, times in over.items() if times > method.reporting.near_floor), key=lambda name: -over[name])


def unexplained(diagnosis: Diagnosis, method: Method = STANDARD) -> list[str]:
    """Return the channels that stay off and could be predicted: all that stay off where no flexible function was tried."""
    flexible = [one for one in diagnosis.explanations if one.kind == "flexible"]
    if flexible and not any(one.kept or one.is_clear for one in flexible):
        return []
    return still_off(diagnosis, method)


def headline(diagnosis: Diagnosis, method: Method = STANDARD) -> str:
    """Return what is missing, and beside it what stays unexplained."""
    off = still_off(diagnosis, method)
    if diagnosis.names:
        return _named(diagnosis, method)
    if diagnosis.verdict == "unknown":
        return _unknown(diagnosis, method)
    if diagnosis.verdict == "recording_fault" or not off:
        return diagnosis.sentence or VERDICTS[diagnosis.verdict]
    left = _left_at(diagnosis, off, method)
    far_off = diagnosis.sentence.removeprefix(_BEST_CASE)
    if far_off != diagnosis.sentence:
        return f"{far_off} {left[0].upper()}{left[1:]} are left that this does not explain."
    enough = [name for name in diagnosis.fit if name not in off]
    means = "With other values the lesson's physics" if diagnosis.verdict == "parameters_only" else "The lesson's physics"
    does = f"is enough for {listed(enough)};" if enough else "explains no channel down to the noise:"
    if not unexplained(diagnosis, method):
        return f"{means} explains all that can be predicted; {left} are left that nothing recorded predicts."
    return f"{means} {does} {left} are left that it does not explain."


def _named(diagnosis: Diagnosis, method: Method) -> str:
    """Return what was left out. An effect whose size may be zero is no find; what is certain is named also where something else is left."""
    finds = found_effects(diagnosis)
    told = diagnosis.sentence
    beginning, name, _ = told.partition(diagnosis.effects[0].effect) if diagnosis.effects else ("", "", "")
    if finds and name and len(finds) < len(diagnosis.effects):
        told = f"{beginning}{listed([_with_rivals(effect, f'{effect.effect} at {effect.at}') for effect in finds])}."
    if not finds:
        names = listed([f"{effect.effect} at {effect.at}" for effect in diagnosis.effects])
        return f"Physics is missing that {names} describes best, but its size may be zero: this recording does not determine it."
    if diagnosis.adequate:
        return told
    if name:
        told = f"{beginning}{listed([_with_rivals(effect, _with_size(effect)) for effect in finds])}."
    which = "which explains" if len(finds) == 1 else "which together explain"
    share = percent(diagnosis.removed_share) if diagnosis.removed_share > 0.0 else "nothing"
    return f"{told.removesuffix('.')}, {which} {share} of the held-out error; {_what_is_left(diagnosis, method)}."


def _unknown(diagnosis: Diagnosis, method: Method) -> str:
    """Return that physics is missing which has no name, and what a part of it looks like."""
    if diagnosis.sentence.removeprefix(VERDICTS["unknown"]) == diagnosis.sentence:
        return diagnosis.sentence
    place = f" at {diagnosis.location.components[0]}" if diagnosis.location.components else ""
    missing = f"Physics is missing{place} that no effect of the catalogue explains."
    finds = found_effects(diagnosis) if diagnosis.removed_share > 0.0 else []
    if not finds:
        return missing
    looks = "A part of it looks like" if diagnosis.complete else "So far, a part of it looks like"
    parts = listed([_with_size(effect) for effect in finds[: method.reporting.most_named]])
    return f"{missing} {looks} {parts}; {_what_is_left(diagnosis, method)}."


def found_effects(diagnosis: Diagnosis) -> list[FoundEffect]:
    """Return the effects that may be presented as a find: an effect whose size may be zero is none."""
    return [effect for effect in diagnosis.effects if not effect.may_be_zero]


def size_of(effect: FoundEffect) -> tuple[str, str]:
    """Return the first size of an effect that the recording determines and its interval, both as text; empty where there is none."""
    for name, item in effect.parameters.items():
        if name not in effect.undetermined:
            return interval_texts(item.value, item.low, item.high, item.unit)
    return "", ""


def _with_size(effect: FoundEffect) -> str:
    value, _ = size_of(effect)
    return f"{effect.effect} of {value} at {effect.at}" if value else f"{effect.effect} at {effect.at}"


def _with_rivals(effect: FoundEffect, text: str) -> str:
    return f"{text} (or {', '.join(effect.tied_with)})" if effect.tied_with else text


def _what_is_left(diagnosis: Diagnosis, method: Method) -> str:
    predicted = [one for one in diagnosis.explanations if one.kind == "flexible" and one.kept]
    if predicted:
        return f"what is left at {predicted[0].place} {predicted[0].name} and has no name"
    on = strongest_variables(diagnosis.evidence.bars, [], after=True, method=method)[:1]
    return f"what is left depends on {on[0]} and has no name" if on else "what is left depends on nothing recorded and has no name"


def _left_at(diagnosis: Diagnosis, off: Sequence[str], method: Method) -> str:
    """Return how far the channels are off that stay off: ``"at x_scale.position 1.77 µm"``."""
    sizes = [f"at {name} {_shown(diagnosis.fit[name].after, diagnosis.fit[name].unit)}" for name in off[: method.reporting.most_named]]
    more = [f"at {len(off) - method.reporting.most_named} more channels as much"] if len(off) > method.reporting.most_named else []
    return listed([*sizes, *more])


def _shown(value: float, unit: str) -> str:
    return quantity_text(value, unit, 3)


def _where(diagnosis: Diagnosis, method: Method) -> str:
    """Return where physics is missing and with what it goes, nothing where none is."""
    off = unexplained(diagnosis, method)
    nothing_missing = diagnosis.verdict in ("no_mismatch", "parameters_only")
    if nothing_missing and not off:
        return ""
    places = off[:1] if nothing_missing else list(diagnosis.location.components) or list(diagnosis.location.channels)[:1]
    on = strongest_variables(diagnosis.evidence.bars, off, after=True, method=method) if nothing_missing else diagnosis.location.variables
    goes = f"; the error goes with {listed(list(on[:2]))}" if on else ""
    return f"{', '.join(places)}{goes}." if places else ""


def _size(diagnosis: Diagnosis, method: Method) -> str:
    """Return the sizes with their intervals: of effects, else of values that moved, else of what is missing."""
    if diagnosis.names:
        sizes = [f"{effect.effect} {_size_text(effect)}" for effect in diagnosis.effects]
    elif diagnosis.verdict == "parameters_only":
        moved, most = moved_values(diagnosis), method.reporting.most_named
        sizes = [_moved_text(name, item) for name, item in moved[:most]]
        sizes += [f"{len(moved) - most} more below"] if len(moved) > most else []
    elif diagnosis.verdict == "unknown":
        parts = found_effects(diagnosis) if diagnosis.removed_share > 0.0 else []
        sizes = [*(f"{effect.effect} {_size_text(effect)}" for effect in parts), *_missing_text(diagnosis)]
    else:
        sizes = []
    explained = diagnosis.names and diagnosis.adequate and diagnosis.removed_share > 0.0
    share = f" With recorded inputs this explains {percent(diagnosis.removed_share)} of the held-out error." if explained else ""
    return f"{'; '.join(sizes)}.{share}" if sizes else ""


def _size_text(effect: FoundEffect) -> str:
    value, interval = size_of(effect)
    text = f"{value} (95 % interval {interval})" if value else "is not determined by this recording"
    return f"{text}, which holds zero: no find" if effect.may_be_zero and value else text


def moved_values(diagnosis: Diagnosis) -> list[tuple[str, BaselineValue]]:
    """Return the values of the lesson whose interval does not hold the given value, those that moved most first."""
    moved = [(name, item) for name, item in diagnosis.baseline.items() if item.low > item.given or item.high < item.given]
    return sorted(moved, key=lambda pair: -abs(_moved_by(pair[1])))


def _moved_by(item: BaselineValue) -> float:
    """Return by which share of the given value a value moved; of one that is given as 0 how far."""
    return (item.refit_with - item.given) / (item.given or 1.0)


def _moved_text(name: str, item: BaselineValue) -> str:
    value, interval = interval_texts(item.refit_with, item.low, item.high, item.unit)
    return f"{name} is {value} (95 % interval {interval}) and not {quantity_text(item.given, item.unit)}"


def _missing_text(diagnosis: Diagnosis) -> list[str]:
    """Return how large the force or signal is that is missing, of the one that is largest beside what acts there."""
    known = [item for item in diagnosis.evidence.missing if math.isfinite(item.sizes[1])]
    largest = max(known, key=lambda item: item.share_after if math.isfinite(item.share_after) else 0.0, default=None)
    return [_one_missing(largest)] if largest else []


def _one_missing(item: MissingSignal) -> str:
    share = known_share(item.share_after)
    of = "of what acts there" if item.unit in FORCES else "of the signal there"
    beside = f", {percent(share)} {of}" if share < 1.0 else ""
    return f"without a name {_shown(item.sizes[1], item.unit)} (root mean square) at {item.at}{beside}"


def _sure(diagnosis: Diagnosis, method: Method) -> str:
    """Return how sure the answer is, among what was tried."""
    stopped = "" if diagnosis.complete else "The search was stopped before it had tried everything. "
    tried = sum(one.kind == "effect" and math.isfinite(one.gain) for one in diagnosis.explanations)
    if diagnosis.verdict == "recording_fault":
        return ""
    if diagnosis.names:
        return f"{stopped}{_sure_of_names(diagnosis, tried, method)}"
    if diagnosis.verdict == "unknown":
        return stopped + _certainly_missing(diagnosis, tried, method)
    return f"{stopped}{_nothing_else(diagnosis, tried)}".strip()


def _certainly_missing(diagnosis: Diagnosis, tried: int, method: Method) -> str:
    """Return how far off the worst channel stays, and that nothing tried explains it."""
    among = f"none of the {tried} effects that were tried" if tried > 1 else "nothing that was tried"
    worst = next(iter(still_off(diagnosis, method)), "")
    if not worst:
        return f"{among[0].upper()}{among[1:]} explains it."
    times, far = diagnosis.fit[worst].after / diagnosis.fit[worst].floor, method.reporting.far_off
    return f"{worst} is off by {f'{times:.0f}' if times < far else f'more than {far:.0f}'} times its noise, and {among} explains that."


def _nothing_else(diagnosis: Diagnosis, tried: int) -> str:
    """Return that no effect predicts better than chance, or which one does and yet was left out."""
    effects = sum(one.kind == "effect" for one in diagnosis.explanations)
    if not tried:
        return f"None of {effects} effects promises more than chance, so none was fitted." if effects else ""
    rivals = [one for one in diagnosis.explanations if one.kind == "effect" and not one.kept and one.is_clear]
    if not rivals:
        return f"None of the {tried} effects that were tried predicts clearly better than chance would."
    best = max(rivals, key=lambda one: one.gain)
    return f"Of the {tried} effects that were tried {best.text} predicts best, and is not taken: {best.reason}."


def _sure_of_names(diagnosis: Diagnosis, tried: int, method: Method) -> str:
    """Return how probable the names are among what was tried, and how the next best stands."""
    finds = found_effects(diagnosis) or list(diagnosis.effects)
    least = min((effect.probability for effect in finds), default=math.nan)
    said = f"{probability_text(least)} probable" + (f", among the {tried} effects that were tried" if tried > 1 else "")
    tied = list(dict.fromkeys(name for effect in finds for name in effect.tied_with))
    if tied:
        first = next(effect for effect in finds if effect.tied_with)
        return f"{said}; this recording cannot tell {first.effect} from {listed(tied)}."
    names = [f"{effect.effect} at {effect.at}" for effect in finds]
    behind = [(gap, runner) for name, runner, gap in diagnosis.evidence.runners_up if name in names and math.isfinite(gap)]
    if not behind:
        return f"{said}."
    gap, runner = min(behind)
    limits = method.reporting
    worse = "as well" if gap < limits.predicts_as_well else "slightly worse" if gap < limits.clearly_worse else "clearly worse"
    return f"{said}; the next best, {runner}, predicts the held-out data {worse}."


def _compared(diagnosis: Diagnosis, method: Method) -> str:
    """Return how far off the channels are before and after on the recording that judges; where one is worse, that comes first."""
    if not diagnosis.fit:
        return ""
    sized = {name: item for name, item in diagnosis.fit.items() if item.after > 0.0 and item.before > 0.0}
    change = {name: abs(math.log(item.after / item.before)) for name, item in sized.items()}
    worst = still_off(diagnosis, method)[:1]
    order = sorted(diagnosis.fit, key=lambda name: (name not in worst, -change.get(name, 0.0)))
    shown = [name for place, name in enumerate(order) if place < method.reporting.most_named or is_worse(diagnosis, name)]
    told = "; ".join(_before_after(diagnosis, name, method) for name in shown)
    judged = diagnosis.validation or "the recording that judges"
    seen = "not fitted" if judged != diagnosis.recording else "fitted too"
    changed = ", lesson alone -> with this" if diagnosis.effects else ", lesson as given -> values fitted"
    return f"error of the whole simulation on {judged} ({seen}){changed if '->' in told else ''}: {told}."


def is_worse(diagnosis: Diagnosis, name: str) -> bool:
    """Return whether a channel is further off after than before, in the digits that are shown."""
    item = diagnosis.fit[name]
    return item.after > item.before and _shown(item.after, item.unit) != _shown(item.before, item.unit)


def is_clearly_worse(diagnosis: Diagnosis, name: str, method: Method) -> bool:
    """Return whether a channel is further off after than before by more than next to nothing."""
    item = diagnosis.fit[name]
    return is_worse(diagnosis, name) and item.after > method.reporting.hardly_worse * item.before


def _before_after(diagnosis: Diagnosis, name: str, method: Method) -> str:
    item = diagnosis.fit[name]
    before, after = (_shown(value, item.unit) for value in (item.before, item.after))
    worse = ", slightly worse" if is_worse(diagnosis, name) else ""
    worse = ", WORSE" if is_clearly_worse(diagnosis, name, method) else worse
    return f"{name} {after}" if before == after else f"{name} {before} -> {after}{worse}"
