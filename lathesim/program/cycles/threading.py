"""The threading cycle G76 as Fanuc and Haas have it: passes of equal chip area down one flank.

Pass n stands at the depth d_n = d_1 sqrt(n), at least ``smallest`` deeper than the one before, down to the height less the finishing
allowance; then come the finishing passes at full depth. The tool is fed along the flank: pass n begins d_n tan(angle/2) further along.

Source: Fanuc 0i-T operator's manual, multiple threading cycle. Left out: other ways of feeding in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lathesim.program.cycles.single_pass import thread_with_run_out
from lathesim.program.cycles.step import Point, Step

MOST_PASSES = 1000
_EPSILON = 1e-9


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

    def steps(self) -> list[Step]:
        """Return the whole cycle, from the start point and back to it."""
        outside = 1.0 if self.start[0] >= self.end[0] else -1.0
        way = -1.0 if self.end[1] < self.start[1] else 1.0
        steps: list[Step] = []
        for depth in self.depths():
            above = outside * (self.height - depth)
            begin = (self.end[0] + self.taper + above, self.start[1] + way * depth * math.tan(0.5 * self.angle))
            end = (self.end[0] + above, self.end[1])
            steps += [
                Step("rapid", (self.start[0], begin[1])),
                Step("rapid", begin),
                *thread_with_run_out(begin, end, self.lead, self.chamfer, outside),
                Step("rapid", (self.start[0], end[1])),
                Step("rapid", self.start),
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

    def steps(self) -> list[Step]:
        """Return the whole cycle, from the drive line and back to it."""
        outside = -1.0 if self.peak < 0.0 else 1.0
        toward = -1.0 if self.end_z < self.start[1] else 1.0
        steep = self.pitch * math.hypot(self.taper, self.full) / self.taper if self.taper > 0.0 else self.pitch
        steps: list[Step] = []
        for depth in self.depths():
            clear = self.start[0] - outside * (self.full - depth)
            begin = self.start[1] + toward * depth * math.tan(self.slide)
            finish = self.end_z - toward * (self.full - depth) * math.tan(self.slide)
            x = self.start[0] + self.peak + outside * depth
            above = x - outside * self.full
            steps.append(Step("rapid", (clear, begin)))
            if self.tapers_in:
                steps += [Step("thread", (above, begin), lead=steep), Step("thread", (x, begin + toward * self.taper), lead=steep)]
            else:
                steps.append(Step("rapid", (x, begin)))
            steps.append(Step("thread", (x, finish - toward * self.taper if self.tapers_out else finish), lead=self.pitch))
            if self.tapers_out:
                steps.append(Step("thread", (above, finish), lead=steep))
            steps.append(Step("rapid", (clear, finish)))
        return [*steps, Step("rapid", (self.start[0], self.end_z))]
