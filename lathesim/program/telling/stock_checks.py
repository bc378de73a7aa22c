"""Whether the tool meets the raw stock where it should not: rapid moves into it.

The stock is a bar with cells along Z, each with its outer radius; every cut lowers the cells that it passes. Feeding towards the axis, the
edge takes along what stands beside it towards the free end, as in facing. Left out: boring, where the tool works inside the bar.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lathesim.program.moves import Move, Program
from lathesim.program.words import Warned

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
                at = f"X {1e3 * x[first]:.4g} mm (radius), Z {1e3 * z[first]:.4g} mm"
                found[move.line] = Warned(move.line, f"The rapid goes into the stock at {at}. Feed there, or come from outside.")
        np.minimum.at(surface, places[inside], np.abs(x[inside]))
        if move.kind != "rapid" and abs(move.end_x) < abs(move.start_x) - _CELL:
            _take_along(surface, middles, move, bar)
    return list(found.values())[:_MOST_TOLD]


def _points(move: Move, cell: float) -> tuple[Cells, Cells]:
    """Return z and x along a move, two points a cell, so that rounding leaves none out."""
    count = min(_MOST_CELLS, max(2, math.ceil(2.0 * move.length / cell) + 1))
    share = np.linspace(0.0, 1.0, count)
    if move.arc is None:
        return move.start_z + share * (move.end_z - move.start_z), move.start_x + share * (move.end_x - move.start_x)
    angle = move.arc.start_angle + share * move.arc.sweep
    return move.arc.centre_z + move.arc.radius * np.cos(angle), move.arc.centre_x + move.arc.radius * np.sin(angle)


def _take_along(surface: Cells, middles: Cells, move: Move, bar: Bar) -> None:
    """Lower what stands between the tool and the free end, as far as the edge reaches."""
    side = 1.0 if bar.free_end > 0.0 else -1.0
    away = side * (middles - move.end_z)
    beside, ends = (away > 0.0) & (away < _EDGE), float(away.max())
    if ends <= _EDGE:
        surface[beside] = np.minimum(surface[beside], abs(move.end_x))
