"""Limits of what the report mentions."""

from __future__ import annotations

from dataclasses import dataclass

from lathesim.limit import Limit


@dataclass(frozen=True)
class ReportingLimits:
    """Limits of what the report names, and plain values of what it mentions: these decide no answer."""

    comparable_part: Limit = Limit(0.2, "share of the largest", "a part that misses at least this share is suspected beside the first one")
    windows: int = 50
    """Stretches of a recording of which the worst is told."""
    nearest_parts: int = 4
    """Parts of a chain that are told at most."""
    most_bars: int = 8
    """Variables of which a bar is drawn at most."""
    least_bar: float = 0.01
    """Share that a variable must explain for its bar to be drawn."""
    most_rows: int = 6
    """Channels, and effects that were tried, in a table of the page at most."""
    most_drawings: int = 2
    """Drawings of channels on the page at most."""
    most_variables: int = 4
    """Variables that are named at most."""
    near_floor: Limit = Limit(3.0, "noise floors", "a channel above this is off, and below it at its floor")
    hardly_shown: float = 0.01
    """Noise floors below which a value is said to move nothing: some ten thousand samples average noise down to that."""
    most_named: int = 3
    """Values, effects or channels that one line of the answer names at most."""
    hardly_worse: float = 1.05
    """Ratio of the errors after and before up to which a channel is called slightly worse."""
