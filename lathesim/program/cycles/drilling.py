"""The drilling cycles G81, G82, G83 and G85 along Z: rapid to the R plane, in by feed, out to where the cycle began or to the R plane.

Source: Haas lathe operator's manual, canned cycles for drilling; Fanuc 0i-T operator's manual, canned cycle for drilling. Left out:
tapping, and drilling from the side.
"""

from __future__ import annotations

from lathesim.program.cycles.step import Point, Step

_EPSILON = 1e-9
CLEAR = 0.5e-3
"""[m] how far in front of the last depth a peck begins to feed, assumed: a common setting of controls."""


def drilling(
    start: Point, place: Point, *, plane: float, back: float, peck: float = 0.0, dwell: float = 0.0, feed_out: bool = False
) -> list[Step]:
    """Return one hole from ``start`` to ``place`` (x, z of the bottom).

    ``plane`` and ``back`` are places along Z [m]: where the feed begins, and where the cycle ends. Behind each ``peck`` [m] the drill comes
    out to the plane.
    """
    x, bottom = place
    toward = -1.0 if bottom < plane else 1.0
    steps = [Step("rapid", (x, start[1])), Step("rapid", (x, plane))]
    depth = plane
    while toward * (bottom - depth) > _EPSILON:
        deeper = bottom if peck <= 0.0 or toward * (bottom - depth) <= peck + _EPSILON else depth + toward * peck
        if depth != plane:
            steps += [Step("rapid", (x, plane)), Step("rapid", (x, depth - toward * CLEAR))]
        steps.append(Step("feed", (x, deeper)))
        depth = deeper
    if dwell > 0.0:
        steps.append(Step("dwell", (x, bottom), seconds=dwell))
    if feed_out:
        steps.append(Step("feed", (x, plane)))
    return [*steps, Step("rapid", (x, back))]
