"""A diagnosis held against the answer: is the name right, the family, each size, and does its interval hold the truth?"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lathesim.analysis.display_unit import pretty_unit
from lathesim.diagnosis.records.diagnosis import SCHEMA, with_unit
from lathesim.diagnosis.reporting.number_text import quantity_text
from lathesim.errors import LatheSimError, RecordingError
from lathesim.json_text import read_json
from lathesim.units import same_dimension, si_factor

NOTHING_HIDDEN = ("no_mismatch", "parameters_only")
"""Verdicts that are right where nothing is hidden."""
WITHIN = 0.05
"""How far off a size may be to count as right, as a share of the true one."""


@dataclass(frozen=True)
class SizeGrade:
    """A parameter: true and guessed value [``unit``], how far off (a share), and whether the guess's interval holds the truth."""

    unit: str
    true: float
    guess: float
    off: float
    right: bool
    covered: bool | None


@dataclass(frozen=True)
class EffectGrade:
    """A hidden effect: named, named first, named in a tie, its family named, its host right, and its sizes."""

    effect: str
    at: str
    named: bool
    first: bool
    tied: bool
    family: bool
    place: bool
    sizes: Mapping[str, SizeGrade]


@dataclass(frozen=True)
class GradedDiagnosis:
    """A diagnosis graded: each hidden effect, names that are wrong, whether all is right, and that in a sentence."""

    effects: tuple[EffectGrade, ...]
    wrong_names: tuple[str, ...]
    right: bool
    sentence: str


def read_guess(path: Path) -> dict[str, Any]:
    """Read the JSON of a diagnosis; :class:`RecordingError` where it is none."""
    guess = read_json(path, SCHEMA, "diagnosis", "verdict")
    effects = guess.get("effects", [])
    if not isinstance(effects, list) or not all(_is_effect(item) for item in effects):
        raise RecordingError("the effects of the diagnosis are no list of effects with a name.", place=str(path))
    return {**guess, "effects": effects}


def _is_effect(item: object) -> bool:
    if not isinstance(item, dict) or not isinstance(item.get("effect"), str):
        return False
    tied = item.get("tied_with") or []
    return isinstance(item.get("parameters") or {}, dict) and isinstance(tied, list) and all(isinstance(name, str) for name in tied)


def grade(answer: Mapping[str, Any], guess: Mapping[str, Any], within: float = WITHIN) -> GradedDiagnosis:
    """Grade a diagnosis (JSON of schema ``lathesim-diagnosis/1``); sizes count as right ``within`` a share of the true ones.

    Parameters that belong to one recording (a phase) are not graded. A diagnosis that names where it says ``unknown`` is taken at its
    verdict: it named nothing.
    """
    guesses = [item for item in guess["effects"] if guess["verdict"] in ("named", "tied")]
    truths = answer["effects"]
    effects = tuple(_effect(truth, guesses, within) for truth in truths)
    true_names = {truth["effect"] for truth in truths}
    wrong = tuple(item["effect"] for item in guesses if not {item["effect"], *(item.get("tied_with") or ())} & true_names)
    if not truths:
        right = guess["verdict"] in NOTHING_HIDDEN
        sentence = "Right: nothing is hidden." if right else f"Nothing is hidden, and the verdict is '{guess['verdict']}'."
        return GradedDiagnosis((), wrong, right, sentence)
    named = sum(item.named for item in effects)
    right = named == len(effects) and not wrong
    return GradedDiagnosis(effects, wrong, right, _sentence(effects, wrong, named, right, str(guess["verdict"])))


def _effect(truth: Mapping[str, Any], guesses: Sequence[Mapping[str, Any]], within: float) -> EffectGrade:
    same = [item for item in guesses if item["effect"] == truth["effect"]]
    here = [item for item in same if item.get("at") == truth["at"]]
    best = next(iter([*here, *same]), None)
    return EffectGrade(
        truth["effect"],
        truth["at"],
        bool(same),
        bool(guesses) and guesses[0]["effect"] == truth["effect"],
        any(truth["effect"] in (item.get("tied_with") or ()) for item in guesses),
        any(item.get("family") == truth["family"] for item in guesses),
        bool(here),
        _sizes(truth, best, within) if best is not None else {},
    )


def _sizes(truth: Mapping[str, Any], guess: Mapping[str, Any], within: float) -> dict[str, SizeGrade]:
    found: dict[str, SizeGrade] = {}
    given = guess.get("parameters") or {}
    for name, item in truth["parameters"].items():
        told = given.get(name)
        if name in truth["nuisance"] or not isinstance(told, Mapping):
            continue
        factor = _factor(str(told.get("unit", item["unit"])), item["unit"])
        value, low, high = (_number(told.get(key)) * factor for key in ("value", "low", "high"))
        if not math.isfinite(value):
            continue
        true = float(item["value"])
        off = (value - true) / abs(true) if true else math.inf * (value != true)
        covered = low <= true <= high if math.isfinite(low) and math.isfinite(high) else None
        found[name] = SizeGrade(item["unit"], true, value, off, abs(off) <= within, covered)
    return found


def _number(value: object) -> float:
    return float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan


def _factor(given: str, wanted: str) -> float:
    """Return what one ``given`` unit is in ``wanted``; not a number where they measure different things."""
    if given == wanted:
        return 1.0
    try:
        return si_factor(given)[0] / si_factor(wanted)[0] if same_dimension(given, wanted) else math.nan
    except LatheSimError:
        return math.nan


def _sentence(effects: Sequence[EffectGrade], wrong: Sequence[str], named: int, right: bool, verdict: str) -> str:
    if right:
        return "Right: " + " and ".join(f"{item.effect} at {item.at}" for item in effects) + "."
    if not named:
        if any(item.tied for item in effects):
            return "Nearly: what is hidden is among those called tied."
        said = f"The verdict is '{verdict}', and" if not wrong else f"Named was {', '.join(wrong)}, and"
        return f"{said} hidden is {' and '.join(item.effect for item in effects)}."
    missed = [item.effect for item in effects if not item.named]
    parts = [f"{named} of {len(effects)} named"]
    parts += [f"not found: {', '.join(missed)}"] if missed else []
    parts += [f"named in vain: {', '.join(wrong)}"] if wrong else []
    return "; ".join(parts) + "."


def grade_json(graded: GradedDiagnosis) -> dict[str, Any]:
    """Return a grade as JSON of schema ``lathesim-grade/1``."""
    return {
        "schema": "lathesim-grade/1",
        "right": graded.right,
        "sentence": graded.sentence,
        "wrong_names": list(graded.wrong_names),
        "effects": [
            {
                "effect": item.effect, "at": item.at, "named": item.named, "first": item.first, "tied": item.tied, "family": item.family,
                "place": item.place,
                "parameters": {
                    name: {"unit": size.unit, "true": size.true, "guess": size.guess, "off": size.off if math.isfinite(size.off) else None,
                           "right": size.right, "covered": size.covered}
                    for name, size in item.sizes.items()
                },
            }
            for item in graded.effects
        ],
    }  # fmt: skip


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
