"""The next cut worth making: the one of largest expected gain in removal rate, under a limit of risk.

A stable cut is worth what it removes beyond the best stable one so far, speed times width, as feed and diameter stay. A cut that chatters
costs a price. So a cut counts  P(stable) (n b - best)+ - P(chatter) price  where P(chatter) <= risk, and with it the best cut after it.

The game of the next best cut: a concealed machine answers cuts, and the program plays on the same machine beside.

Points are the best stable speed times width, as feed and diameter stay; a cut that chatters breaks a tool. The machine has one mode, drawn
from what the lesson gives and calls uncertain.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.errors import LatheSimError
from lathesim.record import FloatArray
from lathesim.stability.belief import Belief, Prior, TriedCut, begin, learn, log_limits, stable_chance
from lathesim.stability.frequency_limit import limit_at
from lathesim.stability.tool_point import Mode, ToolPoint
from lathesim.units import in_unit

WIDTHS = 64
RISK = 0.6
"""A cut that chatters more probably than this is not proposed."""


_SPEEDS_LOOKED_AT, _CHANCES_LOOKED_AT, _FEW_PARTICLES = 12, (0.45, 0.6, 0.8, 0.92), 800
"""Speeds and chances to be stable of the cuts that are followed to a second one, and particles by which that is done."""
_MORE_PROBABLE = 0.5
"""Probability from which a cut is taken to be stable."""


@dataclass(frozen=True)
class Proposal:
    """A cut worth making: speed [rpm], width [m], its probability to be stable, and the expected gain in speed times width [rpm*m]."""

    speed: float
    width: float
    stable: float
    gain: float


@dataclass(frozen=True)
class CutRange:
    """Where cuts may be: rising speeds [rpm] and the largest width [m]."""

    speeds: FloatArray
    widest: float


def best_stable(cuts: Sequence[TriedCut]) -> float:
    """Return the largest speed times width [rpm*m] that was stable, 0 where none was."""
    return max((cut.speed * cut.width for cut in cuts if cut.stable), default=0.0)


def next_cut(belief: Belief, inside: CutRange, *, risk: float = RISK, price: float = 0.0) -> Proposal:
    """Return the next cut; ``price`` of a cut that chatters is in speed times width [rpm*m].

    Of the cuts of large gain that one is taken which is best together with the cut after it: what it teaches is worth something too.
    """
    best = best_stable(belief.cuts)
    offers = _offers(belief.log_limits(inside.speeds), inside)
    stable = offers.stable(belief.weights)
    gain = offers.gain(stable, best, risk, price)
    if not np.isfinite(gain).any():
        return _proposal(offers, stable, gain, int(np.argmax(stable)))
    places = _candidates(stable, gain)
    proposals = [_proposal(offers, stable, gain, place) for place in places]
    return proposals[int(np.argmax(_worth_of_two(belief, inside, proposals, risk, price)))]


@dataclass(frozen=True, eq=False)
class _Offers:
    """Cuts at some ranks of the limits of each speed: widths [m] (ranks, speeds), the ranks, the order of the particles
    (particles, speeds), whether a rank is at the widest allowed, and which limits are above that."""

    speeds: FloatArray
    widths: FloatArray
    ranks: Any
    order: Any
    is_widest: Any
    above: Any

    def stable(self, weights: FloatArray) -> FloatArray:
        """Return the probability of each cut to be stable where the particles have these weights, (ranks, speeds)."""
        left = 1.0 - np.cumsum(weights[self.order], axis=0)[self.ranks]
        return np.asarray(np.where(self.is_widest, weights @ self.above, left))

    def gain(self, stable: FloatArray, best: float, risk: float, price: float) -> FloatArray:
        """Return the expected gain of each cut over the ``best`` one, minus infinity where the risk is too high."""
        gain = stable * np.maximum(self.speeds * self.widths - best, 0.0) - (1.0 - stable) * price
        return np.asarray(np.where(1.0 - stable <= risk, gain, -math.inf))


def _offers(log_limits: FloatArray, inside: CutRange) -> _Offers:
    limits = np.exp(log_limits)
    order = np.argsort(limits, axis=0)
    ranks = np.unique(np.linspace(0, len(limits) - 1, 4 * WIDTHS).astype(int))
    ranked = np.take_along_axis(limits, order[ranks], axis=0)
    widths = np.minimum(ranked * (1.0 - 1e-6), inside.widest)
    return _Offers(inside.speeds, widths, ranks, order, ranked >= inside.widest, (limits >= inside.widest).astype(np.float64))


def _proposal(offers: _Offers, stable: FloatArray, gain: FloatArray, place: int) -> Proposal:
    at = divmod(place, len(offers.speeds))
    return Proposal(float(offers.speeds[at[1]]), float(offers.widths[at]), float(stable[at]), float(gain[at]))


def _candidates(stable: FloatArray, gain: FloatArray) -> list[int]:
    """Return places of cuts worth looking at: those of largest gain at speeds apart, and bolder and safer ones there."""
    columns = np.argsort(-gain.max(axis=0))
    apart: list[int] = []
    for column in columns.tolist():
        if len(apart) < _SPEEDS_LOOKED_AT and all(abs(column - other) > 2 for other in apart):
            apart.append(column)
    found = []
    for column in apart:
        ranks = {int(np.argmax(gain[:, column]))}
        ranks |= {int(np.argmin(np.abs(stable[:, column] - wanted))) for wanted in _CHANCES_LOOKED_AT}
        found += [rank * gain.shape[1] + column for rank in sorted(ranks) if math.isfinite(gain[rank, column])]
    return found


def _worth_of_two(belief: Belief, inside: CutRange, proposals: Sequence[Proposal], risk: float, price: float) -> list[float]:
    """Return the expected gain of each cut and of the best one after it, which depends on how the first goes.

    Source: J. Wu, P. Frazier, Practical two-step look-ahead Bayesian optimization, NeurIPS (2019). Left out: what the chatter frequency
    of the first would tell.
    """
    best = best_stable(belief.cuts)
    positions = (np.arange(_FEW_PARTICLES) + 0.5) / _FEW_PARTICLES
    few = belief.particles[np.searchsorted(np.cumsum(belief.weights), positions).clip(0, len(belief.particles) - 1)]
    limits = log_limits(few, inside.speeds)
    offers = _offers(limits, inside)

    def after(weights: FloatArray, reached: float) -> float:
        return max(0.0, float(offers.gain(offers.stable(weights / weights.sum()), reached, risk, price).max()))

    worth = []
    for proposal in proposals:
        stable = stable_chance(limits[:, int(np.argmin(np.abs(inside.speeds - proposal.speed)))] - math.log(proposal.width))
        chance, reached = float(stable.mean()), proposal.speed * proposal.width
        if_stable = max(0.0, reached - best) + after(stable, max(best, reached))
        worth.append(chance * if_stable + (1.0 - chance) * (after(1.0 - stable, best) - price))
    return worth


def next_cuts(belief: Belief, inside: CutRange, count: int, *, risk: float = RISK, price: float = 0.0) -> list[Proposal]:
    """Return so many cuts in a row, each chosen as if the ones before had gone as was more probable."""
    found: list[Proposal] = []
    for _ in range(count):
        proposal = next_cut(belief, inside, risk=risk, price=price)
        found.append(proposal)
        if len(found) < count:
            belief = learn(belief, TriedCut(proposal.speed, proposal.width, proposal.stable >= _MORE_PROBABLE))
    return found


_STIFFNESS = 1e9
"""Only stiffness over cutting stiffness counts, so that of the cut [N/m^2] is any number."""
_DENSE = 601


@dataclass(frozen=True)
class ConcealedMachine:
    """A machine whose tool point the player does not know, and the range in which cuts may be."""

    tool: ToolPoint
    inside: CutRange

    def cut(self, speed: float, width: float) -> TriedCut:
        """Make a cut at a speed [rpm] and width [m]; :class:`LatheSimError` outside the range."""
        low, high = float(self.inside.speeds[0]), float(self.inside.speeds[-1])
        if not low <= speed <= high:
            raise LatheSimError(f"the speed is {speed:g} rpm.", remedy=f"Choose one from {low:g} to {high:g} rpm.")
        if not 0.0 < width <= self.inside.widest:
            raise LatheSimError(
                f"the width is {in_unit(width, 'mm', 'g')}.", remedy=f"Choose one up to {in_unit(self.inside.widest, 'mm', 'g')}."
            )
        limit = limit_at(self.tool, _STIFFNESS, speed)
        stable = width < limit.width
        return TriedCut(speed, width, stable, math.nan if stable else limit.frequency)

    def best(self) -> float:
        """Return the best stable speed times width [rpm*m] within the range."""
        speeds = np.linspace(self.inside.speeds[0], self.inside.speeds[-1], _DENSE).tolist()
        return float(max(speed * min(limit_at(self.tool, _STIFFNESS, speed).width, self.inside.widest) for speed in speeds))


@dataclass(frozen=True)
class GameScore:
    """What cuts reached: the best stable speed times width [rpm*m], its share of what was possible, and the tools broken."""

    rate: float
    share: float
    broken: int


def concealed_machine(prior: Prior, inside: CutRange, seed: int) -> ConcealedMachine:
    """Return a machine drawn from a prior."""
    chance = np.random.Generator(np.random.Philox(seed))
    frequency, damping, ratio = np.exp(prior.mean + prior.deviation * chance.standard_normal(3)).tolist()
    return ConcealedMachine(ToolPoint((Mode(frequency, min(damping, 0.6), ratio * _STIFFNESS),), (1.0,)), inside)


def score(machine: ConcealedMachine, cuts: list[TriedCut]) -> GameScore:
    """Return the score of cuts on a machine."""
    rate = best_stable(cuts)
    return GameScore(rate, rate / machine.best(), sum(not cut.stable for cut in cuts))


def program_plays(machine: ConcealedMachine, prior: Prior, count: int, risk: float, seed: int) -> list[TriedCut]:
    """Return the cuts that the program makes on a machine, which it knows as little of as the player does."""
    belief = begin(prior, seed)
    for _ in range(count):
        asked = next_cut(belief, machine.inside, risk=risk)
        belief = learn(belief, machine.cut(asked.speed, asked.width))
    return list(belief.cuts)
