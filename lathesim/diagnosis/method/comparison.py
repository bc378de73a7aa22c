"""Limits of the engine of ``lathesim compare``."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method.limit import Limit


@dataclass(frozen=True)
class ComparisonLimits:
    """Limits of the engine of ``lathesim compare``."""

    beyond_time: Limit = Limit(1.05, "1", "a variable must explain more than time alone by this factor: else what is missing comes once")
