"""Limits of formulas for what no effect explains."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.diagnosis.method.limit import Limit


@dataclass(frozen=True)
class DiscoveryLimits:
    """Limits of formulas for what no effect explains."""

    smoothed_reversal: Limit = Limit(0.02, "share of top speed", "a step at a reversal is smoothed over this share of the fastest motion")
    worth: Limit = Limit(
        0.05,
        "share of missing force",
        "a further group of columns must explain this on the validation recording, and a dependence must to be listed",
    )
    most_groups: int = 3
    """Groups of columns in a formula at most."""
    ends: Limit = Limit(0.06, "share of recording", "either end of a recording is left out, as the missing force is tapered there")
