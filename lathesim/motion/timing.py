"""A path with its times: the noun that retiming gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.motion.curve import Curve
from lathesim.motion.joint_path import FloatArray, JointPath
from lathesim.motion.time_law import TimeLaw


@dataclass(frozen=True, eq=False)
class Timing:
    """A path with its times: ``curve`` q(s) and ``law`` s(t)."""

    path: JointPath
    curve: Curve
    law: TimeLaw

    @property
    def duration(self) -> float:
        """Return how long the motion lasts [s]."""
        return self.law.duration

    def at(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return positions, velocities, accelerations and jerks of the axes at instants [s], each (instants, axes)."""
        return motion_at(self.curve, self.law, time)


def motion_at(curve: Curve, law: TimeLaw, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return q and its first three derivatives by t: q' s', q' s'' + q'' s'^2, q' s''' + 3 q'' s' s'' + q''' s'^3."""
    s, v, a, j = (rate[:, None] for rate in law.at(np.asarray(time, dtype=np.float64)))
    spans = np.clip(np.searchsorted(curve.knots, s[:, 0], side="right") - 1, 0, max(0, len(curve.knots) - 2))
    if len(curve.stops) > 2:
        # s at a retraction may be rounded to either side of it; which of the two directions is meant is known from the time
        piece = np.clip(np.searchsorted(curve.knots[curve.stops], law.going_through(time), side="right") - 1, 0, len(curve.stops) - 2)
        spans = np.clip(spans, curve.stops[piece], curve.stops[piece + 1] - 1)
    offsets = s[:, 0] - curve.knots[spans]
    q, q1, q2, q3 = (curve.derivative(order, spans, offsets) for order in range(4))
    return q, q1 * v, q1 * a + q2 * v * v, q1 * j + 3.0 * q2 * v * a + q3 * v**3
