"""Print the missing force as a share of the acting force; there is no share if almost nothing acts."""

from __future__ import annotations

import math

BESIDE_NOTHING = 10.0
"""Ratio of missing to acting force from which on almost nothing acts (assumed): the ratio then says nothing about the missing force."""


def known_share(share: float) -> float:
    """Return a share of the acting force, NaN if almost nothing acts."""
    return share if share < BESIDE_NOTHING else math.nan


def still_missing_at(at: str, share: float, digits: int) -> str:
    """Return the text on the force that is still missing: ``"12.3% of what acts at x_axis.force is still missing"``."""
    if math.isnan(known_share(share)):
        return f"something is still missing at {at}, where next to nothing acts"
    return f"{share:.{digits}%} of what acts at {at} is still missing"
