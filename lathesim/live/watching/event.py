"""What a watch tells."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lathesim.live.watching.background_diagnosis import Verdict
from lathesim.live.watching.known_effects import KnownEffect


@dataclass(frozen=True)
class WatchEvent:
    """Something to tell: ``kind`` (learnt, change, drift, recording, values, range, verdict, continued, growth, forecast, end), ``time``
    [s], a sentence, and the same as plain data."""

    kind: str
    time: float
    sentence: str
    data: Mapping[str, Any]


NAMING = ("named", "tied")
"""Verdicts that hold effects."""


def told_verdict(verdict: Verdict, begin: float, grown: Sequence[KnownEffect], place: Path, before: Collection[str] = ()) -> WatchEvent:
    """Return the event of a verdict on the window from ``begin`` [s].

    ``grown`` is what was known before and has grown, ``place`` where the answer is, ``before`` the values that the laps before have shown.
    """
    if verdict.failure:
        return WatchEvent("verdict", begin, f"The diagnosis from t = {begin:.1f} s: {verdict.failure}", {"verdict": "failed"})
    answer = verdict.answer
    named = [f"{effect} at {at}" for effect, at in verdict.effects]
    sizes = [_sizes(entry) for entry in answer.get("effects", [])]
    data = {"since_s": begin, "answer": str(place), "verdict": answer.get("verdict"), "effects": answer.get("effects", [])}
    if grown:
        known = [effect.name for effect in grown]
        new = "".join(
            f"; new is {name}: {size}" for name, size in zip(named, sizes, strict=True) if name not in known
        )  # fmt: skip
        course = "; ".join(f"{effect.name} has grown: {effect.course()}" for effect in grown)
        return WatchEvent("growth", begin, f"From t = {begin:.1f} s: {course}{new}.", {**data, "grown": known})
    moved = _moved_values(answer, before) if answer.get("verdict") == "parameters_only" else {}
    if moved:
        data["moved"] = moved
    told = {
        "named": f"{', '.join(named)}: {'; '.join(sizes)}",
        "tied": f"{' or '.join(named)}; the window cannot tell which",
        "unknown": "physics outside the catalogue, or too little to name",
        "no_mismatch": "nothing that the window shows",
        "parameters_only": "; ".join(map(_moved, moved.items())) or "values of the lesson are off",
        "recording_fault": "the recording is at fault",
    }.get(str(answer.get("verdict")), str(answer.get("verdict")))
    return WatchEvent("verdict", begin, f"From t = {begin:.1f} s: {told}.", data)


def _sizes(entry: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {item['value']:.4g} {item['unit']}" for name, item in entry.get("parameters", {}).items())


def _moved_values(answer: Mapping[str, Any], before: Collection[str]) -> dict[str, dict[str, Any]]:
    """Return the values whose interval does not hold what was known of them ``before`` the change."""
    return {
        str(name): {"from": item["given"], "to": item["refit_with"], "unit": item["unit"]}
        for name, item in answer.get("baseline", {}).items()
        if name in before and not item["low"] <= item["given"] <= item["high"]
    }


def _moved(value: tuple[str, Mapping[str, Any]]) -> str:
    name, item = value
    return f"{name} has moved from {item['from']:.4g} to {item['to']:.4g} {item['unit']}".removesuffix(" 1")
