"""The quickest timing of a path within the limits of its axes."""

from __future__ import annotations

import numpy as np

from lathesim.motion.axis_limits import AxisLimits
from lathesim.motion.grid import Grid, Slower, ToolSpeed, first_grid, pieces
from lathesim.motion.joint_path import RETRACTION, FloatArray, JointPath, fit_curve
from lathesim.motion.time_law import TimeLaw, Timing, joined, law_of, motion_at, smoothed

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
    return time, np.maximum(np.maximum(speed, force), np.cbrt(np.max(np.abs(j) / limits.jerk, axis=1)))


def _tighter(nodes: Grid, law: TimeLaw, b: FloatArray, also: FloatArray, time: FloatArray, ratio: FloatArray, width: float) -> FloatArray:
    """Return bounds of b that are tighter where the averaged law passes a limit: over the whole width that was averaged there."""
    over = np.flatnonzero(ratio > 1.0 + _ENOUGH)
    from_place, to_place = law.at(time[over] - width)[0], law.at(time[over])[0]
    first = np.maximum(np.searchsorted(nodes.s, from_place, side="left") - 1, 0)
    last = np.minimum(np.searchsorted(nodes.s, to_place, side="right"), len(nodes.s) - 1)
    share = np.ones(len(nodes.s))
    # the largest are written last and stay; stretches that a larger one covers as a whole cost nothing more
    for at in np.argsort(ratio[over])[-4000:]:
        share[first[at] : last[at] + 1] = ratio[over[at]] ** -2.0
    tighter: FloatArray = np.where(share < 1.0, np.minimum(also, b * share), also)
    return tighter


GRID = 1000
"""Segments that a path gets at least; every sample is a node."""
_REFINEMENTS = 4
"""Times the grid is halved where a limit is passed between two nodes."""


def retime(
    path: JointPath,
    limits: AxisLimits,
    *,
    jerk: bool = False,
    grid: int = GRID,
    tool_speed: ToolSpeed | None = None,
    slower: Slower | None = None,
    retraction: float = RETRACTION,
) -> Timing:
    """Return the quickest timing of a path from rest to rest.

    The limits are velocity and acceleration of each axis at both ends of every segment of a grid, the feed at the tool where
    ``tool_speed`` gives the way of the tip per s, and with ``jerk`` the jerk too, by averaging the time law. ``slower`` gives, at values of
    s, the share (0, 1] of the speed that is allowed there. A path that stands is answered with a motion of 0 s.
    """
    curve = fit_curve(path.positions, limits.velocity, retraction)
    if len(curve.knots) < 2:
        zero = np.zeros(1)
        return Timing(path, curve, TimeLaw(zero, zero, zero, zero, zero))
    nodes = first_grid(curve, grid)
    b = nodes.quickest(limits, tool_speed, slower)
    for _ in range(_REFINEMENTS):
        passed = nodes.passed(b, limits)
        if not passed.any():
            break
        nodes = nodes.halved(passed)
        b = nodes.quickest(limits, tool_speed, slower)
    if jerk and np.isfinite(limits.jerk).any():
        return Timing(path, curve, law_with_jerk(nodes, limits, tool_speed, slower))
    law = law_of(nodes.s, b)
    factor = nodes.largest_ratio(b, limits)
    return Timing(path, curve, law.slowed(factor) if factor > 1.0 else law)


_BETWEEN = (1e-9, 0.5, 1.0 - 1e-9)
"""Shares of a segment at which the speed is looked at."""


def elastic_rate(timing: Timing, limits: AxisLimits, kept_free: float, period: float) -> float:
    """Return the largest change of the playback rate a ``period`` [s] with which every axis keeps its limit of acceleration.

    Played at a rate r an axis accelerates by r^2 a + v dr/dt, and |dr/dt| <= rho / T. With |a| <= (1 - f) A that is within A where
    rho <= f A T / |v|, f the share ``kept_free``.
    """
    steps = np.diff(timing.law.time)
    if not len(steps):
        return 1.0
    speed = np.abs(timing.at(np.concatenate([timing.law.time[:-1] + share * steps for share in _BETWEEN]))[1]).max(axis=0)
    rates = kept_free * np.asarray(limits.acceleration) * period / np.maximum(speed, 1e-300)
    return float(min(1.0, rates.min()))
