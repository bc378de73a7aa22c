"""The answer of a diagnosis as lines of text for a person at a terminal: what, how sure, where, how much better, what is left."""

from __future__ import annotations

import math
from collections.abc import Sequence

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.records.diagnosis import Diagnosis, FoundEffect, listed, with_unit
from lathesim.diagnosis.reporting.html_report import insert_lines
from lathesim.diagnosis.reporting.number_text import POSSIBLE_BESIDES, takes_part
from lathesim.diagnosis.reporting.stability_text import stability_lines


def answer_lines(diagnosis: Diagnosis) -> list[str]:
    """Return the lines of an answer."""
    lines = [f"Recording: {line}" for line in diagnosis.findings]
    lines += ["", diagnosis.sentence]
    if diagnosis.shortfall:
        lines.append(diagnosis.shortfall)
    if diagnosis.effects:
        lines += ["", *([] if diagnosis.names else [f"{takes_part(diagnosis)}:"])]
        lines += [line for effect in diagnosis.effects for line in _effect_lines(effect, diagnosis)]
    lines += _possible_lines(diagnosis)
    lines += ["", *_where_lines(diagnosis), *stability_lines(diagnosis)]
    if diagnosis.verdict == "parameters_only":
        lines += _value_lines(diagnosis)
    for name, channel in diagnosis.fit.items():
        sizes = [shown_with_unit(value, channel.unit) for value in (channel.before, channel.after, channel.floor)]
        lines.append(f"{name} on {channel.recording}: off by {sizes[0]} before, {sizes[1]} after (floor {sizes[2]})")
    lines += [*diagnosis.left, *diagnosis.not_told]
    if diagnosis.discovered:
        lines.append(f"A formula for what is left: {diagnosis.discovered}")
    if diagnosis.insert:
        lines += ["", "Paste into the lesson:", insert_lines(diagnosis.insert)]
        lines += _beside(diagnosis)
    if not diagnosis.complete:
        lines.append("The search was stopped; this is what was known until then.")
        lines += [f"Not tried: {_first_of(diagnosis.untried)}. Give it more time, and ask again."] * bool(diagnosis.untried)
    return lines


def _first_of(names: Sequence[str]) -> str:
    """Return the first names of a list, and how many more there are."""
    more = names[6:]
    return ", ".join(names[:6]) + (f" and {len(more)} more" if more else "")


def _where_lines(diagnosis: Diagnosis) -> list[str]:
    """Return the line on where physics is missing, where any is."""
    if not diagnosis.location.components or diagnosis.verdict in ("no_mismatch", "parameters_only"):
        return []
    depends = f"; it depends on {', '.join(diagnosis.location.variables)}" if diagnosis.location.variables else ""
    return [f"Where: {', '.join(diagnosis.location.components)}{depends}"]


def _value_lines(diagnosis: Diagnosis) -> list[str]:
    """Return a line for each value of the lesson, as fitted and as given."""
    lines = []
    for name, value in diagnosis.baseline.items():
        interval = f"95 %: {value.low:.5g} to {value.high:.5g}"
        lines.append(f"  {name} = {with_unit(f'{value.refit_with:.5g}', value.unit)}  (given {value.given:.5g}, {interval})")
    return lines


def _beside(diagnosis: Diagnosis) -> list[str]:
    """Report which values of the lesson are others beside what is to be pasted: without them it leaves more."""
    moved = [(name, item) for name, item in diagnosis.baseline.items() if not item.low <= item.given <= item.high]
    told = [f"{name} = {with_unit(f'{item.refit_with:.4g}', item.unit)} (given {item.given:.4g})" for name, item in moved]
    return [f"That is with {', '.join(told)}, as in lesson_explained.yaml."] if told else []


def _effect_lines(effect: FoundEffect, diagnosis: Diagnosis) -> list[str]:
    # what is no name explains no more than all effects together do where they are judged
    share = effect.share if diagnosis.names else min(effect.share, max(0.0, diagnosis.removed_share))
    # what is read off the recorded values takes no part of the error
    taken = f"{share:.0%} of the error" if math.isfinite(effect.share) else "read off the recorded values"
    said = [f"probability {effect.probability:.2f}", taken] if diagnosis.names else [taken] if diagnosis.removed_share > 0.0 else []
    return [f"  {effect.effect} at {effect.at}  ({', '.join([effect.family, *said])})", *_parameter_lines(effect)]


def _possible_lines(diagnosis: Diagnosis) -> list[str]:
    """Return the lines on what is possible beside the model."""
    lines = ["", f"{POSSIBLE_BESIDES}:"] if diagnosis.possible else []
    for one in diagnosis.possible:
        effect = one.effect
        place = f" in the place of {listed(one.in_place_of)}" if one.in_place_of else ""
        shares = f"{effect.removes:.0%} of what is left, {effect.share:.1%} of the error"
        lines.append(f"  {effect.effect} at {effect.at}{place}  ({effect.family}, probability {effect.probability:.2f}, {shares})")
        lines += _parameter_lines(effect)
    return lines


def _parameter_lines(effect: FoundEffect) -> list[str]:
    """Return a line for each parameter of an effect, with its interval."""
    lines = []
    for name, item in effect.parameters.items():
        doubt = "; not determined" if name in effect.undetermined else ""
        value, low, high = _told_apart(item.value, item.low, item.high)
        lines.append(f"    {name} = {with_unit(value, item.unit)}  (95 %: {low} to {high}{doubt})")
    return lines


def _told_apart(*values: float) -> list[str]:
    """Return numbers with four digits, or as many as it takes to tell them apart: 0.0069999 to 0.0070001 and not 0.007 to 0.007."""
    for digits in range(4, 12):
        texts = [f"{value:.{digits}g}" for value in values]
        if len(set(texts)) == len(set(values)):
            return texts
    return [f"{value:.4g}" for value in values]
