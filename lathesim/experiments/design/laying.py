"""A candidate program to the path that a machine walks: written, read back and laid as any part program is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lathesim.engine.assembly import FloatArray
from lathesim.errors import LatheSimError
from lathesim.experiments.design.families import Candidate
from lathesim.experiments.design.program_text import program_text
from lathesim.experiments.design.room import Room
from lathesim.program.interpreter import interpret
from lathesim.program.path import Limits, lay_path
from lathesim.program.words import read_program

_SLOWER = 1.02
"""Share by which a program may take longer than its moves add up to: corners; assumed."""
_AFTER = 0.3
"""Time [s] that is recorded after the end of a program."""


@dataclass(frozen=True, eq=False)
class Laid:
    """A candidate program as the machine would run it: its text, its path table, and how long it is recorded [s]."""

    candidate: Candidate
    text: str
    table: FloatArray
    seconds: float


def lay_candidate(candidate: Candidate, room: Room, title: Sequence[str] = ()) -> Laid:
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


def lay_those_that_fit(found: Sequence[Candidate], room: Room, at_most: float) -> list[Laid]:
    """Return the candidates that stay within travel and feed as paths; raises :class:`LatheSimError` where none does."""
    laid = lay_what_fits(found, room, at_most)
    if not laid:
        fact = f"no program of at most {at_most:g} s fits into the travel of the machine."
        raise LatheSimError(fact, place="--at-most", remedy="Allow more time.")
    return laid


def lay_what_fits(found: Sequence[Candidate], room: Room, at_most: float) -> list[Laid]:
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
