"""Canned cycles as steps: single passes, pecking and threading.

The single-pass cycles G90, G92 and G94 of system A: in, along, out and back.

Source: Fanuc 0i-T operator's manual, canned cycle (outer and inner diameter cutting, thread cutting, end face turning). ``taper`` is the
word R: how far the start of the cut lies from its end.

The grooving and pecking cycles G74 (along Z) and G75 (across): in by steps, a little back, on, out, and aside.

Source: Fanuc 0i-T operator's manual, end face peck drilling cycle and outer diameter drilling cycle. Left out: the relief at the bottom.

The threading cycle G76 as Fanuc and Haas have it: passes of equal chip area down one flank.

Pass n stands at the depth d_n = d_1 sqrt(n), at least ``smallest`` deeper than the one before, down to the height less the finishing
allowance; then come the finishing passes at full depth. The tool is fed along the flank: pass n begins d_n tan(angle/2) further along.

Source: Fanuc 0i-T operator's manual, multiple threading cycle. Left out: other ways of feeding in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from lathesim.program.moves import Arc

Point = tuple[float, float]
"""(x, z) [m], X as a radius."""


@dataclass(frozen=True)
class CycleStep:
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


def turning_pass(start: Point, end: Point, taper: float) -> list[CycleStep]:
    """Return G90: rapid to the diameter, feed along, feed out to the start's X, rapid back."""
    return [
        CycleStep("rapid", (end[0] + taper, start[1])),
        CycleStep("feed", end),
        CycleStep("feed", (start[0], end[1])),
        CycleStep("rapid", start),
    ]


def facing_pass(start: Point, end: Point, taper: float) -> list[CycleStep]:
    """Return G94: rapid to the depth, feed across, feed out to the start's Z, rapid back."""
    return [
        CycleStep("rapid", (start[0], end[1] + taper)),
        CycleStep("feed", end),
        CycleStep("feed", (end[0], start[1])),
        CycleStep("rapid", start),
    ]


def threading_pass(start: Point, end: Point, taper: float, lead: float, chamfer: float = 0.0) -> list[CycleStep]:
    """Return G92: rapid to the diameter, thread along with ``lead`` [m] on the longer axis and its run-out, rapid out and back."""
    begin = (end[0] + taper, start[1])
    return [
        CycleStep("rapid", begin),
        *thread_with_run_out(begin, end, lead, chamfer, 1.0 if start[0] >= end[0] else -1.0),
        CycleStep("rapid", (start[0], end[1])),
        CycleStep("rapid", start),
    ]


def thread_with_run_out(begin: Point, end: Point, lead: float, chamfer: float, outside: float) -> list[CycleStep]:
    """Return a thread that runs out over its last ``chamfer`` [m] along Z, at 45 degrees to the side ``outside`` of X, in one motion.

    Without a chamfer, or with a chamfer as long as the thread, there is no run-out.
    """
    along, length = lead_along_path(begin, end, lead), abs(end[1] - begin[1])
    if not 0.0 < chamfer < length:
        return [CycleStep("thread", end, lead=along)]
    share = 1.0 - chamfer / length
    leave = (begin[0] + share * (end[0] - begin[0]), begin[1] + share * (end[1] - begin[1]))
    out = (leave[0] + outside * chamfer, end[1])
    return [CycleStep("thread", leave, lead=along), CycleStep("thread", out, lead=lead_along_path(leave, out, lead))]


def lead_along_path(begin: Point, end: Point, lead: float) -> float:
    """Return the lead along the path [m] of a thread whose ``lead`` [m] is counted along its longer axis, as F of G32 and G92."""
    across, along = abs(end[0] - begin[0]), abs(end[1] - begin[1])
    longer = max(across, along)
    return lead * math.hypot(across, along) / longer if longer > 0.0 else lead


_EPSILON = 1e-9


def pecking(start: Point, end: Point, *, across: bool, step: float, aside: float, retract: float) -> list[CycleStep]:
    """Return the cycle: pecks of ``step`` along Z (along X with ``across``), withdrawn by ``retract``, repeated every ``aside`` [m].

    No retract is longer than the depth cut so far, so the tool does not move back beyond the start.
    """
    deep, wide = (0, 1) if across else (1, 0)
    steps: list[CycleStep] = []
    for place in _places(start[wide], end[wide], aside):
        steps.append(CycleStep("rapid", _point(deep, start[deep], place)))
        depths = _places(start[deep], end[deep], step)[1:]
        for number, depth in enumerate(depths):
            steps.append(CycleStep("feed", _point(deep, depth, place)))
            if number < len(depths) - 1:
                back = math.copysign(min(retract, abs(depth - start[deep])), start[deep] - end[deep])
                steps.append(CycleStep("rapid", _point(deep, depth + back, place)))
        steps.append(CycleStep("rapid", _point(deep, start[deep], place)))
    return [*steps, CycleStep("rapid", start)]


