"""The game of the next best cut: a concealed machine answers cuts, and the program plays on the same machine beside.

Points are the best stable speed times width, as feed and diameter stay; a cut that chatters breaks a tool. The machine has one mode, drawn
from what the lesson gives and calls uncertain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lathesim.errors import LatheSimError
from lathesim.stability.learning.belief import Prior, begin, learn
from lathesim.stability.learning.next_cut import Range, best_stable, next_cut
from lathesim.stability.learning.tried_cuts import TriedCut
from lathesim.stability.limits.frequency_limit import limit_at
from lathesim.stability.tool_point.modes import Mode, ToolPoint

_STIFFNESS = 1e9
"""Only stiffness over cutting stiffness counts, so that of the cut [N/m^2] is any number."""
_DENSE = 601


@dataclass(frozen=True)
class ConcealedMachine:
    """A machine whose tool point the player does not know, and the range in which cuts may be."""

    tool: ToolPoint
    inside: Range

    def cut(self, speed: float, width: float) -> TriedCut:
        """Make a cut at a speed [rpm] and width [m]; :class:`LatheSimError` outside the range."""
        low, high = float(self.inside.speeds[0]), float(self.inside.speeds[-1])
        if not low <= speed <= high:
            raise LatheSimError(f"the speed is {speed:g} rpm.", remedy=f"Choose one from {low:g} to {high:g} rpm.")
        if not 0.0 < width <= self.inside.widest:
            raise LatheSimError(f"the width is {1e3 * width:g} mm.", remedy=f"Choose one up to {1e3 * self.inside.widest:g} mm.")
        limit = limit_at(self.tool, _STIFFNESS, speed)
        stable = width < limit.width
        return TriedCut(speed, width, stable, math.nan if stable else limit.frequency)

    def best(self) -> float:
        """Return the best stable speed times width [rpm*m] within the range."""
        speeds = np.linspace(self.inside.speeds[0], self.inside.speeds[-1], _DENSE).tolist()
        return float(max(speed * min(limit_at(self.tool, _STIFFNESS, speed).width, self.inside.widest) for speed in speeds))


@dataclass(frozen=True)
class Score:
    """What cuts reached: the best stable speed times width [rpm*m], its share of what was possible, and the tools broken."""

    rate: float
    share: float
    broken: int


def concealed_machine(prior: Prior, inside: Range, seed: int) -> ConcealedMachine:
    """Return a machine drawn from a prior."""
    chance = np.random.Generator(np.random.Philox(seed))
    frequency, damping, ratio = np.exp(prior.mean + prior.deviation * chance.standard_normal(3)).tolist()
    return ConcealedMachine(ToolPoint((Mode(frequency, min(damping, 0.6), ratio * _STIFFNESS),), (1.0,)), inside)


def score(machine: ConcealedMachine, cuts: list[TriedCut]) -> Score:
    """Return the score of cuts on a machine."""
    rate = best_stable(cuts)
    return Score(rate, rate / machine.best(), sum(not cut.stable for cut in cuts))


def program_plays(machine: ConcealedMachine, prior: Prior, count: int, risk: float, seed: int) -> list[TriedCut]:
    """Return the cuts that the program makes on a machine, which it knows as little of as the player does."""
    belief = begin(prior, seed)
    for _ in range(count):
        asked = next_cut(belief, machine.inside, risk=risk)
        belief = learn(belief, machine.cut(asked.speed, asked.width))
    return list(belief.cuts)
