"""Sentences of an answer: what is still missing, which values would have to be impossible, what this recording could not tell."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.diagnosis.records.diagnosis import (
    BaselineValue,
    FoundEffect,
    listed,
    with_unit,
)
from lathesim.engine.assembly import FloatArray
from lathesim.identification.records.fit import Fitted
from lathesim.identification.replay.experiment import POSSIBLE


def not_shown(fitted: Fitted, uncertain: Mapping[str, float], floors: FloatArray, method: Method = STANDARD) -> list[str]:
    """Return which ``uncertain`` values (name -> standard deviation) move no channel by a hundredth of its floor (channels,), even as far
    off as possible."""
    found = []
    for name, slope in zip(fitted.names, fitted.sensitivity if fitted.sensitivity is not None else (), strict=False):
        if name in uncertain and not np.any(np.abs(slope) * POSSIBLE * uncertain[name] > method.reporting.hardly_shown * floors[:, None]):
            found.append(f"{name} moves nothing that is compared: whether it is another one, these recordings cannot tell.")
    return found


def value_instead(names: tuple[str, ...], baseline: Mapping[str, BaselineValue], *, whole: bool) -> list[str]:
    """Return which value explains the recordings by itself, or takes a part of it away where it does not do the ``whole``, and which others
    would as well."""
    if not names:
        return []
    item = baseline[names[0]]
    off = f" ({item.refit_with / item.given - 1.0:+.0%})" if item.given else ""
    does = "explains by itself what is missing" if whole else "takes away a part of what is missing, and not the whole"
    told = f"{names[0]} of {with_unit(f'{item.refit_with:.4g}', item.unit)}{off} {does}, though the lesson holds it impossible"
    others = f"; so would another value of {' or of '.join(names[1:])}" if len(names) > 1 else ""
    return [f"{told}{others}. Measure it, and say in the lesson how sure it is."]


def not_determined(effects: tuple[FoundEffect, ...]) -> tuple[str, ...]:
    """Return which names and values a recording leaves open, with what the lines to paste hold; the experiment that would tell more of the
    first such effect is the next step, those of the others stand here."""
    sentences, experiments = [], []
    for effect in effects:
        if effect.tied_with:
            name = f"{effect.effect} at {effect.at}" if any(" at " in other for other in effect.tied_with) else effect.effect
            sentences.append(f"The lines to paste hold {name}, and not {' or '.join(effect.tied_with)}.")
        pasted = [name for name in effect.undetermined if name not in effect.left_out]
        several = "a set of values that fits" if len(pasted) > 1 else "one value that fits"
        for names, done in ((effect.left_out, "leave that part of it out"), (pasted, f"hold {several}")):
            if names:
                verb = "is" if len(names) == 1 else "are"
                named = listed([name.replace("_", " ") for name in names])
                sentences.append(f"{named} of {effect.effect} {verb} not determined by this recording; the lines to paste {done}.")
        if effect.separating_experiment:
            experiments.append(f"What would tell more of {effect.effect}: {effect.separating_experiment}")
    return (*sentences, *experiments[1:])
