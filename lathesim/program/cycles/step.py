"""One step of an expanded cycle: where the tool goes, and how."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from lathesim.program.moves import Arc

Point = tuple[float, float]
"""(x, z) [m], X as a radius."""


@dataclass(frozen=True)
class Step:
    """A rapid, a feed, an arc or a thread to ``end``, or a dwell of ``seconds``.

    ``feed`` [m/s or m] replaces the feed in force; ``lead`` [m] is along the path. ``spin`` is the spindle speed over the speed in force:
    below zero the spindle is reversed, and a thread is then the way out of a tapped hole.
    """

    kind: Literal["rapid", "feed", "arc", "thread", "dwell"]
    end: Point
    arc: Arc | None = None
    feed: float | None = None
    lead: float | None = None
    seconds: float = 0.0
    spin: float = 1.0
