"""What is odd in a program that can be read: checks before anything is cut, each a warning with its line and what to do.

Whether the tool meets the raw stock where it should not: rapid moves into it.

The stock is a bar with cells along Z, each with its outer radius; every cut lowers the cells that it passes. Feeding towards the axis, the
edge takes along what stands beside it towards the free end, as in facing. Left out: boring, where the tool works inside the bar.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lathesim.program.dialects import dialect_named
from lathesim.program.meanings import Meaning
from lathesim.program.moves import CUTTING, KINDS, Move, Program, Spindle
from lathesim.program.words import Blocks, Warned
from lathesim.units import in_unit

_BEYOND_AXIS = -1e-3
"""[m] how far beyond the spindle's axis a facing cut goes at most, assumed: twice a nose radius of 0.4 mm and a little."""
_SAME = 1e-9
_LEADS_TO_RUN_UP = 2.0
"""How many leads a thread should have to run up to its speed, assumed: a rule of thumb of shops is three."""
_LARGE_FEED = 2e-3
"""[m] per revolution above which a feed is a slip, assumed: ten times a roughing feed."""
_WITHOUT_POINT = re.compile(r"[XZUW]\s*[+-]?\s*[0-9]{4,}(?![0-9.])", re.IGNORECASE)
_STEPS_LIKELY = 1000.0
"""A position of so many units without a decimal point is likely meant in the least steps of the control, assumed."""


def checked(program: Program, blocks: Blocks | None = None) -> list[Warned]:
    """Return warnings about a program that has been interpreted, the first of each sort; ``blocks`` adds what only its text shows."""
    found: list[Warned] = []
    for check in (_units, _beyond_axis, _without_limit, _thread_in_surface_speed, _large_feeds, _run_up):
        found += _first(check(program))
    if blocks is not None:
        found += _first(_decimal_points(program, blocks))
    return sorted(found, key=lambda warned: warned.line)


def _first(warnings: Iterator[Warned]) -> list[Warned]:
    warned = next(warnings, None)
    return [] if warned is None else [warned]


def _units(program: Program) -> Iterator[Warned]:
    taken = program.assumed.get("units")
    if taken and program.moves:
        codes = dialect_named(program.dialect).codes
        named = " or ".join(code for code, meaning in codes.items() if meaning in (Meaning.INCH, Meaning.MILLIMETRE))
        yield Warned(program.moves[0].line, f"No {named} stands before the first move, so {taken} are assumed. Write the units.")


def _beyond_axis(program: Program) -> Iterator[Warned]:
    moves = program.moves
    ends = moves.ends[2::4]
    if min(ends, default=0.0) >= _BEYOND_AXIS or sum(x > _SAME for x in ends) <= sum(x < -_SAME for x in ends):
        return  # no cut beyond the axis, or the tool stands on the other side
    for move in moves.where(lambda kind, mode, feed: kind in CUTTING):
        if move.end_x < _BEYOND_AXIS:
            x = f"X {in_unit(move.end_x, 'mm')} (radius)"
            yield Warned(move.line, f"The cut goes beyond the spindle's axis, to {x}. Check the sign and whether X is a diameter.")


def _without_limit(program: Program) -> Iterator[Warned]:
    for move in program.moves.where(lambda kind, mode, feed: kind in CUTTING and _unlimited(mode.spindle)):
        smallest = min(abs(move.start_x), abs(move.end_x))
        rpm = 30.0 / math.pi * move.mode.spindle.speed / smallest if smallest > _SAME else math.inf
        speeds = "without bound" if math.isinf(rpm) else f"at up to {rpm:.0f} rpm"
        table = dialect_named(program.dialect)
        how = ", as a D word beside G96" if table.roles.surface_limit else ", as G50 S2500" if table.program.number else ""
        yield Warned(move.line, f"The spindle runs {speeds} under constant surface speed. Write a speed limit before it{how}.")


def _unlimited(spindle: Spindle) -> bool:
    return spindle.direction != 0 and spindle.surface and spindle.limit is None


def _thread_in_surface_speed(program: Program) -> Iterator[Warned]:
    for move in program.moves.where(lambda kind, mode, feed: kind == "thread" and mode.spindle.surface):
        yield Warned(
            move.line, "A thread is cut under constant surface speed, so its passes turn at different speeds. Write G97 before it."
        )


def _large_feeds(program: Program) -> Iterator[Warned]:
    for move in program.moves.where(lambda kind, mode, feed: kind in ("feed", "arc") and mode.per_revolution and feed > _LARGE_FEED):
        fact = f"The feed is {in_unit(move.feed or 0.0, 'mm')} per revolution."
        yield Warned(move.line, f"{fact} If it is meant per minute, choose that mode before F.")


