"""Sentences of an answer: values that would have to be impossible, what this recording could not tell, and the next step."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from lathesim.diagnosis.records.diagnosis import BaselineValue, Diagnosis, FoundEffect, with_unit
from lathesim.diagnosis.records.shown import Shown
from lathesim.engine.assembly import FloatArray
from lathesim.errors import listed
from lathesim.identification.records import Fitted
from lathesim.identification.replay.experiment import POSSIBLE


def not_shown(fitted: Fitted, uncertain: Mapping[str, float], floors: FloatArray) -> list[str]:
    """Return which ``uncertain`` values (name -> deviation) move no channel by a hundredth of its floor, even as far off as possible."""
    found = []
    for name, slope in zip(fitted.names, fitted.sensitivity if fitted.sensitivity is not None else (), strict=False):
        if name in uncertain and not np.any(np.abs(slope) * POSSIBLE * uncertain[name] > Shown.hardly_shown * floors[:, None]):
            found.append(f"{name} moves no compared channel, so these recordings cannot check it.")
    return found


def value_instead(names: tuple[str, ...], baseline: Mapping[str, BaselineValue], *, whole: bool) -> list[str]:
    """Return which value explains the recordings by itself, or takes a part of it away where it does not do the ``whole``."""
    if not names:
        return []
    item = baseline[names[0]]
    off = f" ({item.refit_with / item.given - 1.0:+.0%})" if item.given else ""
    does = "explains the error by itself" if whole else "explains a part of the error"
    told = f"{names[0]} of {with_unit(f'{item.refit_with:.4g}', item.unit)}{off} {does}, though the lesson declares it impossible"
    return [f"{told}. Measure it, and give its uncertainty in the lesson."]


def at_their_bounds(names: Sequence[str]) -> list[str]:
    """Return that values of the lesson end where it holds no other ones possible, if any do."""
    if not names:
        return []
    ends, them = ("ends", "it") if len(names) == 1 else ("end", "them")
    return [f"{listed(list(names))} {ends} at the limit of the declared uncertainty: something that acts like {them} may be missing too."]


def not_determined(effects: tuple[FoundEffect, ...]) -> tuple[str, ...]:
    """Return which names and values a recording leaves open, with what the lines to paste hold; the experiment that would tell more of the
    first such effect is the next step, those of the others stand here."""
    sentences, experiments = [], []
    for effect in effects:
        if effect.tied_with:
            name = f"{effect.effect} at {effect.at}" if any(" at " in other for other in effect.tied_with) else effect.effect
            sentences.append(f"The lines to paste use {name}; {' or '.join(effect.tied_with)} would fit as well.")
        pasted = [name for name in effect.sizes.undetermined if name not in effect.sizes.left_out]
        several = "a set of values that fits" if len(pasted) > 1 else "one value that fits"
        for names, done in ((effect.sizes.left_out, "leave that part of it out"), (pasted, f"hold {several}")):
            if names:
                named = listed([name.replace("_", " ") for name in names])
                sentences.append(f"This recording does not determine {named} of {effect.effect}; the lines to paste {done}.")
        if effect.separating_experiment:
            experiments.append(f"To determine {effect.effect}: {effect.separating_experiment}")
    return (*sentences, *experiments[1:])


def not_answered(diagnosis: Diagnosis) -> list[str]:
    """Return which effects recordings do not show, those with one reason in one sentence; those that are tied, or that one recording alone
    shows, are named as such."""
    tied = {name for effect in diagnosis.effects for name in effect.tied_with}
    names: dict[str, list[tuple[str, str]]] = {}
    for one in diagnosis.rest.unanswerable:
        if (one.effect, one.at) not in untested(diagnosis) and not tied & {one.effect, f"{one.effect} at {one.at}"}:
            names.setdefault(one.why, []).append((one.effect, one.at))
    return [f"These would not stand out at any size: {with_places(some)}. Reason: {why}." for why, some in names.items()]


def with_places(pairs: Iterable[tuple[str, str]]) -> str:
    """Return names with their places, each place once: ``"A and B at x_axis and C at x_drive"``."""
    by_place: dict[str, list[str]] = {}
    for name, place in pairs:
        by_place.setdefault(place, []).append(name)
    return listed([f"{listed(names)} at {place}" for place, names in by_place.items()])


def next_step(diagnosis: Diagnosis, worse: Sequence[str], values: Sequence[str], *, needed: bool, off: bool) -> str:
    """Return the next step.

    ``worse`` are the channels that the answer predicts worse than the lesson alone, ``values`` those of the lesson that moved, ``needed``
    says whether it takes these, and ``off`` whether a channel stays off.
    """
    if not diagnosis.complete:
        return "Give the search more time (--at-most), and ask again."
    if diagnosis.verdict == "recording_fault":
        return "Correct the recording, or its columns in the lesson, and diagnose again."
    if worse and diagnosis.verdict != "unknown":
        return f"Do not rely on it yet: it predicts {listed(list(worse))} worse. {_record_more(diagnosis)}"
    if diagnosis.names:
        return _after_names(diagnosis, off=off)
    if diagnosis.verdict == "unknown":
        return _after_unknown(diagnosis)
    return _after_values(diagnosis, values, needed=needed, off=off)


def _after_values(diagnosis: Diagnosis, values: Sequence[str], *, needed: bool, off: bool) -> str:
    measure = f"Measure {listed(values) if 0 < len(values) <= Shown.most_named else 'these values'}"
    if off or untested(diagnosis):
        easiest = diagnosis.rest.easiest
        log_too = [f"Log {easiest} too: of the signals that would show more, it is the easiest to log."] if easiest and off else []
        return " ".join([*([f"{measure}."] if values else []), _record_more(diagnosis), *log_too])
    if needed:
        return f"{measure}, and correct {'it' if len(values) == 1 else 'them'} in the lesson."
    return f"{measure if values else 'Nothing'}: the lesson may be used as it is, for motions like these."


def _after_names(diagnosis: Diagnosis, *, off: bool) -> str:
    if diagnosis.question.is_one_stroke:
        return "Record the stroke a second time, and give that recording with --validate."
    ordered = sorted(diagnosis.effects, key=lambda effect: effect.sizes.may_be_zero)
    open_ = next((effect for effect in ordered if effect.separating_experiment), None)
    if open_ is not None and open_.tied_with:
        return f"To tell {open_.effect} from {listed(list(open_.tied_with))}: {open_.separating_experiment}"
    if open_ is not None:
        return f"To determine {open_.effect}: {open_.separating_experiment}"
    paste = "Paste the lines below into the lesson"
    return (
        f"{paste}."
        if diagnosis.rest.adequate and not off
        else f"{paste}, and see with lathesim compare when the remaining error is largest."
    )


def untested(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Return the effects, with their places, that fit the first recording clearly better and that the one which judges does not show."""
    return [(one.name, one.place) for one in diagnosis.search.explanations if one.is_untested]


def _record_more(diagnosis: Diagnosis) -> str:
    if names := untested(diagnosis):
        return f"Validate with a recording that reaches {with_places(names)}, as {diagnosis.question.recording} does."
    if diagnosis.question.judges_itself:
        return "Make a second recording, longer and at more speeds, and give it with --validate."
    return "Record more motion: longer, at other speeds and places."


def _after_unknown(diagnosis: Diagnosis) -> str:
    if diagnosis.rest.discovered:
        return "Try the formula below. A report comes with discovered_term.py, a plug-in that holds it as an effect."
    at = f" at {diagnosis.location.components[0]}" if diagnosis.location.components else ""
    return f"See with lathesim compare when the error is largest, and measure the force or position{at} then."
