"""Limits of what errors of laws make."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit


@dataclass(frozen=True)
class VerdictLimits:
    """Limits of what errors of laws make."""

    within_laws: Limit = Limit(
        0.01, "share of acting force",
        "a force that goes with the motion and is smaller than this may be an error of the lesson's laws",
        "derived",
        "two standard deviations of 0.5 %, the declared error of a law; five times what integration leaves",
    )  # fmt: skip
