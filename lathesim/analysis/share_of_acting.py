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


def shares_beside(before: float, after: float) -> str:
    """Return the missing shares before and after as the end of a sentence: ``", 17.3% of what acts there, and 3.1% after"``."""
    known = [known_share(share) for share in (before, after)]
    if math.isnan(known[0]):
        return ""
    return f", {known[0]:.1%} of what acts there" + ("" if math.isnan(known[1]) else f", and {known[1]:.1%} after")
