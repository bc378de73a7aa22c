"""Sentences of an answer: what is still missing, which values would have to be impossible, what this recording could not tell."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence

import numpy as np

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import (
    BaselineValue,
    Diagnosis,
    Evidence,
    FoundEffect,
    MissingSignal,
    PossibleEffect,
    listed,
    with_unit,
)
from lathesim.diagnosis.records.search import SearchResult
from lathesim.diagnosis.reporting.number_text import percent
from lathesim.diagnosis.selection.compare_models import Gains, compare_models
from lathesim.diagnosis.verdict.ranking import RankedEffect
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import POSSIBLE

_PATHS = ("m", "rad")


def still_missing(
    evidence: Evidence, variables: tuple[str, ...], found: SearchResult, possible: Sequence[PossibleEffect], method: Method
) -> tuple[str, ...]:
    """Return what is still missing, where, and what it depends on; what is ``possible`` besides is told by itself."""
    # of a position micrometres are missing, and a share of it says nothing
    shares = [max(item.share_before, item.share_after) >= method.reporting.remark_share for item in evidence.missing]
    pairs = zip(evidence.missing, shares, strict=True)
    sentences = [_one_missing(item, shares=told) for item, told in pairs if told or item.unit in _PATHS]
    if variables:
        sentences.append(f"What is left depends on {', '.join(variables[:3])}.")
    elif (
        max((item.share_after for item in evidence.missing if np.isfinite(item.share_after)), default=0.0)
        > method.reporting.remark_unexplained
    ):
        sentences.append("What is left goes with nothing that the machine was doing: noise, or a load that nobody measured.")
    if found.ended_after:
        sentences.append(f"The search ended after {found.ended_after} simulations: a further effect was not looked for.")
    earlier = {trial.candidate.part: trial.candidate for trial in found.tried if trial.candidate.part in found.there_before}
    sentences += [f"{one.name} at {one.at} explains as much of the recording from before the change." for one in earlier.values()]
    sentences += _too_little(found, {(one.effect.effect, one.effect.at) for one in possible}, method)
    return tuple(dict.fromkeys(sentences))


def _too_little(found: SearchResult, apart: Container[tuple[str, str]], method: Method) -> Iterator[str]:
    """Yield which effects would explain much of what is left and little of all; those that are told ``apart`` are none of them."""
    for trial in found.tried:
        gains, little = Gains(trial.gain, trial.validation_gain), trial.share_of_all <= method.share_of_all
        worth = little and trial.share_of_all > method.reporting.remark_share and trial.share_of_rest > method.share_of_rest
        alone = found.complete and found.was_held_against(trial) and (trial.candidate.name, trial.candidate.at) not in apart
        if worth and alone and compare_models(gains, method, effects=1).better:
            shares = f"{trial.share_of_rest:.0%} of what is left, but only {trial.share_of_all:.1%} of the whole error"
            yield f"{trial.candidate.name} at {trial.candidate.at} would explain {shares}: too little to name it."


def _one_missing(item: MissingSignal, *, shares: bool) -> str:
    """Return how much is missing at a place, now and before, and which ``shares`` of what acts there that is."""
    sizes = [shown_with_unit(size, item.unit, 3) for size in item.sizes]
    known = [share if shares else math.nan for share in (item.share_before, item.share_after)]
    before, after = (
        f"{size} ({percent(share)} of what acts there)" if share < 1.0 else size for size, share in zip(sizes, known, strict=True)
    )
    earlier = f"; before it was {before}" if before != after else ""
    return f"At {item.at} {after} has no explanation{earlier}."


def implausible_values(implausible: tuple[str, ...], baseline: Mapping[str, BaselineValue]) -> list[str]:
    """Return which values would have to be further off than the lesson holds possible."""
    sentences = []
    for name in implausible:
        item = baseline[name]
        off = f" ({item.refit_with / item.given - 1.0:+.0%})" if item.given else ""
        sentences.append(
            f"{name} would have to be {with_unit(f'{item.refit_with:.4g}', item.unit)}{off}, further off than the lesson holds possible."
        )
    return sentences


def not_shown(fitted: Fitted, uncertain: Mapping[str, float], floors: FloatArray, method: Method = STANDARD) -> list[str]:
    """Return which ``uncertain`` values (name -> standard deviation) move no channel by a hundredth of its floor (channels,), even as far
    off as possible."""
    found = []
    for name, slope in zip(fitted.names, fitted.sensitivity if fitted.sensitivity is not None else (), strict=False):
        if name in uncertain and not np.any(np.abs(slope) * POSSIBLE * uncertain[name] > method.reporting.hardly_shown * floors[:, None]):
            found.append(f"{name} moves nothing that is compared: whether it is another one, these recordings cannot tell.")
    return found


def value_instead(names: tuple[str, ...], baseline: Mapping[str, BaselineValue], factor: str = "", *, whole: bool) -> list[str]:
    """Return which value explains the recordings by itself, or takes a part of it away where it does not do the ``whole``, and which others
    would as well, or a reading that is off by a ``factor``."""
    if not names:
        return []
    item = baseline[names[0]]
    off = f" ({item.refit_with / item.given - 1.0:+.0%})" if item.given else ""
    does = "explains by itself what is missing" if whole else "takes away a part of what is missing, and not the whole"
    told = f"{names[0]} of {with_unit(f'{item.refit_with:.4g}', item.unit)}{off} {does}, though the lesson holds it impossible"
    others = f"; so would another value of {' or of '.join(names[1:])}" if len(names) > 1 else ""
    read = f"; so would a reading of {factor}" if factor else ""
    return [f"{told}{others}{read}. Measure it, and say in the lesson how sure it is."]


def not_determined(effects: tuple[FoundEffect, ...]) -> tuple[str, ...]:
    """Return what a recording cannot tell apart and which values it leaves open, with the experiment that would."""
    sentences = []
    for effect in effects:
        if effect.tied_with:
            # the same effect at the other of two sensors is told by where it is
            name = f"{effect.effect} at {effect.at}" if any(" at " in other for other in effect.tied_with) else effect.effect
            fact = f"{name} cannot be told from {', '.join(effect.tied_with)} here; the lines to paste hold {name}."
            sentences.append(f"{fact} {effect.separating_experiment or ''}".strip())
        pasted = [name for name in effect.undetermined if name not in effect.left_out]
        several = "a set of values that fits" if len(pasted) > 1 else "one value that fits"
        for names, done in ((effect.left_out, "leave that part of it out"), (pasted, f"hold {several}")):
            if names:
                verb = "is" if len(names) == 1 else "are"
                fact = f"{listed(names)} of {effect.effect} {verb} not determined by this recording; the lines to paste {done}."
                sentences.append(f"{fact} {effect.separating_experiment or ''}".strip())
    return tuple(sentences)


def unseen_forms(ranked: Iterable[RankedEffect]) -> list[str]:
    """Return which refined forms of what is named the recording could not have shown; no experiment is advised for a form of one law."""
    pairs = [(item.candidate, other) for item in ranked for other in item.unseen]
    return [f"Whether {candidate.name} is {other.name} this recording cannot tell." for candidate, other in pairs]


def what_is_left(diagnosis: Diagnosis) -> list[str]:
    """Return why a model is not adequate, where it is not, and all that is left."""
    return [*filter(None, [diagnosis.shortfall]), *diagnosis.left]


def stability_lines(diagnosis: Diagnosis) -> list[str]:
    """Return the line on how often the decision stands under other draws of noise and limits, and on which limit it depends most."""
    found = diagnosis.stability
    if found is None:
        return []
    verdict = diagnosis.verdict.replace("_", " ")
    others = [f"{name.replace('_', ' ')} in {share:.0%}" for name, share in found.outcomes.items() if name != diagnosis.verdict]
    turned = f" ({', '.join(others)})" if others else ""
    hinges = f" It depends most on the limit {', '.join(found.hinges_on)}." if found.hinges_on else ""
    again = f"Decided {found.decisions} times with noise and limits drawn again"
    return [f"{again}, the answer is '{verdict}' in {found.share:.0%}{turned}.{hinges}"]
