"""How stable a decision is under other limits and other draws of the noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Stability:
    """The share of perturbed decisions that give the same answer.

    ``outcomes`` are the shares of all answers: verdicts, and "other effects" where another set of effects would be accepted.
    ``hinges_on`` names the limits of which one alone, moved by as much as it is shaken, changes the answer.
    """

    share: float
    decisions: int
    outcomes: Mapping[str, float] = field(default_factory=dict)
    hinges_on: tuple[str, ...] = ()
