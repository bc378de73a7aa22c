"""The verdict follows from which explanation predicts best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lathesim.diagnosis.records.diagnosis import Verdict
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
