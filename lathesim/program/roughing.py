"""The roughing cycles G71 (along Z) and G72 (across): level passes down to the contour, then one pass along it.

The contour with its allowances is walked once for each level. Where it comes nearer to the axis than the level, the tool feeds along the
level from where it falls below to where it rises above; the first such stretch begins in the open, further ones (pockets) are entered by a
feed from above. Behind each pass the tool withdraws by the retract at 45 degrees. At last the whole contour is followed, which leaves the
allowance and nothing more.

Source: Fanuc 0i-T operator's manual, multiple repetitive cycle (types I and II); LinuxCNC 2.9 manual, G71 and G72 with their forms .1 and
.2. Left out: the nose radius, and undercuts.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from lathesim.program.cycles import EPSILON, CycleStep
from lathesim.program.modal import Point
from lathesim.program.moves import Move, MoveKind

_ARC_STEP = math.radians(0.5)
"""Angle between the points of an arc at which levels are met: the chord is off by 1e-5 of the radius."""
_SAME_DEPTH = 1e-6
"""Distance [m] inside the depths of a contour at which a tool still counts as beyond them (assumed: coordinates are rounded to 1 um)."""
Cuts = Literal["all", "open", "pockets"]
"""The cuts of a roughing cycle: all, only those open towards its start, or only the pockets."""


@dataclass(frozen=True)
class Roughing:
    """A roughing cycle: the contour from its first cut on, allowances (x as a radius, z), depth and retract [m].

    ``across`` is False for G71 (passes along Z, depth in X) and True for G72 (passes along X, depth in Z). ``side`` is 1 if the
    tool waits at larger depths than the contour, -1 at smaller ones (:func:`air_side`). With ``feeds_in`` the tool goes to its depth by
    feed, like the first block of the contour. ``cuts`` selects the cuts. Without ``returns``, the cycle ends at the end of the contour,
    fed out to the depth of the start.
    """

    start: Point
    contour: tuple[Move, ...]
    allow_x: float
    allow_z: float
    depth: float
    retract: float
    side: float
    across: bool = False
    feeds_in: bool = False
    cuts: Cuts = "all"
    returns: bool = True

    def steps(self) -> list[CycleStep]:
        """Return the steps of the whole cycle."""
        walked = [_turned((x + self.allow_x, z + self.allow_z), self.across) for x, z in contour_points(self.contour)]
        start, side = _turned(self.start, self.across), self.side
        way = 1.0 if walked[-1][1] >= walked[0][1] else -1.0
        before = (start[0], way * min(way * start[1], way * walked[0][1]))  # an allowance may lie beyond the start
        allowed = abs(self.allow_z if self.across else self.allow_x)
        deepest = min(side * point[0] for point in walked)
        clear = side * max(side * start[0], *(side * point[0] for point in walked))
        steps: list[CycleStep] = []
        level = start[0] + side * (allowed - self.depth)
        while side * level > deepest + EPSILON:
            steps += self._level(level, walked, before, clear)
            level -= side * self.depth
        steps += self._along_contour(walked, before, clear)
        last = walked[-1]
        if not self.returns:
            return [*steps, self._step("feed", side * max(side * start[0], side * last[0]), last[1])]
        return [*steps, *(self._step("rapid", *way) for way in [(clear, last[1]), (clear, start[1]), start])]

    def _step(self, kind: MoveKind, depth: float, along: float) -> CycleStep:
        return CycleStep(kind, (along, depth) if self.across else (depth, along))

    def _level(self, level: float, walked: Sequence[Point], start: Point, clear: float) -> list[CycleStep]:
        """Return the passes at one level; rapid moves beside the contour run at the depth ``clear``, above all of it."""
        steps: list[CycleStep] = []
        side = self.side
        way = 1.0 if walked[-1][1] >= walked[0][1] else -1.0
        for begin, end, is_open in _stretches(level, walked, side):
            begin = start[1] if is_open else begin
            if abs(end - begin) < EPSILON or (self.cuts == "pockets" if is_open else self.cuts == "open"):
                continue
            if is_open:
                steps.append(self._step("feed" if self.feeds_in else "rapid", level, begin))
            else:
                steps += [self._step("rapid", clear, start[1]), self._step("rapid", clear, begin), self._step("feed", level, begin)]
            steps.append(self._step("feed", level, end))
            back = end - way * min(self.retract, abs(end - begin))
            away = level + side * min(self.retract, abs(start[0] - level))
            steps.append(self._step("feed", away, back))
            steps += [] if is_open else [self._step("rapid", clear, back)]
            steps.append(self._step("rapid", away if is_open else clear, start[1]))
        return steps

    def _along_contour(self, walked: Sequence[Point], start: Point, clear: float) -> list[CycleStep]:
        """Return the pass along the contour with its allowances."""
        first = walked[0]
        steps = [
            self._step("rapid", clear, start[1]),
            self._step("rapid", clear, first[1]),
            self._step("feed" if self.feeds_in else "rapid", *first),
        ]
        if self.cuts == "open":
            steps += [self._step("feed", *point) for point in _without_pockets(walked, self.side)[1:]]
        else:
            steps += [shifted(move, self.allow_x, self.allow_z) for move in self.contour]
        return steps


def shifted(move: Move, x: float = 0.0, z: float = 0.0) -> CycleStep:
    """Return a move of a contour as the step of a cycle, so far away [m]."""
    arc = None if move.arc is None else replace(move.arc, centre_x=move.arc.centre_x + x, centre_z=move.arc.centre_z + z)
    return CycleStep("arc" if arc is not None else "rapid" if move.kind == "rapid" else "feed", (move.end_x + x, move.end_z + z), arc)


def contour_points(contour: Sequence[Move]) -> list[Point]:
    """Return a contour as points (x, z) [m], arcs in small steps."""
    points = [(contour[0].start_x, contour[0].start_z)]
    for move in contour:
        if move.arc is not None:
            count = max(2, math.ceil(abs(move.arc.sweep) / _ARC_STEP))
            angles = [move.arc.start_angle + move.arc.sweep * place / count for place in range(1, count)]
            centre, radius = (move.arc.centre_x, move.arc.centre_z), move.arc.radius
            points += [(centre[0] + radius * math.sin(angle), centre[1] + radius * math.cos(angle)) for angle in angles]
        points.append((move.end_x, move.end_z))
    return points


def air_side(start: Point, contour: Sequence[Move], allowed: float, *, across: bool) -> float:
    """Return 1 if a tool at ``start`` (x, z) cuts down to a contour from larger depths, -1 if it cuts up from smaller ones.

    Depth is X, with ``across`` Z. If the tool stands beyond all depths of the contour, its position decides. Otherwise the sign of the
    allowance ``allowed`` along the depth decides. Without one, the sum of three shares of the whole depth decides: from the first depth to
    the start, from the first depth to the last, and the area of the contour below the start less that above it.
    """
    points = [_turned(point, across) for point in contour_points(contour)]
    depths = [point[0] for point in points]
    depth = start[1] if across else start[0]
    above, under = depth >= max(depths) - _SAME_DEPTH, depth <= min(depths) + _SAME_DEPTH
    if above != under:
        return 1.0 if above else -1.0
    below = [(depth - 0.5 * (here[0] + there[0])) * abs(there[1] - here[1]) for here, there in itertools.pairwise(points)]
    area = sum(below) / max(sum(abs(part) for part in below), EPSILON**2)
    ways = ((depth - depths[0]) + (depths[-1] - depths[0])) / max(max(depths) - min(depths), EPSILON)
    for lean in (allowed, ways + area):
        if abs(lean) > EPSILON:
            return math.copysign(1.0, lean)
    return 1.0


def _turned(point: Point, across: bool) -> Point:
    """Return a point (x, z) as (depth, along), or the reverse, so that both cycles share their code."""
    return (point[1], point[0]) if across else point


def _without_pockets(walked: Sequence[Point], side: float) -> list[Point]:
    """Return a contour without pockets: they are bridged at the depth of their first corner."""
    found = [walked[0]]
    for here, there in itertools.pairwise(walked):
        top = found[-1][0]
        if side * there[0] < side * top:
            continue
        if side * here[0] < side * top:
            share = (top - here[0]) / (there[0] - here[0])
            found.append((top, here[1] + share * (there[1] - here[1])))
        found.append(there)
    return found


def _stretches(level: float, walked: Sequence[Point], side: float) -> list[tuple[float, float, bool]]:
    """Return where the contour stands below a level: begin, end, and whether it does so from its first point on."""
    found: list[tuple[float, float, bool]] = []
    below = side * walked[0][0] < side * level - EPSILON
    begin, is_open = walked[0][1], True
    for here, there in itertools.pairwise(walked):
        lower = side * there[0] < side * level - EPSILON
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
