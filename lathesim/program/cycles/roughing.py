"""The roughing cycles G71 (along Z) and G72 (across): level passes down to the contour, then one pass along it.

The contour with its allowances is walked once for each level. Where it comes nearer to the axis than the level, the tool feeds along the
level from where it falls below to where it rises above; the first such stretch begins in the open, further ones (pockets) are entered by a
feed from above. Behind each pass the tool withdraws by the retract at 45 degrees. At last the whole contour is followed, which leaves the
allowance and nothing more.

Source: Fanuc 0i-T operator's manual, multiple repetitive cycle (types I and II). Left out: the nose radius, and undercuts.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from lathesim.program.cycles.step import Point, Step
from lathesim.program.moves import Move

_ARC_STEP = math.radians(0.5)
"""Angle between the points of an arc at which levels are met: the chord is off by 1e-5 of the radius."""
_EPSILON = 1e-9
"""[m] below this, two places are one."""


@dataclass(frozen=True)
class Roughing:
    """What a roughing cycle is told: the contour from its first cut on, allowances (x as a radius, z), depth and retract [m].

    ``across`` is False for G71 (passes along Z, depth in X) and True for G72 (passes along X, depth in Z). With ``feeds_in`` the tool goes
    to its depth by feed, as the first block of the contour does.
    """

    start: Point
    contour: tuple[Move, ...]
    allow_x: float
    allow_z: float
    depth: float
    retract: float
    across: bool = False
    feeds_in: bool = False

    def steps(self) -> list[Step]:
        """Return the whole cycle, from the start point and back to it."""
        walked = [self._turned(point) for point in self._points()]
        start = self._turned(self.start)
        allowed = self.allow_z if self.across else self.allow_x
        side = self._side(start[0], [point[0] - allowed for point in walked])
        steps: list[Step] = []
        level = start[0] + side * allowed - side * self.depth
        deepest = min(side * point[0] for point in walked)
        while side * level > deepest + _EPSILON:
            steps += self._level(level, walked, start, side)
            level -= side * self.depth
        return [*steps, *self._along_contour(walked, start)]

    def _side(self, start: float, depths: Sequence[float]) -> float:
        """Return 1 where the tool waits above the contour, -1 below; inside its range the contour's first point decides."""
        if start >= max(depths) - _EPSILON:
            return 1.0
        return 1.0 if start > min(depths) + _EPSILON and start > depths[0] + _EPSILON else -1.0

    def _points(self) -> list[Point]:
        """Return the contour with its allowances as points, arcs in small steps."""
        first = self.contour[0]
        points = [(first.start_x, first.start_z)]
        for move in self.contour:
            if move.arc is not None:
                count = max(2, math.ceil(abs(move.arc.sweep) / _ARC_STEP))
                angles = [move.arc.start_angle + move.arc.sweep * place / count for place in range(1, count)]
                centre, radius = (move.arc.centre_x, move.arc.centre_z), move.arc.radius
                points += [(centre[0] + radius * math.sin(angle), centre[1] + radius * math.cos(angle)) for angle in angles]
            points.append((move.end_x, move.end_z))
        return [(x + self.allow_x, z + self.allow_z) for x, z in points]

    def _turned(self, point: Point) -> Point:
        """Return a point as (depth, along): the same work for both cycles."""
        return (point[1], point[0]) if self.across else point

    def _step(self, kind: str, depth: float, along: float) -> Step:
        return Step(kind, (along, depth) if self.across else (depth, along))  # type: ignore[arg-type]

    def _level(self, level: float, walked: Sequence[Point], start: Point, side: float) -> list[Step]:
        """Return the passes at one level."""
        steps: list[Step] = []
        way = 1.0 if walked[-1][1] >= walked[0][1] else -1.0
        for place, (begin, end, is_open) in enumerate(_stretches(level, walked, side)):
            begin = start[1] if place == 0 and is_open else begin
            if abs(end - begin) < _EPSILON:
                continue
            if place == 0 and is_open:
                steps.append(self._step("feed" if self.feeds_in else "rapid", level, begin))
            else:
                out = self._step("rapid", *start)  # straight out first, so that nothing between here and there is touched
                steps += [out, self._step("rapid", start[0], begin), self._step("feed", level, begin)]
            steps.append(self._step("feed", level, end))
            away = level + side * min(self.retract, abs(start[0] - level))
            steps.append(self._step("feed", away, end - way * min(self.retract, abs(end - begin))))
            if place or not is_open:
                steps.append(self._step("rapid", start[0], end - way * min(self.retract, abs(end - begin))))
            steps.append(self._step("rapid", start[0] if place or not is_open else away, start[1]))
        return steps

    def _along_contour(self, walked: Sequence[Point], start: Point) -> list[Step]:
        """Return the pass along the contour with its allowances, and the way back to the start."""
        first, last = walked[0], walked[-1]
        steps = [
            self._step("rapid", *start),
            self._step("rapid", start[0], first[1]),
            self._step("feed" if self.feeds_in else "rapid", *first),
        ]
        for move in self.contour:
            end = (move.end_x + self.allow_x, move.end_z + self.allow_z)
            if move.arc is None:
                steps.append(Step("feed", end))
            else:
                arc = replace(move.arc, centre_x=move.arc.centre_x + self.allow_x, centre_z=move.arc.centre_z + self.allow_z)
                steps.append(Step("arc", end, arc=arc))
        return [*steps, self._step("rapid", start[0], last[1]), self._step("rapid", *start)]


def _stretches(level: float, walked: Sequence[Point], side: float) -> list[tuple[float, float, bool]]:
    """Return where the contour stands below a level: begin, end, and whether it does so from its first point on."""
    found: list[tuple[float, float, bool]] = []
    below = side * walked[0][0] < side * level - _EPSILON
    begin, is_open = walked[0][1], True
    for here, there in itertools.pairwise(walked):
        lower = side * there[0] < side * level - _EPSILON
        if lower == below:
            continue
        share = (level - here[0]) / (there[0] - here[0]) if there[0] != here[0] else 0.0
        place = here[1] + min(1.0, max(0.0, share)) * (there[1] - here[1])
        if below:
            found.append((begin, place, is_open))
        begin, is_open, below = place, False, lower
    if below:
        found.append((begin, walked[-1][1], is_open))
    return found
