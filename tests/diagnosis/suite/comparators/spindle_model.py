"""A grey box of a spindle, coded by hand: logged torque and load in, encoder and tachometer out, five exact steps a sample."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from tests.diagnosis.suite.comparators.read_case import PERIOD

STEPS = 5


class SpindleNumbers(NamedTuple):
    """Numbers of the grey box [SI]; zero (or a huge limit) means absent. Waves are given by their sine and cosine."""

    inertia: float = 0.02
    viscous: float = 0.01
    gain: float = 0.0153
    dry: float = 0.0
    dry_difference: float = 0.0
    limit: float = 1e9
    ripple_sin: float = 0.0
    ripple_cos: float = 0.0
    ripple_order: float = 1.0
    share_sin: float = 0.0
    share_cos: float = 0.0
    share_order: float = 1.0
    disc_sin: float = 0.0
    disc_cos: float = 0.0
    tacho_sin: float = 0.0
    tacho_cos: float = 0.0
    tacho_order: float = 1.0
    gain_error: float = 0.0
    creep: float = 0.0
    droop: float = 0.0
    response: float = 0.2
    filter_time: float = 0.0


@njit(cache=True, error_model="numpy")
def simulate_spindle_numbers(p: SpindleNumbers, torque: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Return encoder angle [rad] and tachometer voltage [V], shape (2, samples)."""
    samples = torque.shape[0]
    out = np.zeros((2, samples))
    h = PERIOD / STEPS
    rate = p.viscous / p.inertia
    keep = math.exp(-rate * h)
    weight = (1.0 - keep) / rate / p.inertia if rate > 1e-9 else h / p.inertia
    lagging = 1.0 - math.exp(-h / p.response)
    filtering = 1.0 - math.exp(-h / p.filter_time) if p.filter_time > 0.0 else 1.0
    angle, speed, lag, filtered = 0.0, 0.0, 0.0, 0.0
    for k in range(samples):
        acting = min(max(torque[k], -p.limit), p.limit)
        for step in range(STEPS):
            seen = (speed * (1.0 - p.creep * abs(load[k])) - p.droop * lag) * (1.0 + p.gain_error)
            if p.tacho_sin != 0.0 or p.tacho_cos != 0.0:
                seen *= 1.0 + p.tacho_sin * math.sin(p.tacho_order * angle) + p.tacho_cos * math.cos(p.tacho_order * angle)
            if step == 0:
                out[0, k] = angle + p.disc_sin * math.sin(angle) + p.disc_cos * math.cos(angle)
                out[1, k] = p.gain * (filtered if p.filter_time > 0.0 else seen)
            filtered += (seen - filtered) * filtering
            lag += (load[k] - lag) * lagging
            push = acting - load[k]
            if p.ripple_sin != 0.0 or p.ripple_cos != 0.0:
                push -= p.ripple_sin * math.sin(p.ripple_order * angle) + p.ripple_cos * math.cos(p.ripple_order * angle)
            if p.share_sin != 0.0 or p.share_cos != 0.0:
                push -= acting * (p.share_sin * math.sin(p.share_order * angle) + p.share_cos * math.cos(p.share_order * angle))
            free = speed * keep + push * weight
            sign = 1.0 if free > 0.0 else -1.0
            grip = max(p.dry + p.dry_difference * sign, 0.0) * weight
            after = 0.0 if abs(free) <= grip else free - sign * grip
            angle += 0.5 * h * (speed + after)
            speed = after
        if not abs(angle) < 1e9:
            out[:, k:] = np.nan
            break
    return out
