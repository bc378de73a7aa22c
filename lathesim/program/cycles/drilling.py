"""The drilling cycles along Z: rapid to the R plane, in by feed or on a lead, out to the start of the cycle or to the R plane.

Source: Haas lathe operator's manual, canned cycles for drilling; Fanuc 0i-T operator's manual, canned cycle for drilling; LinuxCNC 2.9,
canned cycles of the interpreter. Left out: drilling from the side, back boring, tapping in pecks.
"""

from __future__ import annotations

from dataclasses import dataclass

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
            steps += [Step("rapid", (x, plane)), Step("rapid", (x, depth - toward * min(CLEAR, peck)))]
        steps.append(Step("feed", (x, deeper)))
        depth = deeper
    if dwell > 0.0:
        steps.append(Step("dwell", (x, bottom), seconds=dwell))
    if feed_out:
        steps.append(Step("feed", (x, plane)))
    return [*steps, Step("rapid", (x, back))]


def tapping(start: Point, place: Point, *, plane: float, back: float, lead: float) -> list[Step]:
    """Return one tapped hole: in with the ``lead`` [m] from the R plane, out with the spindle reversed; see :func:`drilling`."""
    x, bottom = place
    return [
        Step("rapid", (x, start[1])),
        Step("rapid", (x, plane)),
        Step("thread", (x, bottom), lead=lead),
        Step("thread", (x, plane), lead=lead, spin=-1.0),
        Step("rapid", (x, back)),
    ]


@dataclass(frozen=True)
class Hole:
    """One hole of LinuxCNC's cycles, from the R ``plane`` down to the ``bottom`` and out to ``clear``, all positions along Z [m].

    After each ``peck`` [m] the drill retracts to the plane; with ``breaks_chips`` only by ``lift`` [m]. The feed starts again ``lift`` in
    front of the last depth. ``dwell`` [s] is at the bottom. With ``feeds_out`` the tool leaves by feed, with ``out_to_plane`` only as far
    as the plane. ``spin`` is the spindle speed on the way out over the programmed one: 0 means stopped, -1 reversed.
    """

    plane: float
    bottom: float
    clear: float
    peck: float = 0.0
    lift: float = 0.0
    breaks_chips: bool = False
    dwell: float = 0.0
    feeds_out: bool = False
    out_to_plane: bool = False
    spin: float = 1.0

    def steps(self, x: float) -> list[Step]:
        """Return the steps of the hole at ``x`` [m]; the tool stands on the R plane."""
        steps: list[Step] = []
        count = 1
        while self.peck > 0.0 and self.plane - count * self.peck > self.bottom + _EPSILON:
            depth = self.plane - count * self.peck
            steps.append(Step("feed", (x, depth)))
            if not self.breaks_chips:
                steps.append(Step("rapid", (x, self.plane)))
            steps.append(Step("rapid", (x, depth + self.lift)))
            count += 1
        steps.append(Step("feed", (x, self.bottom)))
        if self.dwell > 0.0:
            steps.append(Step("dwell", (x, self.bottom), seconds=self.dwell, spin=min(self.spin, 1.0) or 1.0))
        if self.feeds_out:
            steps.append(Step("feed", (x, self.plane if self.out_to_plane else self.clear), spin=self.spin))
        return steps if self.feeds_out and not self.out_to_plane else [*steps, Step("rapid", (x, self.clear), spin=self.spin)]
