"""Whether one mode explains the cuts, and which cuts contradict each other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.record import FloatArray
from lathesim.stability.learning.belief import MISLABELLED, Belief, log_likelihood
from lathesim.stability.learning.tried_cuts import TriedCut

SAME_SPEED = 0.001
"""Speeds this close, relative, are the same."""
_STRAINED = 16.0
"""Squared distance of the best machine from what was given, in standard deviations of three parameters: one in a thousand by chance."""
_VIOLATION = math.log(10.0 * MISLABELLED)
_POOR_FREQUENCY = 16.0


@dataclass(frozen=True)
class Adequacy:
    """Whether one mode explains the cuts; if not, ``reason`` says which cut or what speaks against it."""

    good: bool
    reason: str = ""


def contradictions(cuts: Sequence[TriedCut]) -> list[tuple[int, int]]:
    """Return pairs of cuts, counted from 1: at one speed the first was stable at a width at which, or below which, the second chattered."""
    found = []
    for first, stable in enumerate(cuts, 1):
        for second, other in enumerate(cuts, 1):
            same = abs(stable.speed - other.speed) <= SAME_SPEED * stable.speed
            if same and stable.stable and not other.stable and other.width <= stable.width * (1.0 + 1e-9):
                found.append((first, second))
    return found


def adequacy(belief: Belief) -> Adequacy:
    """Return whether any machine of one mode within reach of what was given explains the cuts."""
    if not belief.cuts:
        return Adequacy(True)
    z = (belief.particles - belief.prior.mean) / np.maximum(belief.prior.deviation, 1e-9)
    distance = (z * z).sum(axis=1)
    each = np.stack([_misfit(belief.particles, cut) for cut in belief.cuts])
    best = int(np.argmin(distance + each.sum(axis=0)))
    worst = int(np.argmax(each[:, best]))
    cut = belief.cuts[worst]
    if each[worst, best] > -2.0 * _VIOLATION:
        said = "was stable" if cut.stable else "chattered"
        told = f" at {cut.frequency:.1f} Hz" if math.isfinite(cut.frequency) else ""
        return Adequacy(
            False, f"no mode near the one given explains that cut {worst + 1} ({cut.speed:.0f} rpm, {1e3 * cut.width:.2f} mm) {said}{told}"
        )
    if distance[best] > _STRAINED:
        names = ("natural frequency", "damping", "stiffness over cutting stiffness")
        place = int(np.argmax(np.abs(z[best])))
        return Adequacy(False, f"the cuts ask for a {names[place]} {abs(z[best, place]):.1f} standard deviations from what was given")
    return Adequacy(True)


def _misfit(particles: FloatArray, cut: TriedCut) -> FloatArray:
    """Return twice the negative logarithm of a cut's likelihood over the largest that it could have had."""
    found = log_likelihood(particles, cut)
    if not cut.stable and math.isfinite(cut.frequency):
        noise = math.hypot(1.0, 0.003 * cut.frequency)
        found = found + math.log(noise)
    return np.asarray(-2.0 * found)