def _places(begin: float, end: float, step: float) -> list[float]:
    """Return the places from begin to end, ``step`` apart and the last at the end; all at once without a step."""
    way = end - begin
    if abs(way) < _EPSILON:
        return [begin]
    count = max(1, -int(-(abs(way) - _EPSILON) // step)) if step > 0.0 else 1
    sign = 1.0 if way > 0.0 else -1.0
    return [begin, *(begin + sign * step * number for number in range(1, count)), end]


def _point(deep: int, depth: float, place: float) -> Point:
    return (depth, place) if deep == 0 else (place, depth)


MOST_PASSES = 1000


@dataclass(frozen=True)
class Threading:
    """What G76 is told: the root at the end of the thread, height and depths [m] as radii, ``taper`` as R, ``angle`` [rad], lead [m].

    Over the last ``chamfer`` [m] along Z the thread runs out at 45 degrees.
    """

    start: Point
    end: Point
    height: float
    first_depth: float
    lead: float
    smallest: float = 0.0
    allowance: float = 0.0
    finishing: int = 1
    angle: float = 0.0
    taper: float = 0.0
    chamfer: float = 0.0

    @property
    def begins_inside(self) -> bool:
        """Whether the start lies deeper than the crest at one end of the thread, where the tool comes back in rapid."""
        outside = 1.0 if self.start[0] >= self.end[0] else -1.0
        crest = max(outside * self.end[0], outside * (self.end[0] + self.taper)) + self.height
        return outside * self.start[0] < crest - _EPSILON

    def depths(self) -> list[float]:
        """Return the depth of each pass below the crest [m], the last ones at full height."""
        rough = self.height - self.allowance
        found: list[float] = []
        depth = 0.0
        for number in range(1, MOST_PASSES + 1):
            depth = min(rough, max(self.first_depth * math.sqrt(number), depth + self.smallest))
            if found and depth - found[-1] < _EPSILON:
                break
            found.append(depth)
            if rough - depth < _EPSILON:
                break
        return [*found, *[self.height] * max(1 if self.allowance > _EPSILON else 0, self.finishing)]

    def steps(self) -> list[CycleStep]:
        """Return the whole cycle, from the start point and back to it."""
        outside = 1.0 if self.start[0] >= self.end[0] else -1.0
        way = -1.0 if self.end[1] < self.start[1] else 1.0
        steps: list[CycleStep] = []
        for depth in self.depths():
            above = outside * (self.height - depth)
            begin = (self.end[0] + self.taper + above, self.start[1] + way * depth * math.tan(0.5 * self.angle))
            end = (self.end[0] + above, self.end[1])
            steps += [
                CycleStep("rapid", (self.start[0], begin[1])),
                CycleStep("rapid", begin),
                *thread_with_run_out(begin, end, self.lead, self.chamfer, outside),
                CycleStep("rapid", (self.start[0], end[1])),
                CycleStep("rapid", self.start),
            ]
        return steps


@dataclass(frozen=True)
class DriveLineThreading:
    """What LinuxCNC's G76 is told: the drive line is the X of ``start``, ``peak`` its distance to the crest (below zero outside) [m].

    Pass n stands at d_n = first n^(1/degression); ``slide`` [rad] feeds along the flank, at the beginning and at the end of a pass alike.
    A taper of the length ``taper`` along Z leads into the thread (``tapers_in``) or out of it from the full height.
    Source: LinuxCNC 2.9 manual, G76.
    """

    start: Point
    end_z: float
    pitch: float
    peak: float
    first: float
    full: float
    degression: float = 1.0
    slide: float = 0.0
    spring: int = 0
    taper: float = 0.0
    tapers_in: bool = False
    tapers_out: bool = False

    def depths(self) -> list[float]:
        """Return the depth of each pass below the crest [m]."""
        depths: list[float] = []
        for number in range(1, MOST_PASSES + 1):
            depth = self.first * float(number) ** (1.0 / self.degression)
            if depth >= self.full - _EPSILON:
                break
            depths.append(depth)
        return depths + [self.full] * (1 + self.spring)

    def steps(self) -> list[CycleStep]:
        """Return the whole cycle, from the drive line and back to it."""
        outside = -1.0 if self.peak < 0.0 else 1.0
        toward = -1.0 if self.end_z < self.start[1] else 1.0
        steep = self.pitch * math.hypot(self.taper, self.full) / self.taper if self.taper > 0.0 else self.pitch
        steps: list[CycleStep] = []
        for depth in self.depths():
            clear = self.start[0] - outside * (self.full - depth)
            begin = self.start[1] + toward * depth * math.tan(self.slide)
            finish = self.end_z - toward * (self.full - depth) * math.tan(self.slide)
            x = self.start[0] + self.peak + outside * depth
            above = x - outside * self.full
            steps.append(CycleStep("rapid", (clear, begin)))
            if self.tapers_in:
                steps += [
                    CycleStep("thread", (above, begin), lead=steep),
                    CycleStep("thread", (x, begin + toward * self.taper), lead=steep),
                ]
            else:
                steps.append(CycleStep("rapid", (x, begin)))
            steps.append(CycleStep("thread", (x, finish - toward * self.taper if self.tapers_out else finish), lead=self.pitch))
            if self.tapers_out:
                steps.append(CycleStep("thread", (above, finish), lead=steep))
            steps.append(CycleStep("rapid", (clear, finish)))
        return [*steps, CycleStep("rapid", (self.start[0], self.end_z))]
