"""Random programs cut the same in a second reading from the manuals, to a micrometre."""

from __future__ import annotations

import itertools
import math

import pytest

from lathesim.program.interpreter import interpret
from lathesim.program.moves import Move
from lathesim.program.words import read_program
from tests.program import random_programs
from tests.program.independent_reading import Cut, cuts_of

_MICRON = 1e-3
_PECKED = {"G74", "G75", "G81", "G82", "G83"}
_ROUGHED = {"G71", "G72"}


def _cut(move: Move, kind: str = "") -> Cut:
    feed = (move.feed or 0.0) * 1e3 * (1.0 if move.mode.per_revolution else 60.0)
    begin, end = (1e3 * move.start_x, 1e3 * move.start_z), (1e3 * move.end_x, 1e3 * move.end_z)
    return Cut(kind or move.kind, begin, end, feed, move.arc.sweep if move.arc else 0.0, move.mode.start_angle)


def _of_roughing(moves: list[Move], across: bool) -> list[Cut]:
    """Return the level passes and the pass along the contour; how the tool withdraws is the control's."""
    while moves and moves[-1].kind == "rapid":
        moves.pop()
    last_rapid = max(place for place, move in enumerate(moves) if move.kind == "rapid")
    levels = [
        _cut(move, "level")
        for move in moves[:last_rapid]
        if move.kind == "feed" and abs((move.end_z - move.start_z) if across else (move.end_x - move.start_x)) < 1e-9
    ]
    return levels + [_cut(move) for move in moves[last_rapid + 1 :]]


def simulated_cuts(text: str, dialect: str) -> list[Cut]:
    """Return what the program makes of a text, as cuts."""
    found: list[Cut] = []
    moves = interpret(read_program(text), dialect).moves
    for (cycle, _), group in itertools.groupby(moves, key=lambda move: (move.mode.cycle, move.mode.cycle_line)):
        if cycle in _ROUGHED:
            found += _of_roughing(list(group), across=cycle == "G72")
        else:
            kinds = ("feed", "arc", "thread")
            found += [_cut(move, "bottom" if cycle in _PECKED else "") for move in group if move.kind in kinds and move.length > 1e-9]
    return found


def difference(expected: Cut, found: Cut) -> float:
    """Return how far two cuts are apart [mm]; infinite where they are of different kinds."""
    pairs = ((expected.value, found.value), (expected.sweep, found.sweep), (expected.start_angle, found.start_angle))
    if expected.kind != found.kind or any(abs(one - other) > 1e-5 for one, other in pairs):
        return math.inf
    begin = 0.0 if expected.kind == "bottom" else math.dist(expected.begin, found.begin)
    return max(begin, math.dist(expected.end, found.end))


def differences(dialect: str, seed: int) -> list[str]:
    """Return where the two readings of a random program differ by more than a micrometre."""
    text = random_programs.program(dialect, seed)
    expected, found = cuts_of(text, dialect), simulated_cuts(text, dialect)
    pairs = list(itertools.zip_longest(expected, found))
    wrong = [f"{one} against {other}" for one, other in pairs if one is None or other is None or difference(one, other) > _MICRON]
    return [f"{dialect} {seed}: {wrong[0]} and {len(wrong) - 1} more\n{text}"] if wrong else []


@pytest.mark.parametrize("dialect", random_programs.DIALECTS)
def test_random_programs_cut_the_same_in_a_second_reading(dialect: str) -> None:
    assert [problem for seed in range(12) for problem in differences(dialect, seed)] == []


@pytest.mark.slow
@pytest.mark.parametrize("dialect", random_programs.DIALECTS)
def test_two_hundred_random_programs_cut_the_same_in_a_second_reading(dialect: str) -> None:
    assert [problem for seed in range(1000, 1200) for problem in differences(dialect, seed)] == []
