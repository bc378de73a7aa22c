"""An opened answer as a person reads it: what was hidden, and how a diagnosis stands beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lathesim.diagnosis.records.diagnosis import with_unit
from lathesim.diagnosis.reporting.number_text import pretty_unit, quantity_text
from lathesim.exercises.grading import EffectGrade, GradedDiagnosis


def hidden_lines(answer: Mapping[str, Any]) -> list[str]:
    """Return what is hidden and which values the machine really has, a line each."""
    lines = []
    for item in answer["effects"]:
        sizes = [f"{name} = {quantity_text(size['value'], size['unit'])}" for name, size in item["parameters"].items()]
        lines.append(f"{item['effect']} at {item['at']} ({item['family']}): {', '.join(sizes)}")
    lines = lines or ["nothing"]
    for name, item in answer["true_values"].items():
        off = f" ({(item['true'] - item['given']) / abs(item['given']):+.1%})" if item["given"] else ""
        lines.append(f"{name} is {item['true']:.5g} {pretty_unit(item['unit'])}, given as {item['given']:.5g}{off}")
    return lines


def graded_lines(graded: GradedDiagnosis, within: float) -> list[str]:
    """Return how a diagnosis stands beside the truth, a line each; ``within`` is in per cent."""
    lines = []
    for item in graded.effects:
        lines.append(f"{item.effect} at {item.at}: {_naming(item)}")
        for name, size in item.sizes.items():
            held = "" if size.covered is None else ", its interval holds the truth" if size.covered else ", its interval misses the truth"
            verdict = f"within {within:g} %" if size.right else f"not within {within:g} %"
            off = f"off by {round(size.off, 3) + 0.0:.1%}"
            guess, true = (with_unit(f"{value:.4g}", size.unit) for value in (size.guess, size.true))
            lines.append(f"  {name}: {guess} for {true}, {off}, {verdict}{held}")
    lines += [f"{name} was named in vain" for name in graded.wrong_names]
    return lines


def _naming(item: EffectGrade) -> str:
    if item.named:
        first = "named first" if item.first else "named"
        return first if item.place else f"{first}, at another place"
    if item.tied:
        return "not named, but called tied"
    return "not named, but its family is right" if item.family else "not named"
