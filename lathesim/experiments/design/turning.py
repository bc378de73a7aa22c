"""Programs for a machine that turns: cuts with steps of feed, depth and speed, and a spindle that changes its speed in air."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.design.families import Candidate
from lathesim.experiments.design.program_text import Move
from lathesim.experiments.design.room import Room, Turning

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


def turned_candidates(room: Room, at_most: float, count: int, random: np.random.Generator) -> list[Candidate]:
    """Return up to ``count`` programs of at most ``at_most`` [s]: cuts and turns of the spindle in air by turns."""
    turning, found = room.turning, list[Candidate]()
    if turning is None:
        return []
    for number in range(2 * count):
        budget = at_most * float(random.choice([0.5, 0.75, 0.95]))
        both_ways = number % 4 < 2
        made = _cuts(room, turning, budget, random) if turning.cuts and number % 2 else _spins(room, turning, budget, random, both_ways)
        if made is not None and made.seconds <= at_most:
            found.append(made)
    return found[:count]


def _cuts(room: Room, turning: Turning, budget: float, random: np.random.Generator) -> Candidate | None:
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
    moves, seconds = [Move(turn=stretches[0][0].speed)], 0.0
    moves, seconds = _wait(room, moves, {"X": radius + _ASIDE, "Z": turning.face - _BEFORE}, letters, _SPIN_UP, seconds)
    share = (budget - seconds) / max(1, passes * steps) * 0.8
    for cuts in stretches:
        radius -= cuts[0].depth
        if radius < turning.smallest_radius:
            break
        ways = np.array([cut.rate * share for cut in cuts])
        ways *= min(1.0, length / float(ways.sum()))
        moves.append(Move({"X": round(radius, 7)}, room.feed))
        z, seconds = turning.face - _BEFORE, seconds + 0.02 / room.feed
        moves.append(Move({"Z": turning.face}, per_turn=round(cuts[0].feed, 8), turn=cuts[0].speed))
        seconds += _BEFORE / cuts[0].rate
        z = turning.face
        for cut, way in zip(cuts, ways, strict=True):
            z = round(z + float(way), 7)
            moves.append(Move({"Z": z}, per_turn=round(cut.feed, 8), turn=cut.speed))
            seconds += float(way) / cut.rate
        back = {"X": turning.radius + _ASIDE}
        moves += [Move(back, room.feed), Move({"Z": turning.face - _BEFORE}, room.feed)]
        seconds += (turning.radius + _ASIDE - radius + z - turning.face + _BEFORE) / room.feed
    return Candidate(title, tuple(moves), seconds)


def _spins(room: Room, turning: Turning, budget: float, random: np.random.Generator, both_ways: bool) -> Candidate:
    """Return speeds of the spindle in air, each held for a while, as a staircase or at random, one way or both, all of it twice."""
    count = int(random.integers(2, 6))
    shares: FloatArray = np.geomspace(float(random.choice([_SLOWEST_SPIN, 0.3])), 1.0, count)
    kind = str(random.choice(["rising", "mixed"]))
    shares = shares if kind == "rising" else random.permutation(shares)
    signs = [1.0, -1.0] if both_ways else [1.0]
    speeds = [float(sign * share * turning.speed) for sign in signs for share in shares]
    letters = {axis.letter: axis.start for axis in room.axes}
    home = {axis.letter: float(np.clip(axis.start, axis.low, axis.high)) for axis in room.axes}
    moves: list[Move] = []
    seconds = 0.0
    hold = budget / (2.0 * len(speeds))
    for speed in [*speeds, *speeds]:
        moves.append(Move(turn=speed))
        moves, seconds = _wait(room, moves, home, letters, hold, seconds)
        letters |= moves[-1].to
    return Candidate(f"speeds of the spindle, {'both ways' if both_ways else 'one way'}", tuple(moves), seconds)


def _wait(
    room: Room, moves: Sequence[Move], home: dict[str, float], letters: dict[str, float], time: float, seconds: float
) -> tuple[list[Move], float]:
    """Return moves with a rest behind them; where the dialect has no word for one, an axis goes slowly between two places in air."""
    if room.dwells or room.idle is not None:
        way = {letter: value for letter, value in home.items() if abs(value - letters[letter]) > 1e-7}
        there = [Move(way, room.feed)] if way else []
        letters |= way
        return [*moves, *there, Move(rest=round(time, 3))], seconds + time + 0.05 * len(there)
    axis = room.axes[-1]
    at = letters[axis.letter]
    target = home[axis.letter] if abs(home[axis.letter] - at) > 1e-3 else at + min(5e-3, 0.2 * axis.stroke)
    if target > axis.high:
        target = 2.0 * at - target
    others = {letter: value for letter, value in home.items() if letter != axis.letter and abs(value - letters[letter]) > 1e-7}
    first = [Move(others, room.feed)] if others else []
    letters |= others | {axis.letter: target}
    slow = float(np.clip(abs(target - at) / time, 1e-6, room.feed))
    return [*moves, *first, Move({axis.letter: round(target, 7)}, slow)], seconds + time + 0.5 * len(first)
