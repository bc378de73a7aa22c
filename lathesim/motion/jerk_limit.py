"""Bounded jerk: the time law of each piece averaged over a width of time, and slowed where that still passes a limit."""

from __future__ import annotations

import numpy as np

from lathesim.motion.axis_limits import AxisLimits
from lathesim.motion.grid import Grid, Slower, ToolSpeed, pieces
from lathesim.motion.joint_path import FloatArray
from lathesim.motion.time_law import TimeLaw, joined, law_of, smoothed
from lathesim.motion.timing import motion_at

_ROUNDS = 30
"""Rounds of slowing where the averaged law passes a limit, before the whole piece is slowed."""
_ENOUGH = 1e-9
"""Share by which a limit may be passed: rounding."""
_GAIN = 1e-4
"""Share of the duration that a round must gain, or the rounds end after ``_PATIENCE`` of them."""
_PATIENCE = 6
_SHARES = (1e-9, 0.25, 0.5, 0.75, 1.0 - 1e-9)


def law_with_jerk(nodes: Grid, limits: AxisLimits, tool_speed: ToolSpeed | None, slower: Slower | None) -> TimeLaw:
    """Return the time law within velocity, acceleration and jerk; the acceleration is 0 at every stop."""
    return joined([_piece(piece, limits, tool_speed, slower) for piece in pieces(nodes)])


def _piece(nodes: Grid, limits: AxisLimits, tool_speed: ToolSpeed | None, slower: Slower | None) -> TimeLaw:
    """Return the law from one stop to the next: the shortest of the rounds, each slowed as a whole by what it passes a limit."""
    also = np.full(len(nodes.s), np.inf)
    best: TimeLaw | None = None
    width, idle = 0.0, 0
    for _ in range(_ROUNDS):
        b = nodes.quickest(limits, tool_speed, slower, also)
        raw = law_of(nodes.s, b)
        width = width or min(_width(nodes, limits), 0.5 * raw.duration)
        law = smoothed(raw, width)
        time, ratio = _ratios(nodes, law, limits)
        worst = float(ratio.max())
        worst = worst if worst > 1.0 + _ENOUGH else 1.0
        gained = best is None or law.duration * worst < (1.0 - _GAIN) * best.duration
        if best is None or law.duration * worst < best.duration:
            best = law.slowed(worst)
        idle = 0 if gained else idle + 1
        if worst <= 1.0 or idle >= _PATIENCE:
            break
        also = _tighter(nodes, law, b, also, time, ratio, width)
    assert best is not None
    return best


def _width(nodes: Grid, limits: AxisLimits) -> float:
    """Return the width of the average [s]: the largest share of path acceleration and path jerk that the axes allow along the path."""
    slope = np.abs(nodes.slopes(1, 0.5))
    with np.errstate(divide="ignore", invalid="ignore"):
        width = np.max(slope / limits.jerk, axis=1) / np.max(slope / limits.acceleration, axis=1)
    return float(np.nanmax(width))


def _ratios(nodes: Grid, law: TimeLaw, limits: AxisLimits) -> tuple[FloatArray, FloatArray]:
    """Return instants at and between the knots of the law, and by how much to slow down there so that all limits hold."""
    steps = np.diff(law.time)
    time = np.concatenate([law.time[:-1] + share * steps for share in _SHARES])
    _, v, a, j = motion_at(nodes.curve, law, time)
    speed = np.max(np.abs(v) / limits.velocity, axis=1)
    force = np.sqrt(np.max(np.abs(a) / limits.acceleration, axis=1))
    jerk = np.cbrt(np.max(np.abs(j) / limits.jerk, axis=1))
    return time, np.maximum(np.maximum(speed, force), jerk)


def _tighter(nodes: Grid, law: TimeLaw, b: FloatArray, also: FloatArray, time: FloatArray, ratio: FloatArray, width: float) -> FloatArray:
    """Return bounds of b that are tighter where the averaged law passes a limit: over the whole width that was averaged there."""
    over = np.flatnonzero(ratio > 1.0 + _ENOUGH)
    from_place, to_place = law.at(time[over] - width)[0], law.at(time[over])[0]
    first = np.maximum(np.searchsorted(nodes.s, from_place, side="left") - 1, 0)
    last = np.minimum(np.searchsorted(nodes.s, to_place, side="right"), len(nodes.s) - 1)
    share = np.ones(len(nodes.s))
    order = np.argsort(ratio[over])
    # the largest are written last and stay; stretches that a larger one covers as a whole cost nothing more
    for at in order[-4000:]:
        share[first[at] : last[at] + 1] = ratio[over[at]] ** -2.0
    tighter: FloatArray = np.where(share < 1.0, np.minimum(also, b * share), also)
    return tighter
