"""The grooving and pecking cycles G74 (along Z) and G75 (across): in by steps, a little back, on, out, and aside.

Source: Fanuc 0i-T operator's manual, end face peck drilling cycle and outer diameter drilling cycle. Left out: the relief at the bottom.
"""

from __future__ import annotations

import math

from lathesim.program.cycles.step import Point, Step

_EPSILON = 1e-9


def pecking(start: Point, end: Point, *, across: bool, step: float, aside: float, retract: float) -> list[Step]:
    """Return the cycle: pecks of ``step`` along Z (along X with ``across``), withdrawn by ``retract``, repeated every ``aside`` [m].

    No retract is longer than the depth cut so far, so the tool does not move back beyond the start.
    """
    deep, wide = (0, 1) if across else (1, 0)
    steps: list[Step] = []
    for place in _places(start[wide], end[wide], aside):
        steps.append(Step("rapid", _point(deep, start[deep], place)))
        depths = _places(start[deep], end[deep], step)[1:]
        for number, depth in enumerate(depths):
            steps.append(Step("feed", _point(deep, depth, place)))
            if number < len(depths) - 1:
                back = math.copysign(min(retract, abs(depth - start[deep])), start[deep] - end[deep])
                steps.append(Step("rapid", _point(deep, depth + back, place)))
        steps.append(Step("rapid", _point(deep, start[deep], place)))
    return [*steps, Step("rapid", start)]


def _places(begin: float, end: float, step: float) -> list[float]:
    """Return the places from begin to end, ``step`` apart and the last at the end; all at once without a step."""
    way = end - begin
    if abs(way) < _EPSILON:
        return [begin]
    count = max(1, -int(-(abs(way) - _EPSILON) // step)) if step > 0.0 else 1
    sign = 1.0 if way > 0.0 else -1.0
    return [begin, *(begin + sign * step * number for number in range(1, count)), end]


def _point(deep: int, depth: float, place: float) -> Point:
    return (depth, place) if deep == 0 else (place, depth)
