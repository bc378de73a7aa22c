"""What a verdict is called in the sentences of a watch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lathesim.live.watching.background_diagnosis import Verdict
from lathesim.live.watching.effects.known_effects import KnownEffect
from lathesim.live.watching.event import Event

NAMING = ("named", "tied")
"""Verdicts that hold effects."""


def told_verdict(verdict: Verdict, begin: float, grown: Sequence[KnownEffect], place: Path) -> Event:
    """Return the event of a verdict on the window from ``begin`` [s]; ``grown`` is what was known before, ``place`` where the answer is."""
    if verdict.failure:
        return Event("verdict", begin, f"The diagnosis from t = {begin:.1f} s: {verdict.failure}", {"verdict": "failed"})
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
        return Event("growth", begin, f"From t = {begin:.1f} s: {course}{new}.", {**data, "grown": known})
    told = {
        "named": f"{', '.join(named)}: {'; '.join(sizes)}",
        "tied": f"{' or '.join(named)}; the window cannot tell which",
        "unknown": "physics outside the catalogue, or too little to name",
        "no_mismatch": "nothing that the window shows",
        "parameters_only": "values of the lesson are off",
        "recording_fault": "the recording is at fault",
    }.get(str(answer.get("verdict")), str(answer.get("verdict")))
    return Event("verdict", begin, f"From t = {begin:.1f} s: {told}.", data)


def _sizes(entry: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {item['value']:.4g} {item['unit']}" for name, item in entry.get("parameters", {}).items())
