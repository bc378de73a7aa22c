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

    ``feed`` [m/s or m] where it is not the one in force; ``lead`` [m] along the path. ``spin`` is the speed of the spindle as a share of
    the one in force: below zero it turns the other way, and a thread is then the way out of a tapped hole.
    """

    kind: Literal["rapid", "feed", "arc", "thread", "dwell"]
    end: Point
    arc: Arc | None = None
    feed: float | None = None
    lead: float | None = None
    seconds: float = 0.0
    spin: float = 1.0
