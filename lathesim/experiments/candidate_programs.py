"""Candidate programs: laid as paths that a machine walks, and changed by a stroke or two.

Programs that differ from a given one in a stroke or two: what a design is improved by, exchange by exchange.

Source: Meyer, Nachtsheim, The coordinate-exchange algorithm, Technometrics 37 (1995), with strokes of a program as coordinates.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.errors import LatheSimError
from lathesim.experiments.families import CandidateProgram
from lathesim.experiments.room import SAME_NUMBER, DesignedMove, FreeAxis, Room, program_text
from lathesim.program.interpreter import interpret
from lathesim.program.path import Limits, lay_path
from lathesim.program.words import read_program

_SHORTEST_WAY = 1e-4
"""Shortest stroke that is put into a program [m]; assumed."""
_SLOWEST_SHARE = 0.03
"""Slowest speed of such a stroke, as a share of the largest feed; assumed."""
_AS_FAST_AS_MAY_BE = 0.7
"""Share of strokes that go as fast as they may; assumed."""
_LONGEST_REST = 0.3
"""Longest rest that is put into a program [s]; assumed."""
_REST_CHANGED = 0.5
"""Share of the changes of a rest, where there is one, that make it longer or shorter and put in no other."""
_MOST_EXCHANGES = 3
"""Strokes exchanged at once."""
_FURTHEST_BACK = 6
"""Moves among which a way out and its way back are looked for."""
_TRIES = 12
"""Strokes taken out until a program keeps to its time."""


def neighbours(candidate: CandidateProgram, room: Room, at_most: float, random: np.random.Generator, count: int) -> list[CandidateProgram]:
    """Return up to ``count`` programs like a candidate, each with a few strokes exchanged, of at most ``at_most`` [s]."""
    found = []
    for _ in range(count):
        moves = list(candidate.moves)
        for _ in range(int(random.integers(1, _MOST_EXCHANGES + 1))):
            moves = _exchanged(moves, room, random)
        for _ in range(_TRIES):
            if _seconds(moves, room) <= at_most:
                break
            moves = _without_a_stroke(moves, room, random)
        seconds = _seconds(moves, room)
        if moves and seconds <= at_most and tuple(moves) != candidate.moves:
            found.append(CandidateProgram(candidate.title, tuple(moves), seconds))
    return found


_PUT_IN, _OTHERS = (0.15, 0.35), (0.7, 0.85)
"""Shares of the changes, summed up: a stroke taken out, put in, exchanged, made at another speed; the rest gets another rest."""
_RESTS = 0.4
"""Share of the strokes put in that end with a rest."""


def _exchanged(moves: list[DesignedMove], room: Room, random: np.random.Generator) -> list[DesignedMove]:
    """Return moves with a stroke taken out, put in, exchanged for another one, made at another speed, or with another rest."""
    what = random.random()
    taken = _without_a_stroke(moves, room, random) if what < _PUT_IN[0] or _PUT_IN[1] <= what < _OTHERS[0] else moves
    if what < _PUT_IN[0]:
        return taken
    if what < _OTHERS[0]:
        return _with_a_stroke(taken, room, random)
    return (_at_another_speed if what < _OTHERS[1] else _with_another_rest)(moves, room, random)


def _places(moves: Sequence[DesignedMove], room: Room) -> list[dict[str, float]]:
    """Return where the axes are before each move, and behind the last one."""
    place = {axis.letter: axis.start for axis in room.axes}
    found = [dict(place)]
    for move in moves:
        place |= {letter: value for letter, value in move.to.items() if letter in place}
        found.append(dict(place))
    return found


def _seconds(moves: Sequence[DesignedMove], room: Room) -> float:
    places, total = _places(moves, room), 0.0
    for before, after, move in zip(places[:-1], places[1:], moves, strict=True):
        way = math.hypot(*(after[letter] - before[letter] for letter in before))
        total += move.rest or room.time(0.5 * math.pi * move.radius or way, move.speed or room.feed)
    return total


def _without_a_stroke(moves: list[DesignedMove], room: Room, random: np.random.Generator) -> list[DesignedMove]:
    """Return moves without a way out and its way back, begun at a random place, or without the rest that stands there."""
    if not moves:
        return moves
    first = int(random.integers(len(moves)))
    if moves[first].rest:
        return moves[:first] + moves[first + 1 :]
    places = _places(moves, room)
    for last in range(first + 2, min(first + _FURTHEST_BACK, len(moves)) + 1):
        if any(move.radius for move in moves[first:last]):
            return moves
        if all(abs(places[last][letter] - value) < SAME_NUMBER for letter, value in places[first].items()):
            return moves[:first] + moves[last:]
    return moves


def _with_a_stroke(moves: list[DesignedMove], room: Room, random: np.random.Generator) -> list[DesignedMove]:
    """Return moves with a way out and back put in at a random place."""
    at = int(random.integers(len(moves) + 1))
    if at < len(moves) and moves[at].radius:
        return moves
    axis = room.axes[int(random.integers(len(room.axes)))]
    place = _places(moves, room)[at][axis.letter]
    target = _target(axis, place, random)
    if abs(target - place) < 0.5 * _SHORTEST_WAY:
        return moves
    speed = _speed(room, random)
    stroke = [DesignedMove({axis.letter: target}, speed), DesignedMove({axis.letter: place}, speed)]
    if random.random() < _RESTS and (room.dwells or room.idle is not None):
        stroke.insert(int(random.integers(1, 3)), DesignedMove(rest=round(_LONGEST_REST * float(random.random()), 3) or 1e-3))
    return moves[:at] + stroke + moves[at:]


def _target(axis: FreeAxis, place: float, random: np.random.Generator) -> float:
    longest = 0.4 * axis.stroke
    way = min(_SHORTEST_WAY, longest) * max(1.0, longest / _SHORTEST_WAY) ** float(random.random())
    target = place + way * float(random.choice([-1.0, 1.0]))
    if not axis.low <= target <= axis.high:
        target = 2.0 * place - target
    return float(np.round(min(max(target, axis.low), axis.high), 7))


def _at_another_speed(moves: list[DesignedMove], room: Room, random: np.random.Generator) -> list[DesignedMove]:
    at = int(random.integers(len(moves))) if moves else 0
    if not moves or moves[at].rest:
        return moves
    return [*moves[:at], dataclasses.replace(moves[at], speed=_speed(room, random)), *moves[at + 1 :]]


def _speed(room: Room, random: np.random.Generator) -> float:
    """Return a speed: most often the largest feed, at which a loop shows most of itself."""
    share = 1.0 if random.random() < _AS_FAST_AS_MAY_BE else _SLOWEST_SHARE ** float(random.random())
    return float(np.round(room.feed * share, 7))


def _with_another_rest(moves: list[DesignedMove], room: Room, random: np.random.Generator) -> list[DesignedMove]:
    """Return moves with a rest put in, or one that is there made longer or shorter."""
    if not (room.dwells or room.idle is not None):
        return moves
    rest = DesignedMove(rest=round(_LONGEST_REST * float(random.random()), 3) or 1e-3)
    rests = [place for place, move in enumerate(moves) if move.rest]
    if rests and random.random() < _REST_CHANGED:
        at = rests[int(random.integers(len(rests)))]
        return [*moves[:at], rest, *moves[at + 1 :]]
    at = int(random.integers(len(moves) + 1))
    return [*moves[:at], rest, *moves[at:]]


_SLOWER = 1.02
"""Share by which a program may take longer than its moves add up to: corners; assumed."""
_AFTER = 0.3
"""Time [s] that is recorded after the end of a program."""


@dataclass(frozen=True, eq=False)
class Laid:
    """A candidate program as the machine would run it: its text, its path table, and how long it is recorded [s]."""

    candidate: CandidateProgram
    text: str
    table: FloatArray
    seconds: float


def lay_candidate(candidate: CandidateProgram, room: Room, title: Sequence[str] = ()) -> Laid:
    """Return a candidate as path. Raises what the reading of a program raises where it leaves the travel or feed of the room."""
    text = program_text(title or [candidate.title], candidate.moves, room)
    axes = {axis.letter: axis for axis in (*room.axes, *([room.idle] if room.idle else []))}
    start = (axes["X"].start if "X" in axes else 0.0, axes["Z"].start if "Z" in axes else 0.0)
    program = interpret(read_program(text, "program.nc"), room.dialect, start=start)
    bounds = {f"{letter.lower()}_{side}": value for letter, axis in axes.items() for side, value in _reach(axis.low, axis.high, axis.start)}
    if room.turning is not None and room.turning.cuts:
        bounds["x_low"] = min(bounds["x_low"], room.turning.smallest_radius - 1e-6)
    table = lay_path(program, Limits(feed=room.feed * (1.0 + 1e-6), **bounds)).table
    return Laid(candidate, text, table, candidate.seconds * _SLOWER + _AFTER)


def walking_time(at_most: float) -> float:
    """Return how long the moves of a program may take that is recorded for ``at_most`` [s]."""
    return (at_most - _AFTER) / _SLOWER


def lay_those_that_fit(found: Sequence[CandidateProgram], room: Room, at_most: float) -> list[Laid]:
    """Return the candidates that stay within travel and feed as paths; raises :class:`LatheSimError` where none does."""
    laid = lay_what_fits(found, room, at_most)
    if not laid:
        fact = f"no program of at most {at_most:g} s fits into the travel of the machine."
        raise LatheSimError(fact, place="--at-most", remedy="Allow more time.")
    return laid


def lay_what_fits(found: Sequence[CandidateProgram], room: Room, at_most: float) -> list[Laid]:
    """Return those of the candidates that stay within travel, feed and time as paths: maybe none."""
    laid = []
    for candidate in found:
        try:
            laid.append(lay_candidate(candidate, room))
        except LatheSimError:
            continue
    return [program for program in laid if program.seconds <= at_most]


def _reach(low: float, high: float, start: float) -> tuple[tuple[str, float], tuple[str, float]]:
    """Return the travel of an axis, with the place where it begins."""
    return ("low", min(low, start) - 1e-6), ("high", max(high, start) + 1e-6)
