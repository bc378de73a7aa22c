"""A diagnosis as its JSON tells it (schema lathesim-diagnosis/1), and what may be claimed from it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lathesim.errors import LessonError
from lathesim.json_text import parsed_json

SCHEMA = "lathesim-diagnosis/1"
_NOTHING_TO_MEND = {
    "no_mismatch": "The simulation explains the recording as it is: there is nothing to mend.",
    "parameters_only": "No physics is missing, only values are off: correct them in the lesson, there is nothing to mend.",
    "unknown": "The diagnosis names no effect, so no remedy follows from it. Run the experiment that it asks for.",
    "recording_fault": "The recording is at fault, not the machine: mend the recording first.",
}
"""Verdict -> why no remedy follows."""


@dataclass(frozen=True)
class NamedEffect:
    """An effect of a diagnosis: where it is, its values with their 95 % intervals [unit of the file], and what it is tied with."""

    effect: str
    at: str
    parameters: Mapping[str, tuple[float, float, float]]
    entry: Mapping[str, str]
    tied_with: tuple[str, ...]


@dataclass(frozen=True)
class DiagnosedMachine:
    """A diagnosis: its verdict, the named effects, the refitted values of the lesson with their intervals, and what it may not claim."""

    verdict: str
    effects: tuple[NamedEffect, ...]
    baseline: Mapping[str, tuple[float, float, float, str]]
    cautions: tuple[str, ...]
    nothing: str
    floors: Mapping[str, float] = field(default_factory=dict)
    """What each compared channel cannot resolve: noise and rounding together, one standard deviation [SI]."""


def read_diagnosis(file: Path) -> DiagnosedMachine:
    """Read a diagnosis; :class:`LessonError` where the file is none."""
    data = _data(file)
    verdict = str(data.get("verdict", ""))
    kinds: tuple[tuple[str, type, str], ...] = (("insert", list, "list"), ("effects", list, "list"), ("baseline", dict, "table"))
    for name, kind, told in kinds:
        if data.get(name) and not isinstance(data[name], kind):
            raise LessonError(f"'{name}' of the diagnosis is no {told}.", place=str(file), remedy="Give the file as diagnose wrote it.")
    entries = [dict(entry) for entry in data.get("insert") or [] if isinstance(entry, dict)]
    named = []
    nothing = _NOTHING_TO_MEND.get(verdict, "")
    # what an unknown verdict only suspects has no line to insert
    for item in data.get("effects") or [] if not nothing else ():
        if not isinstance(item, dict) or not isinstance(item.get("effect"), str) or not isinstance(item.get("at"), str):
            raise LessonError(
                "an effect of the diagnosis has no name or place.", place=str(file), remedy="Give the file as diagnose wrote it."
            )
        entry = next((line for line in entries if line.get("effect") == item["effect"] and line.get("at") == item["at"]), None)
        if entry is None:
            raise LessonError(f"the diagnosis has no line to insert for {item['effect']}.", place=str(file))
        known = item.get("parameters")
        values = {name: _interval(value, file) for name, value in (known if isinstance(known, dict) else {}).items()}
        named.append(
            NamedEffect(
                item["effect"], item["at"], values, {key: str(value) for key, value in entry.items()}, tuple(item.get("tied_with") or ())
            )
        )
    baseline = {str(name): _value(value) for name, value in dict(data.get("baseline") or {}).items() if _value(value) is not None}
    if not nothing and not named:
        nothing = "The diagnosis names no effect, so no remedy follows from it."
    return DiagnosedMachine(verdict, tuple(named), baseline, _cautions(verdict, data, named), nothing, _floors(data))  # type: ignore[arg-type]


def _floors(data: Mapping[str, Any]) -> dict[str, float]:
    fit = data.get("fit")
    items = fit.items() if isinstance(fit, dict) else ()
    return {
        str(name): float(item["floor"]) for name, item in items if isinstance(item, dict) and isinstance(item.get("floor"), (int, float))
    }


def _data(file: Path) -> dict[str, Any]:
    try:
        data = parsed_json(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise LessonError(f"the diagnosis cannot be read: {error.strerror}.", place=str(file)) from None
    except ValueError:
        raise LessonError("the diagnosis is no JSON file.", place=str(file), remedy="Write it with 'diagnose --json FILE'.") from None
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        found = data.get("schema") if isinstance(data, dict) else None
        told = f"has the schema '{found}'" if isinstance(found, str) else "has no schema"
        raise LessonError(
            f"the file {told}, and a diagnosis has {SCHEMA}.", place=str(file), remedy="Write it with 'diagnose --json FILE'."
        )
    return data


def _interval(value: Any, file: Path) -> tuple[float, float, float]:
    if not isinstance(value, dict) or not isinstance(value.get("value"), (int, float)) or not math.isfinite(value["value"]):
        raise LessonError("a value of the diagnosis is no number.", place=str(file), remedy="Give the file as diagnose wrote it.")
    number = float(value["value"])
    low, high = (value.get(name) for name in ("low", "high"))
    ends = [float(end) if isinstance(end, (int, float)) and math.isfinite(end) else number for end in (low, high)]
    return number, min(*ends, number), max(*ends, number)


def _value(value: Any) -> tuple[float, float, float, str] | None:
    if not isinstance(value, dict) or not isinstance(value.get("refit_with"), (int, float)):
        return None
    number = float(value["refit_with"])
    if not math.isfinite(number):
        return None
    low, high = (value.get(name) for name in ("low", "high"))
    known = isinstance(low, (int, float)) and isinstance(high, (int, float)) and math.isfinite(low) and math.isfinite(high)
    return number, float(low) if known else number, float(high) if known else number, str(value.get("unit", "1"))  # type: ignore[arg-type]


def _cautions(verdict: str, data: Mapping[str, Any], named: list[NamedEffect]) -> tuple[str, ...]:
    found = []
    if verdict == "tied" or any(item.tied_with for item in named):
        others = ", ".join(sorted({name for item in named for name in item.tied_with}))
        told = f" (it may be {others} instead)" if others else ""
        found.append(f"The diagnosis is tied{told}: the remedy may claim the better fit on this recording, and no cause.")
    if data.get("adequate") is False:
        found.append("The diagnosis does not explain all of the recording: the remedy may claim what was named, and nothing of the rest.")
    return tuple(found)
