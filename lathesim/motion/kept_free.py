"""What a share of the accelerations that is kept free is good for: playback that slows down when a buffer runs low."""

from __future__ import annotations

import numpy as np

from lathesim.motion.axis_limits import AxisLimits
from lathesim.motion.timing import Timing

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
    time = np.concatenate([timing.law.time[:-1] + share * steps for share in _BETWEEN])
    speed = np.abs(timing.at(time)[1]).max(axis=0)
    rates = kept_free * np.asarray(limits.acceleration) * period / np.maximum(speed, 1e-300)
    return float(min(1.0, rates.min()))
