"""Families of part programs, each of which shows another part of a machine's physics, and mixtures of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.room import DesignedMove, FreeAxis, Room, Turning
from lathesim.limit import Limit

_ARCS, _RETURNS, _FILLED = 0.3, 0.7, 0.97
"""Shares: of the strokes that are arcs, of the programs that go back after each stroke, and of the time that strokes fill."""
_SAME_PLACE = Limit(1e-7, "m", "two places that differ by less are one", "derived", "the last digit of a program")
_NO_WAY = 1e-6
"""Way of an approach below which it is left out [m]."""
_AWAY = 1e-3
"""Way home from which on it is a stroke [m]."""
_SLOWEST = 2e-4
"""Slowest speed of a program [m/s]; assumed."""
_SHORTEST = 6.0
"""Programs shorter than this [s] leave a diagnosis too little to judge on; measured on lesson 22."""
_SMALLEST = 2e-6
"""Shortest stroke of a program [m]; assumed."""


@dataclass(frozen=True)
class CandidateProgram:
    """A program that may be run: what it is made of, its moves, and about how long it takes [s]."""

    title: str
    moves: tuple[DesignedMove, ...]
    seconds: float


class Walk:
    """Moves of one axis as they are laid, kept inside its travel and inside the time."""

    def __init__(self, room: Room, axis: FreeAxis, begin: float, random: np.random.Generator) -> None:
        self.room, self.axis, self.place, self.random = room, axis, begin, random
        self.moves: list[DesignedMove] = []
        self.seconds = 0.0

    def go(self, way: float, speed: float) -> None:
        """Go a way [m], turned back at the ends of the travel."""
        target = self.place + way
        if not self.axis.low <= target <= self.axis.high:
            target = self.place - way
        target = float(np.round(min(max(target, self.axis.low), self.axis.high), 7))
        speed = float(np.clip(speed, _SLOWEST, self.room.feed))
        if abs(target - self.place) < _SAME_PLACE:
            return
        self.seconds += self.room.time(abs(target - self.place), speed)
        self.moves.append(DesignedMove({self.axis.letter: target}, float(np.round(speed, 7))))
        self.place = target

    def rest(self, seconds: float) -> None:
        """Stand still, where the dialect has a word for it or another axis can move meanwhile."""
        if self.room.dwells or self.room.idle is not None:
            self.moves.append(DesignedMove(rest=round(seconds, 3)))
            self.seconds += seconds


def constant_speeds(walk: Walk, seconds: float) -> None:
    """Out and back at several speeds: what depends on speed, and on its sign."""
    count = int(walk.random.integers(2, 6))
    for speed in walk.room.feed * np.geomspace(1.0, walk.random.choice([0.01, 0.03, 0.1]), count):
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
    for _ in range(max(2, int(seconds / max(2.0 * walk.room.time(way, speed), 1e-3)))):
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


def candidates(room: Room, at_most: float, count: int, seed: int, only: Sequence[str] = (), *, arcs: bool = True) -> list[CandidateProgram]:
    """Return ``count`` programs of at most ``at_most`` [s] for the free axes: each family alone first, then mixtures.

    What a program does it does twice: a recording is judged on the half that was not fitted.
    """
    random = np.random.default_rng(seed)
    names = list(only) or list(FAMILIES)
    found: list[CandidateProgram] = []
    plans = [[name] for name in names for _ in range(2)]
    while len(plans) < 2 * count:
        plans.append([str(name) for name in random.choice(names, size=random.integers(2, min(4, len(names) + 1) + 1))])
    for plan in plans:
        budget = min(0.92 * at_most, max(_SHORTEST, at_most * random.choice([0.3, 0.6, 0.92])))
        found.append(_mixed(room, plan, budget, random))
        if room.axes[1:] and random.random() < _ARCS and arcs:
            found.append(_with_arcs(room, found[-1], random))
    return [item for item in found if item.moves and item.seconds <= at_most][:count]


def strokes_in_turn(room: Room, at_most: float, count: int, seed: int) -> list[CandidateProgram]:
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
        returns = bool(random.random() < _RETURNS)
        moves: list[DesignedMove] = []
        seconds = 0.0
        while seconds < _FILLED * at_most:
            walk = walks[int(random.integers(len(walks)))]
            before, done = walk.seconds, len(walk.moves)
            way = min(float(np.round(smallest * (largest / smallest) ** random.random(), 6)), 0.4 * walk.axis.stroke)
            speed = room.feed * (float(random.uniform(0.1, 1.0)) if random.random() < slower else 1.0)
            home = walk.axis.start - walk.place
            far = 0.25 * walk.axis.stroke
            out = way if home > far else -way if home < -far else way * random.choice([-1.0, 1.0])
            walk.go(out, speed)
            if returns:
                walk.go(-out, speed)
            if pause > 0.0:
                walk.rest(pause)
            moves += walk.moves[done:]
            seconds += max(walk.seconds - before, 1e-3)
        found.append(CandidateProgram("strokes of one axis after the other", tuple(moves), seconds))
    return [item for item in found if item.moves and item.seconds <= at_most]


def _mixed(room: Room, plan: Sequence[str], budget: float, random: np.random.Generator) -> CandidateProgram:
    moves: list[DesignedMove] = []
    seconds = 0.0
    places = {axis.letter: float(np.round(axis.low + axis.stroke * random.choice([0.05, 0.2, 0.4]), 6)) for axis in room.axes}
    approach = dict(places)
    way = max(abs(approach[axis.letter] - axis.start) for axis in room.axes)
    if way > _NO_WAY:
        moves.append(DesignedMove(approach, room.feed * 0.5))
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
    return CandidateProgram(", ".join(dict.fromkeys(plan)), tuple(moves), seconds)


def _with_arcs(room: Room, base: CandidateProgram, random: np.random.Generator) -> CandidateProgram:
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
    moves = [*base.moves, DesignedMove({first.letter: x, second.letter: z}, speed)]
    moves += [DesignedMove({first.letter: px, second.letter: pz}, speed, radius=radius, clockwise=False) for px, pz in circle]
    return CandidateProgram(f"{base.title}, a circle", tuple(moves), base.seconds + 7.0 * radius / speed + 1.0)


_SPIN_UP = 1.0
"""Time [s] that a spindle is given before a cut; assumed."""
_BEFORE = 2e-3
"""How far before the face of the stock a cut begins [m]; assumed."""
_ASIDE = 1e-3
"""How far beside the stock the tool goes back [m]; assumed."""
_LOWEST = (0.08, 0.3, 0.4)
"""Smallest feed, depth and spindle speed of a cut as shares of the largest ones; assumed."""
_SLOWEST_SPIN = 0.1
"""Slowest speed of a spindle in air, as a share of the largest one; assumed."""


@dataclass(frozen=True)
class _Cut:
    """One stretch of a pass: its depth [m], feed [m a turn] and spindle speed [rad/s]."""

    depth: float
    feed: float
    speed: float

    @property
    def rate(self) -> float:
        """How fast it goes along the part [m/s]."""
        return self.feed * self.speed / (2.0 * math.pi)


def turned_candidates(room: Room, at_most: float, count: int, random: np.random.Generator) -> list[CandidateProgram]:
    """Return up to ``count`` programs of at most ``at_most`` [s]: cuts and turns of the spindle in air by turns."""
    turning, found = room.turning, list[CandidateProgram]()
    if turning is None:
        return []
    for number in range(2 * count):
        budget = at_most * float(random.choice([0.5, 0.75, 0.95]))
        both_ways = not number // 2 % 2
        made = _cuts(room, turning, budget, random) if turning.cuts and number % 2 else _spins(room, turning, budget, random, both_ways)
        if made is not None and made.seconds <= at_most:
            found.append(made)
    return found[:count]


def _cuts(room: Room, turning: Turning, budget: float, random: np.random.Generator) -> CandidateProgram | None:
    """Return passes along the part, each at one depth, with a stretch for each step of feed or speed; all is done in even shares of the
    time, and twice: a recording is judged on the half that was not fitted."""
    different = int(random.integers(1, 3))
    shares = np.tile(random.uniform(_LOWEST[1], 1.0, different), 2)
    passes, depths = len(shares), turning.depth * float(random.uniform(_LOWEST[1], 1.0)) * shares / shares.sum()
    steps = int(random.integers(2, 5))
    what = [("feed",), ("speed",), ("feed", "speed"), ("depth",)][int(random.integers(4))]
    title = f"a cut with steps of {' and '.join(dict.fromkeys([*what, *(['depth'] if different > 1 else [])]))}"
    feeds = turning.feed * (np.geomspace(_LOWEST[0], 1.0, steps) if "feed" in what else np.full(steps, random.uniform(0.5, 1.0)))
    speeds = turning.speed * (np.geomspace(_LOWEST[2], 1.0, steps) if "speed" in what else np.full(steps, random.uniform(0.7, 1.0)))
    order = random.permutation(steps)
    stretches = [[_Cut(float(depth), float(feeds[place]), float(speeds[place])) for place in order] for depth in depths]
    radius, length = turning.radius, turning.face_end - turning.face
    letters = {axis.letter: axis.start for axis in room.axes}
    if set(letters) != {"X", "Z"} or length <= _BEFORE:
        return None
    moves, seconds = [DesignedMove(turn=stretches[0][0].speed)], 0.0
    moves, seconds = _wait(room, moves, {"X": radius + _ASIDE, "Z": turning.face - _BEFORE}, letters, _SPIN_UP, seconds)
    share = (budget - seconds) / max(1, passes * steps) * 0.8
    for cuts in stretches:
        radius -= cuts[0].depth
        if radius < turning.smallest_radius:
            break
        ways = np.array([cut.rate * share for cut in cuts])
        ways *= min(1.0, length / float(ways.sum()))
        moves.append(DesignedMove({"X": round(radius, 7)}, room.feed))
        z, seconds = turning.face - _BEFORE, seconds + 0.02 / room.feed
        moves.append(DesignedMove({"Z": turning.face}, per_turn=round(cuts[0].feed, 8), turn=cuts[0].speed))
        seconds += _BEFORE / cuts[0].rate
        z = turning.face
        for cut, way in zip(cuts, ways, strict=True):
            z = round(z + float(way), 7)
            moves.append(DesignedMove({"Z": z}, per_turn=round(cut.feed, 8), turn=cut.speed))
            seconds += float(way) / cut.rate
        moves += [DesignedMove({"X": turning.radius + _ASIDE}, room.feed), DesignedMove({"Z": turning.face - _BEFORE}, room.feed)]
        seconds += (turning.radius + _ASIDE - radius + z - turning.face + _BEFORE) / room.feed
    return CandidateProgram(title, tuple(moves), seconds)


def _spins(room: Room, turning: Turning, budget: float, random: np.random.Generator, both_ways: bool) -> CandidateProgram:
    """Return speeds of the spindle in air, each held for a while, as a staircase or at random, one way or both, all of it twice."""
    count = int(random.integers(2, 6))
    shares: FloatArray = np.geomspace(float(random.choice([_SLOWEST_SPIN, 0.3])), 1.0, count)
    shares = shares if str(random.choice(["rising", "mixed"])) == "rising" else random.permutation(shares)
    signs = [1.0, -1.0] if both_ways else [1.0]
    speeds = [float(sign * share * turning.speed) for sign in signs for share in shares]
    letters = {axis.letter: axis.start for axis in room.axes}
    home = {axis.letter: float(np.clip(axis.start, axis.low, axis.high)) for axis in room.axes}
    moves: list[DesignedMove] = []
    seconds = 0.0
    hold = budget / (2.0 * len(speeds))
    for speed in [*speeds, *speeds]:
        moves.append(DesignedMove(turn=speed))
        moves, seconds = _wait(room, moves, home, letters, hold, seconds)
        letters |= moves[-1].to
    return CandidateProgram(f"speeds of the spindle, {'both ways' if both_ways else 'one way'}", tuple(moves), seconds)


def _wait(
    room: Room, moves: Sequence[DesignedMove], home: dict[str, float], letters: dict[str, float], time: float, seconds: float
) -> tuple[list[DesignedMove], float]:
    """Return moves with a rest behind them; where the dialect has no word for one, an axis goes slowly between two places in air."""
    if room.dwells or room.idle is not None:
        way = {letter: value for letter, value in home.items() if abs(value - letters[letter]) > _SAME_PLACE}
        there = [DesignedMove(way, room.feed)] if way else []
        letters |= way
        return [*moves, *there, DesignedMove(rest=round(time, 3))], seconds + time + 0.05 * len(there)
    axis = room.axes[-1]
    at = letters[axis.letter]
    target = home[axis.letter] if abs(home[axis.letter] - at) > _AWAY else at + min(5e-3, 0.2 * axis.stroke)
    if target > axis.high:
        target = 2.0 * at - target
    others = {letter: value for letter, value in home.items() if letter != axis.letter and abs(value - letters[letter]) > _SAME_PLACE}
    first = [DesignedMove(others, room.feed)] if others else []
    letters |= others | {axis.letter: target}
    slow = float(np.clip(abs(target - at) / time, 1e-6, room.feed))
    return [*moves, *first, DesignedMove({axis.letter: round(target, 7)}, slow)], seconds + time + 0.5 * len(first)
