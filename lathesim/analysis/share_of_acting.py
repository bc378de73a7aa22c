"""What is missing as a share of what acts, for people: where nothing acts there is none."""

from __future__ import annotations

import math

BESIDE_NOTHING = 10.0
"""Ratio of what is missing to what acts from which on next to nothing acts: the ratio then tells how little that is, and of what is
missing nothing."""


def known_share(share: float) -> float:
    """Return a share of what acts, NaN where next to nothing acts."""
    return share if share < BESIDE_NOTHING else math.nan


def still_missing_at(at: str, share: float, digits: int) -> str:
    """Return what is still missing at a place: ``"12.3% of what acts at x_axis.force is still missing"``."""
    if math.isnan(known_share(share)):
        return f"something is still missing at {at}, where next to nothing acts"
    return f"{share:.{digits}%} of what acts at {at} is still missing"


def shares_beside(before: float, after: float) -> str:
    """Return the shares of what acts there that were missing, to end a sentence: ``", 17.3% of what acts there, and 3.1% after"``."""
    known = [known_share(share) for share in (before, after)]
    if math.isnan(known[0]):
        return ""
    return f", {known[0]:.1%} of what acts there" + ("" if math.isnan(known[1]) else f", and {known[1]:.1%} after")
