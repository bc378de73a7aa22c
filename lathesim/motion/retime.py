"""The quickest timing of a path within the limits of its axes."""

from __future__ import annotations

import numpy as np

from lathesim.motion.axis_limits import AxisLimits
from lathesim.motion.curve import RETRACTION, fit_curve
from lathesim.motion.grid import Slower, ToolSpeed, first_grid
from lathesim.motion.joint_path import JointPath
from lathesim.motion.time_law import TimeLaw, law_of
from lathesim.motion.timing import Timing

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
        from lathesim.motion.jerk_limit import law_with_jerk

        return Timing(path, curve, law_with_jerk(nodes, limits, tool_speed, slower))
    law = law_of(nodes.s, b)
    factor = nodes.largest_ratio(b, limits)
    return Timing(path, curve, law.slowed(factor) if factor > 1.0 else law)
