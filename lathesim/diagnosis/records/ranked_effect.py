"""How sure an effect is."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.identification.records.candidate import Candidate


@dataclass(frozen=True)
class RankedEffect:
    """How sure an effect is: its probability among its rivals, those that predict as well, and the share of the error it takes away."""

    candidate: Candidate
    probability: float
    tied: tuple[Candidate, ...]
    share: float
