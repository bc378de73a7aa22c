"""The next cut worth making: the one of largest expected gain in removal rate, under a limit of risk.

A stable cut is worth what it removes beyond the best stable one so far, speed times width, as feed and diameter stay. A cut that chatters
costs a price. So the cut that counts is the maximum of  P(stable) (n b - best)+ - P(chatter) price  where P(chatter) <= risk.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.record import FloatArray
from lathesim.stability.learning.belief import Belief, learn
from lathesim.stability.learning.tried_cuts import TriedCut

WIDTHS = 64
RISK = 0.6
"""A cut that chatters more probably than this is not proposed."""


@dataclass(frozen=True)
class Proposal:
    """A cut worth making: speed [rpm], width [m], its probability to be stable, and the expected gain in speed times width [rpm*m]."""

    speed: float
    width: float
    stable: float
    gain: float


@dataclass(frozen=True)
class Range:
    """Where cuts may be: rising speeds [rpm] and the largest width [m]."""

    speeds: FloatArray
    widest: float


def best_stable(cuts: Sequence[TriedCut]) -> float:
    """Return the largest speed times width [rpm*m] that was stable, 0 where none was."""
    return max((cut.speed * cut.width for cut in cuts if cut.stable), default=0.0)


def next_cut(belief: Belief, inside: Range, *, risk: float = RISK, price: float = 0.0) -> Proposal:
    """Return the next cut; ``price`` of a cut that chatters is in speed times width [rpm*m]."""
    best = best_stable(belief.cuts)
    limits = np.exp(belief.log_limits(inside.speeds))
    order = np.argsort(limits, axis=0)
    ranked = np.take_along_axis(limits, order, axis=0)
    left = 1.0 - np.cumsum(belief.weights[order], axis=0)
    chosen = Proposal(float(inside.speeds[0]), inside.widest, 0.0, -math.inf)
    safest = chosen
    for place, speed in enumerate(inside.speeds.tolist()):
        column, chance = ranked[:, place], left[:, place]
        at = np.unique(np.linspace(0, len(column) - 1, 4 * WIDTHS).astype(int))
        widths = np.minimum(column[at] * (1.0 - 1e-6), inside.widest)
        # at the widest allowed all limits above it are stable
        wide = float(chance[min(int(np.searchsorted(column, inside.widest)), len(column) - 1)])
        stable = np.where(column[at] >= inside.widest, wide, chance[at])
        gain = stable * np.maximum(speed * widths - best, 0.0) - (1.0 - stable) * price
        allowed = 1.0 - stable <= risk
        if allowed.any():
            top = int(np.argmax(np.where(allowed, gain, -math.inf)))
            if gain[top] > chosen.gain:
                chosen = Proposal(speed, float(widths[top]), float(stable[top]), float(gain[top]))
        if stable[0] > safest.stable:
            safest = Proposal(speed, float(widths[0]), float(stable[0]), float(gain[0]))
    return chosen if math.isfinite(chosen.gain) else safest


def next_cuts(belief: Belief, inside: Range, count: int, *, risk: float = RISK, price: float = 0.0) -> list[Proposal]:
    """Return so many cuts in a row, each chosen as if the ones before had gone as was more probable."""
    found: list[Proposal] = []
    for _ in range(count):
        proposal = next_cut(belief, inside, risk=risk, price=price)
        found.append(proposal)
        if len(found) < count:
            belief = learn(belief, TriedCut(proposal.speed, proposal.width, proposal.stable >= 0.5))
    return found
