"""What every expanded cycle has to keep, checked on its moves alone; each returns the problems found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from lathesim.program.moves import Move

_STEP = 0.05e-3
_SLACK = 0.02e-3
Point = tuple[float, float]


def points(move: Move, across: bool = False) -> list[Point]:
    """Return points (depth, along) of a move: (x, z), with ``across`` (z, x)."""
    count = max(2, math.ceil(move.length / (0.4 * _STEP)))
    found = []
    for share in [place / count for place in range(count + 1)]:
        if move.arc is None:
            x, z = move.start_x + share * (move.end_x - move.start_x), move.start_z + share * (move.end_z - move.start_z)
        else:
            angle = move.arc.start_angle + share * move.arc.sweep
            x, z = move.arc.centre_x + move.arc.radius * math.sin(angle), move.arc.centre_z + move.arc.radius * math.cos(angle)
        found.append((z, x) if across else (x, z))
    return found


def from_start_to_start(moves: Sequence[Move]) -> list[str]:
    """The moves hang together, and the cycle ends where it began."""
    found = [f"a jump before line {b.line}" for a, b in pairwise(moves) if math.hypot(a.end_x - b.start_x, a.end_z - b.start_z) > 1e-9]
    away = math.hypot(moves[-1].end_x - moves[0].start_x, moves[-1].end_z - moves[0].start_z)
    return [*found, *(["it does not end where it began"] if away > 1e-9 else [])]


def roughing(
    moves: Sequence[Move], contour: Sequence[Move], *, allow_x: float, allow_z: float, depth: float, across: bool = False
) -> list[str]:
    """Nothing is cut into the contour with its allowance, nothing more than the allowance is left, and no pass is deeper than told.

    ``contour`` are the finishing moves that cut; lengths [m], ``allow_x`` as a radius.
    """
    shift = (allow_z, allow_x) if across else (allow_x, allow_z)
    start = (moves[0].start_z, moves[0].start_x) if across else (moves[0].start_x, moves[0].start_z)
    wall = [(d + shift[0], a + shift[1]) for move in contour for d, a in points(move, across)]
    side = 1.0 if start[0] >= max(d for d, _ in wall) - shift[0] - 1e-9 else -1.0
    edge: dict[int, float] = {}
    for d, a in wall:
        key = round(a / _STEP)
        edge[key] = max(edge.get(key, -math.inf), side * d)
    inner = {key for key in edge if key - 1 in edge and key + 1 in edge}
    inner -= set(sorted(inner)[:3]) | set(sorted(inner)[-3:])
    reached: dict[int, float] = {}
    found: list[str] = []
    for move in moves:
        for d, a in points(move, across):
            key = round(a / _STEP)
            if key in inner:
                if side * d < min(edge[key - 1], edge[key], edge[key + 1]) - _SLACK:
                    found.append(f"{move.kind} cuts into the contour at {1e3 * d:.3f}, {1e3 * a:.3f} mm")
                    break
                if move.kind != "rapid":
                    reached[key] = min(reached.get(key, math.inf), side * d)
    for key in sorted(inner):
        if edge[key] < side * start[0] - 1e-9 and reached.get(key, math.inf) > max(edge[key - 1], edge[key], edge[key + 1]) + _SLACK:
            found.append(f"too much is left at {1e3 * key * _STEP:.2f} mm")
            break
    level = [move for move in moves if move.kind == "feed" and _is_level(move, across)]
    depths = sorted({round(side * (move.end_z if across else move.end_x), 9) for move in level}, reverse=True)
    for here, there in pairwise([side * start[0] + shift[0], *depths]):
        if here - there > depth + _SLACK:
            found.append(f"a pass of {1e3 * (here - there):.3f} mm")
    return [*from_start_to_start(moves), *found]


def _is_level(move: Move, across: bool) -> bool:
    flat, along = (move.end_z - move.start_z, move.end_x - move.start_x)
    return abs(flat if across else along) < 1e-9 and abs(along if across else flat) > 0.2e-3
