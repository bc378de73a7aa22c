"""Families of part programs, each of which shows another part of a machine's physics, and mixtures of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.experiments.design.program_text import Move
from lathesim.experiments.design.room import Axis, Room

_SLOWEST = 2e-4
"""Slowest speed of a program [m/s]; assumed."""
_SHORTEST = 6.0
"""Programs shorter than this [s] leave a diagnosis too little to judge on; measured on lesson 12."""
_SMALLEST = 2e-6
"""Shortest stroke of a program [m]; assumed."""


@dataclass(frozen=True)
class Candidate:
    """A program that may be run: what it is made of, its moves, and about how long it takes [s]."""

    title: str
    moves: tuple[Move, ...]
    seconds: float


class Walk:
    """Moves of one axis as they are laid, kept inside its travel and inside the time."""

    def __init__(self, room: Room, axis: Axis, begin: float, random: np.random.Generator) -> None:
        self.room, self.axis, self.place, self.random = room, axis, begin, random
        self.moves: list[Move] = []
        self.seconds = 0.0

    def go(self, way: float, speed: float) -> None:
        """Go a way [m], turned back at the ends of the travel."""
        target = self.place + way
        if not self.axis.low <= target <= self.axis.high:
            target = self.place - way
        target = float(np.round(min(max(target, self.axis.low), self.axis.high), 7))
        speed = float(np.clip(speed, _SLOWEST, self.room.feed))
        if abs(target - self.place) < 1e-7:
            return
        self.seconds += self.room.time(abs(target - self.place), speed)
        self.moves.append(Move({self.axis.letter: target}, float(np.round(speed, 7))))
        self.place = target

    def rest(self, seconds: float) -> None:
        """Stand still, where the dialect has a word for it or another axis can move meanwhile."""
        if self.room.dwells or self.room.idle is not None:
            self.moves.append(Move(rest=round(seconds, 3)))
            self.seconds += seconds


def constant_speeds(walk: Walk, seconds: float) -> None:
    """Out and back at several speeds: what depends on speed, and on its sign."""
    count = int(walk.random.integers(2, 6))
    slowest = walk.random.choice([0.01, 0.03, 0.1])
    for speed in walk.room.feed * np.geomspace(1.0, slowest, count):
        way = min(speed * seconds / (2.2 * count), 0.9 * walk.axis.stroke)
        walk.go(way, speed)
        walk.go(-way, speed)


def reversals(walk: Walk, seconds: float) -> None:
    """Strokes of many amplitudes around one place: play, and friction before it slides."""
    smallest = max(_SMALLEST, 1e-6 * walk.random.choice([2.0, 5.0, 20.0]))
    largest = min(walk.random.choice([1e-4, 1e-3, 1e-2]), 0.9 * walk.axis.stroke)
    count = int(walk.random.integers(4, 9))
    for way in np.geomspace(smallest, max(largest, 2.0 * smallest), count):
        speed = max(_SLOWEST, 2.5 * way * count / seconds)
        walk.go(way, speed)
        walk.go(-way, speed)


def stroke_comb(walk: Walk, seconds: float) -> None:
    """Short strokes at the acceleration limit: inertia, lags and delays, what is elastic."""
    speed = walk.room.feed * walk.random.choice([0.3, 0.6, 1.0])
    ramp = 0.0 if math.isinf(walk.room.acceleration) else speed * speed / walk.room.acceleration
    way = min(max(ramp * walk.random.choice([0.5, 1.0, 1.5]), 0.05 * speed), 0.9 * walk.axis.stroke)
    each = 2.0 * walk.room.time(way, speed)
    for _ in range(max(2, int(seconds / max(each, 1e-3)))):
        walk.go(way, speed)
        walk.go(-way, speed)


def rests_under_bias(walk: Walk, seconds: float) -> None:
    """Approaches from both sides with a rest behind each: what holds a table that stands."""
    count = int(walk.random.integers(2, 5))
    way = min(walk.random.choice([2e-4, 2e-3, 1e-2]), 0.9 * walk.axis.stroke)
    for _ in range(count):
        for sign in (1.0, -1.0):
            walk.go(sign * way, way * 4.0 * count / seconds + _SLOWEST)
            walk.rest(min(0.3, seconds / (4.0 * count)))


def screw_turns(walk: Walk, seconds: float) -> None:
    """One long way at several speeds, there and back: what repeats along the way, and what repeats in time."""
    way = min(walk.random.choice([0.012, 0.03, 0.06]), 0.9 * walk.axis.stroke)
    count = int(walk.random.integers(2, 4))
    quickest = 2.2 * count * way / seconds
    for share in np.geomspace(1.6, 0.6, count):
        walk.go(way, quickest * share)
        walk.go(-way, quickest * share)


def creep(walk: Walk, seconds: float) -> None:
    """Very slow ways with a quick return: what sticks, ripples of motor and screw."""
    speed = max(_SLOWEST, walk.room.feed * walk.random.choice([0.003, 0.01]))
    way = min(0.4 * speed * seconds, 0.5 * walk.axis.stroke)
    walk.go(way, speed)
    walk.go(-way, speed)


FAMILIES: dict[str, Callable[[Walk, float], None]] = {
    "constant speeds": constant_speeds,
    "reversals": reversals,
    "strokes at the acceleration limit": stroke_comb,
    "rests after both directions": rests_under_bias,
    "long ways at several speeds": screw_turns,
    "creeping": creep,
}
"""What programs are mixed of, by what a person calls it."""


def candidates(room: Room, at_most: float, count: int, seed: int, only: Sequence[str] = (), *, arcs: bool = True) -> list[Candidate]:
    """Return ``count`` programs of at most ``at_most`` [s] for the free axes: each family alone first, then mixtures.

    What a program does it does twice: a recording is judged on the half that was not fitted.
    """
    random = np.random.default_rng(seed)
    names = list(only) or list(FAMILIES)
    found: list[Candidate] = []
    plans = [[name] for name in names for _ in range(2)]
    while len(plans) < 2 * count:
        plans.append([str(name) for name in random.choice(names, size=random.integers(2, min(4, len(names) + 1) + 1))])
    for plan in plans:
        budget = min(0.92 * at_most, max(_SHORTEST, at_most * random.choice([0.3, 0.6, 0.92])))
        found.append(_mixed(room, plan, budget, random))
        if room.axes[1:] and random.random() < 0.3 and arcs:
            found.append(_with_arcs(room, found[-1], random))
    fitting = [item for item in found if item.moves and item.seconds <= at_most]
    return fitting[:count]


def strokes_in_turn(room: Room, at_most: float, count: int, seed: int) -> list[Candidate]:
    """Return ``count`` programs of strokes of one axis after the other, of many lengths, each done once.

    They make values known: no half of such a recording is left to judge the other one. What a loop that is about linear shows of itself
    grows with the square of its speed, so most of them go as fast as they may: between two speeds of either sign they switch, at instants
    that the lengths scatter. Some come back after each stroke, some go on from where they are.
    Source: Goodwin, Payne, Dynamic System Identification: Experiment Design and Data Analysis (1977), chapter 6 (inputs within bounds).
    """
    random = np.random.default_rng([seed, 7])
    found = []
    for _ in range(count):
        walks = [Walk(room, axis, axis.start, random) for axis in room.axes]
        smallest, largest = 10.0 ** random.uniform(-3.3, -2.3), 10.0 ** random.uniform(-2.0, -1.3)
        pause = float(random.choice([0.0, 0.0, random.uniform(0.0, 0.15)]))
        slower = float(random.choice([0.0, 0.0, 0.3]))
        returns = bool(random.random() < 0.7)
        moves: list[Move] = []
        seconds = 0.0
        while seconds < 0.97 * at_most:
            walk = walks[int(random.integers(len(walks)))]
            before, done = walk.seconds, len(walk.moves)
            way = min(float(np.round(smallest * (largest / smallest) ** random.random(), 6)), 0.4 * walk.axis.stroke)
            speed = room.feed * (float(random.uniform(0.1, 1.0)) if random.random() < slower else 1.0)
            home = walk.axis.start - walk.place
            out = way if home > walk.axis.stroke / 4.0 else -way if home < -walk.axis.stroke / 4.0 else way * random.choice([-1.0, 1.0])
            walk.go(out, speed)
            if returns:
                walk.go(-out, speed)
            if pause > 0.0:
                walk.rest(pause)
            moves += walk.moves[done:]
            seconds += max(walk.seconds - before, 1e-3)
        found.append(Candidate("strokes of one axis after the other", tuple(moves), seconds))
    return [item for item in found if item.moves and item.seconds <= at_most]


def _mixed(room: Room, plan: Sequence[str], budget: float, random: np.random.Generator) -> Candidate:
    moves: list[Move] = []
    seconds = 0.0
    places = {axis.letter: _middle(axis, random) for axis in room.axes}
    approach = dict(places)
    way = max(abs(approach[axis.letter] - axis.start) for axis in room.axes)
    if way > 1e-6:
        moves.append(Move(approach, room.feed * 0.5))
        seconds += room.time(way, room.feed * 0.5) * len(room.axes)
    share = max(0.2, (budget - seconds) / (2 * len(plan) * len(room.axes)))
    state = random.bit_generator.state
    for _ in range(2):
        random.bit_generator.state = state
        for axis in room.axes:
            walk = Walk(room, axis, places[axis.letter], random)
            for name in plan:
                FAMILIES[name](walk, share)
            places[axis.letter] = walk.place
            moves += walk.moves
            seconds += walk.seconds
    return Candidate(", ".join(dict.fromkeys(plan)), tuple(moves), seconds)


def _middle(axis: Axis, random: np.random.Generator) -> float:
    return float(np.round(axis.low + axis.stroke * random.choice([0.05, 0.2, 0.4]), 6))


def _with_arcs(room: Room, base: Candidate, random: np.random.Generator) -> Candidate:
    """Return a program with a circle of four quarters behind it, in the plane of both axes."""
    first, second = room.axes[:2]
    at = {axis.letter: axis.start for axis in room.axes}
    for move in base.moves:
        at |= move.to
    radius = float(np.round(min(0.2 * min(first.stroke, second.stroke), random.choice([2e-3, 5e-3, 1e-2])), 6))
    speed = float(np.round(room.feed * random.choice([0.2, 0.6]), 6))
    x, z = at[first.letter], at[second.letter]
    x = min(max(x, first.low + radius), first.high - radius)
    z = min(max(z, second.low), second.high - 2.0 * radius)
    circle = [(x + radius, z + radius), (x, z + 2 * radius), (x - radius, z + radius), (x, z)]
    moves = [*base.moves, Move({first.letter: x, second.letter: z}, speed)]
    moves += [Move({first.letter: px, second.letter: pz}, speed, radius=radius, clockwise=False) for px, pz in circle]
    return Candidate(f"{base.title}, a circle", tuple(moves), base.seconds + 7.0 * radius / speed + 1.0)
