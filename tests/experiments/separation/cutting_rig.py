"""The cut of the truth: chip area from feed and depth, forces at the sample instants, states by exact exponentials.

Sources: Altintas, Manufacturing Automation, 2nd ed. (2012), sec. 2.3 (edge and shear force); Kienzle (1952).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

PERIOD = 1e-3


class CuttingPhysics(NamedTuple):
    """Numbers of the cut [SI]; zero means absent."""

    specific_force: float = 1.8e9
    thrust_ratio: float = 0.4
    feed_ratio: float = 0.5
    radius: float = 0.02
    exponent: float = 0.0
    edge: float = 0.0
    speed_exponent: float = 0.0
    hump: float = 0.0
    hump_speed: float = 0.7
    hump_width: float = 0.3
    softening: float = 0.0
    softening_time: float = 3.0
    slot: float = 0.0
    slot_width: float = 0.1
    slot_middle: float = 0.0
    spot: float = 0.0
    spot_width: float = 0.05
    spot_middle: float = 0.0
    runout: float = 0.0
    runout_order: float = 1.0
    runout_phase: float = 0.0


def simulate_cutting(physics: CuttingPhysics, feed: np.ndarray, depth: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Return main, thrust and feed force [N], shape (3, samples), without noise; feed [m/rev], depth [m], speed [m/s] at 1 kHz."""
    result: np.ndarray = _simulate(physics, feed, depth, speed)
    return result


@njit(cache=True)
def _turned(away: float) -> float:
    return abs(away - 2.0 * math.pi * math.floor(away / (2.0 * math.pi) + 0.5))


@njit(cache=True)
def _shape(p: CuttingPhysics, angle: float, depth: float) -> float:
    """Factor of the force at an angle: slot (a hard gate), hard spot, runout."""
    factor = 1.0
    if p.slot > 0.0 and _turned(angle - p.slot_middle) < math.pi * p.slot_width:
        factor -= p.slot
    if p.spot > 0.0:
        away = _turned(angle - p.spot_middle) / (math.pi * p.spot_width)
        factor += p.spot * math.exp(-0.5 * away * away)
    if p.runout > 0.0:
        factor *= max(0.0, 1.0 + p.runout * math.cos(p.runout_order * angle + p.runout_phase) / depth)
    return factor


@njit(cache=True)
def _simulate(p: CuttingPhysics, feed: np.ndarray, depth: np.ndarray, speed: np.ndarray) -> np.ndarray:
    samples = feed.shape[0]
    out = np.zeros((3, samples))
    angle, warmth = 0.0, 0.0
    ratios = np.array([1.0, p.thrust_ratio, p.feed_ratio])
    edges = np.array([1.0, 1.4, 1.2])
    for k in range(samples):
        cuts = feed[k] > 0.0 and depth[k] > 0.0 and speed[k] > 0.0
        shape = 0.0
        force = np.zeros(3)
        if cuts:
            shape = _shape(p, angle, depth[k])
            area = p.specific_force * feed[k] * depth[k] * (feed[k] / 1e-3) ** (-p.exponent)
            pace = (speed[k] / 2.0) ** p.speed_exponent
            beside = (speed[k] - p.hump_speed) / p.hump_width
            pace *= 1.0 + p.hump * math.exp(-beside * beside)
            slow = 1.0 - p.softening * warmth
            for row in range(3):
                force[row] = ratios[row] * area * pace * slow * shape + p.edge * edges[row] * ratios[row] * depth[k] * shape
            warmth += (1.0 - warmth) * (1.0 - math.exp(-PERIOD / p.softening_time))
        else:
            warmth *= math.exp(-PERIOD / p.softening_time)
        for row in range(3):
            out[row, k] = force[row]
        angle += PERIOD * speed[k] / p.radius
    return out
