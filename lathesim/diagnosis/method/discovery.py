"""Limits of formulas for what no effect explains."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit


@dataclass(frozen=True)
class DiscoveryLimits:
    """Limits of formulas for what no effect explains."""

    smoothed_reversal: float = 0.02
    """Share of the top speed over which a step at a reversal is smoothed."""
    worth: Limit = Limit(
        0.05,
        "share of missing force",
        "a further group of columns must explain this on the validation recording, and a listed dependence too",
    )
    most_columns: int = 8
    """Columns of a formula at most."""
    waves: int = 400
    """Waves among which the strongest one is looked for."""
    most_points: int = 4000
    """Samples of a signal that are looked at for that."""
    most_groups: int = 3
    """Groups of columns in a formula at most."""
    ends: float = 0.06
    """Share of the recording that is left out at either end, where the missing force is tapered."""
