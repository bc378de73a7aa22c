"""The verdict follows from which explanation predicts best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.records.diagnosis import VERDICTS, FoundEffect, Verdict, listed
from lathesim.diagnosis.verdict.doubt import Doubt


@dataclass(frozen=True)
class Decided:
    """A verdict with its reason in words."""

    verdict: Verdict
    reason: str


def decided(named: bool, doubts: Sequence[Doubt], *, tied: bool, values_differ: bool, another_law: bool = False) -> Decided:
    """Return the verdict: what predicts best names it; only where nothing of the catalogue does is what is missing unknown."""
    if named:
        if tied:
            return Decided("tied", "another explanation predicts as well")
        return Decided("named", "no other explanation predicts as well")
    if another_law:
        return Decided("unknown", "a controller follows another law than the lesson's")
    if any(doubt.clear for doubt in doubts):
        return Decided("unknown", "a smooth function of what the machine does predicts better than every explanation of the catalogue")
    if values_differ:
        return Decided("parameters_only", "other values of the lesson predict best")
    return Decided("no_mismatch", "no explanation predicts better than the lesson")


def sentence_of(verdict: Verdict, effects: Sequence[FoundEffect], off: Sequence[str], *, changed: bool) -> str:
    """Return a verdict as a sentence; ``off`` are values further off than the lesson holds possible, ``changed`` says that a recording from
    before a change stands beside."""
    if verdict == "parameters_only" and off:
        verb = "are" if len(off) > 1 else "is"
        return f"No physics is missing, but {listed(list(off))} {verb} further off than the lesson holds possible."
    if not effects or verdict not in ("named", "tied"):
        return VERDICTS[verdict]
    names = [f"{one.effect} at {one.at}" + (f" (or {', '.join(one.tied_with)})" if one.tied_with else "") for one in effects]
    return f"New since the recording from before: {listed(names)}." if changed else f"The simulation left out {listed(names)}."


def shortfall_of(doubts: Sequence[Doubt]) -> str:
    """Return what is left that could be predicted, in one sentence; empty where nothing is."""
    clear = [doubt for doubt in doubts if doubt.clear]
    if not clear:
        return ""
    parts = [
        f"{shown_with_unit(doubt.structured, doubt.unit, 3)} at {doubt.at}" + (f", which {doubt.depends_on[0]}" if doubt.depends_on else "")
        for doubt in clear
    ]
    return f"What is left has no name: {listed(parts)}."
