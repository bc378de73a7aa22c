"""A reading of cuts that shares no code with the program: semi-discretization of x' = A x + b(t) (c . x(t - tau) - c . x(t)).

The delay is cut into steps; over a step the delayed tip is its mean and the coefficient b(t) is integrated. The map of a delay is a
matrix, whose largest eigenvalue is the multiplier. Errors fall with the square of the step, so two step sizes give a better value. Source:
T. Insperger, G. Stepan, Int. J. Numer. Meth. Eng. 61 (2004).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import scipy.linalg

ModeRow = tuple[float, float, float, float, float]
"""Frequency [Hz], damping ratio, stiffness [N/m], share of the cutting force that counts, and share of a drag along the normal."""


def radius(modes: Sequence[ModeRow], push: Callable[[float], float], drag: float, delay: float, steps: int = 160) -> float:
    """Return the size of the largest multiplier; ``push`` is the force per tip difference [N/m] over time, ``drag`` [N*s/m]."""
    coarse, fine = (_radius(modes, push, drag, delay, count) for count in (steps, 2 * steps))
    return math.exp((4.0 * math.log(fine) - math.log(coarse)) / 3.0)


def _radius(modes: Sequence[ModeRow], push: Callable[[float], float], drag: float, delay: float, steps: int) -> float:
    size = 2 * len(modes)
    free, force = np.zeros((size, size)), np.zeros(size)
    for at, (frequency, damping, stiffness, share, along) in enumerate(modes):
        w = 2.0 * math.pi * frequency
        free[2 * at, 2 * at + 1] = 1.0
        free[2 * at + 1, 2 * at], free[2 * at + 1, 2 * at + 1] = -w * w, -2.0 * damping * w
        free[2 * at + 1, 1::2] -= along * drag * w * w / stiffness
        force[2 * at + 1] = share * w * w / stiffness
    tip = np.zeros(size)
    tip[0::2] = 1.0
    h = delay / steps
    inner = (np.arange(40) + 0.5) / 40.0
    # columns: what stands before the delay, the state and then the tips, the newest last
    now = np.zeros((size, size + steps))
    now[:, :size] = np.eye(size)
    tips = [np.eye(1, size + steps, size + at)[0] for at in range(steps)] + [tip @ now]
    for step in range(steps):
        mean = float(np.mean([push((step + part) * h) for part in inner]))
        whole = np.zeros((size + 1, size + 1))
        whole[:size, :size], whole[:size, size] = free - mean * np.outer(force, tip), mean * force
        way = scipy.linalg.expm(whole * h)
        now = way[:size, :size] @ now + np.outer(way[:size, size], 0.5 * (tips[step] + tips[step + 1]))
        tips.append(tip @ now)
    return float(np.abs(np.linalg.eigvals(np.vstack([now, *[row[None] for row in tips[-steps - 1 : -1]]]))).max())


def tooth_force(angle: float, tangential: float, normal: float, entry: float, leave: float, teeth: int) -> float:
    """Return what the teeth in the cut turn a wave into, per depth [N/m^2]."""
    total = 0.0
    for tooth in range(teeth):
        phi = (angle + 2.0 * math.pi * tooth / teeth) % (2.0 * math.pi)
        if entry <= phi < leave:
            total += math.sin(phi) * (tangential * math.cos(phi) + normal * math.sin(phi))
    return total
