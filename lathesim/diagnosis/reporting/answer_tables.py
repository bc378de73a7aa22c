"""The tables under the six lines: effects with their sizes, values of the lesson, channels before and after."""

from __future__ import annotations

import math

from lathesim.diagnosis.records.diagnosis import Diagnosis, Interval
from lathesim.diagnosis.reporting.number_text import NOT_DETERMINED, NOTHING, interval_texts, probability_text, quantity_text
from lathesim.diagnosis.reporting.summary import is_worse

Rows = list[tuple[str, ...]]


def effect_rows(diagnosis: Diagnosis) -> Rows:
    """Return effect, place, size with interval and probability, a row for each size; an effect that may be zero has no probability."""
    rows: Rows = []
    for effect in diagnosis.effects:
        sizes = [(name, item_text(item, name in effect.sizes.undetermined)) for name, item in effect.parameters.items()]
        sizes += [(name, item_text(item, undetermined=False)) for name, item in effect.sizes.products.items()]
        for place, (name, text) in enumerate(sizes or [("", NOTHING)]):
            at = f"{effect.at}, at {effect.before}" if effect.before else effect.at
            first = (effect.effect, at) if place == 0 else ("", "")
            sure = NOTHING if effect.sizes.may_be_zero else probability_text(effect.probability)
            rows.append((*first, f"{name.replace('_', ' ')} {text}".strip(), sure if place == 0 else ""))
    return rows


def before_text(diagnosis: Diagnosis) -> str:
    """Return what "before" and "noise" mean in the table of channels."""
    lesson = (
        "the lesson with nothing inserted, its uncertain values fitted, or as given where these leave less"
        if diagnosis.effects
        else "the lesson as it is given"
    )
    return f"Before: {lesson}. Noise: rounding and noise of the recording."


def item_text(item: Interval, undetermined: bool) -> str:
    """Return a size with its interval: ``"20.4 N (20.2 to 20.6 N)"``."""
    value, interval = interval_texts(item.value, item.low, item.high, item.unit, item.ends)
    doubt = f", {NOT_DETERMINED}" if undetermined and interval != NOT_DETERMINED else ", may be zero" if item.low < 0.0 < item.high else ""
    return f"{value} ({interval}{doubt if math.isfinite(item.low + item.high) else ''})"


def channel_rows(diagnosis: Diagnosis) -> Rows:
    """Return channel, error before, after and its noise; where it got worse, the row says so."""
    rows: Rows = []
    for name, item in diagnosis.fit.items():
        before, after, noise = (quantity_text(value, item.unit, 3) for value in (item.before, item.after, item.floor))
        rows.append((name, before, f"{after} (worse)" if is_worse(diagnosis, name) else after, noise))
    return rows


def value_rows(diagnosis: Diagnosis) -> Rows:
    """Return each uncertain value of the lesson as given and as fitted, with its interval."""
    rows: Rows = []
    for name, item in diagnosis.baseline.items():
        value, interval = interval_texts(item.refit_with, item.low, item.high, item.unit, item.ends)
        rows.append((name, quantity_text(item.given, item.unit), value, interval))
    return rows