def _run_up(program: Program) -> Iterator[Warned]:
    """Warn of threads that are too short to run up; chained threads count as one."""
    moves, place, before = program.moves, 0, ""
    for number, group in itertools.groupby(moves.kinds if "thread" in moves.counts else ()):
        count = sum(1 for _ in group)
        if KINDS[number] == "thread" and before == "rapid":
            chain = itertools.takewhile(lambda move: not move.mode.spin_back, moves[place : place + count])
            leads = math.fsum(move.length / move.feed for move in chain if move.feed)
            if leads < _LEADS_TO_RUN_UP - _SAME:
                yield Warned(moves.lines[place], f"The thread is only {leads:.2g} leads long, too short to run up to its speed.")
        place, before = place + count, KINDS[number]


def _decimal_points(program: Program, blocks: Blocks) -> Iterator[Warned]:
    """Positions without a decimal point: a control set to its least increment reads them in steps of it."""
    if not dialect_named(program.dialect).roles.least_increments:
        return
    for block in blocks.matching(_WITHOUT_POINT):
        for word in block.words:
            if word.letter in "XZUW" and word.expression is None and "." not in word.text and abs(word.value) >= _STEPS_LIKELY:
                sentence = f"{word.text} has no decimal point and is read in whole units."
                yield Warned(block.line, f"{sentence} Write the point if the control counts in its least steps.")


Cells = npt.NDArray[np.float64]

_CELL = 0.05e-3
_MOST_CELLS = 20_000
_TOUCH = 0.02e-3
"""[m] how deep a rapid may touch the stock, assumed: the resolution of the cells and of the allowances of roughing."""
_EDGE = 5e-3
"""[m] what the edge takes along when facing, assumed: the edge of a common insert."""
_MOST_TOLD = 5


@dataclass(frozen=True)
class Bar:
    """A raw bar [m]: its radius, from ``face`` (the end at smaller z) over ``length``; ``free_end`` is 1 where that lies at larger z."""

    radius: float
    face: float
    length: float
    free_end: float = 1.0


def meets_stock(program: Program, bar: Bar) -> list[Warned]:
    """Return a warning for each line, at most five, that moves in rapid through material."""
    cell = max(_CELL, bar.length / _MOST_CELLS)
    surface: Cells = np.full(max(1, round(bar.length / cell)), bar.radius, dtype=np.float64)
    middles: Cells = bar.face + cell * (np.arange(len(surface), dtype=np.float64) + 0.5)
    found: dict[int, Warned] = {}
    for move in program.moves:
        if move.kind == "dwell":
            continue
        z, x = _points(move, cell)
        places = np.floor((z - bar.face) / cell).astype(int)
        inside = (places >= 0) & (places < len(surface))
        if move.kind == "rapid":
            lower = np.minimum(np.minimum(surface, np.roll(surface, 1)), np.roll(surface, -1))  # a wall may stand in the next cell
            deep = inside.copy()
            deep[inside] = np.abs(x[inside]) < lower[places[inside]] - _TOUCH
            if deep.any() and move.line not in found:
                first = int(np.argmax(deep))
                at = f"X {in_unit(x[first], 'mm')} (radius), Z {in_unit(z[first], 'mm')}"
                found[move.line] = Warned(move.line, f"The rapid goes into the stock at {at}. Feed there, or come from outside.")
        np.minimum.at(surface, places[inside], np.abs(x[inside]))
        if move.kind != "rapid" and abs(move.end_x) < abs(move.start_x) - _CELL:
            _take_along(surface, middles, move, bar)
    return list(found.values())[:_MOST_TOLD]


def _points(move: Move, cell: float) -> tuple[Cells, Cells]:
    """Return z and x along a move, two points a cell, so that rounding leaves none out."""
    share = np.linspace(0.0, 1.0, min(_MOST_CELLS, max(2, math.ceil(2.0 * move.length / cell) + 1)))
    if move.arc is None:
        return move.start_z + share * (move.end_z - move.start_z), move.start_x + share * (move.end_x - move.start_x)
    angle = move.arc.start_angle + share * move.arc.sweep
    return move.arc.centre_z + move.arc.radius * np.cos(angle), move.arc.centre_x + move.arc.radius * np.sin(angle)


def _take_along(surface: Cells, middles: Cells, move: Move, bar: Bar) -> None:
    """Lower what stands between the tool and the free end, as far as the edge reaches."""
    away = (1.0 if bar.free_end > 0.0 else -1.0) * (middles - move.end_z)
    beside, ends = (away > 0.0) & (away < _EDGE), float(away.max())
    if ends <= _EDGE:
        surface[beside] = np.minimum(surface[beside], abs(move.end_x))
