"""A limit of the method: a number that decides an answer, and what it rests on."""

from __future__ import annotations

from typing import Literal

Basis = Literal["derived", "calibrated", "assumed"]
ASSUMED = "chosen on concealed cases of the project's own generator; the margin was not recorded"


class Limit(float):
    """A number that decides an answer. It computes as a float does.

    ``unit`` is what it counts ("nats", "share of error", "noise floors"); ``meaning`` says what holds above or below it. ``basis`` is
    "derived" (``evidence`` is the derivation with its source), "calibrated" (both sides of the calibration) or "assumed".
    """

    unit: str
    meaning: str
    basis: Basis
    evidence: str
    name: str = ""
    """Where it stands in the method."""

    def __new__(cls, value: float, unit: str, meaning: str, basis: Basis = "assumed", evidence: str = ASSUMED) -> Limit:
        limit = super().__new__(cls, value)
        limit.unit, limit.meaning, limit.basis, limit.evidence = unit, meaning, basis, evidence
        return limit

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __getnewargs__(self) -> tuple[float, str, str, Basis, str]:  # type: ignore[override]
        """Return what a copy is made of."""
        return float(self), self.unit, self.meaning, self.basis, self.evidence


def derived(value: float, unit: str, meaning: str, evidence: str) -> Limit:
    """Return a limit that follows from a derivation, which ``evidence`` says with its source."""
    return Limit(value, unit, meaning, "derived", evidence)


def calibrated(value: float, unit: str, meaning: str, sides: str) -> Limit:
    """Return a limit with what was tried: ``sides`` says between which values no case is lost, and where some are."""
    return Limit(value, unit, meaning, "calibrated", sides)
