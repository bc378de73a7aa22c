"""The map that cuts have taught: limits with their bounds, parameters, the next cuts, and whether the model explains them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.errors import LessonError
from lathesim.lessons.lesson import Lesson
from lathesim.record import FloatArray
from lathesim.stability.learning.adequacy import Adequacy, adequacy, contradictions
from lathesim.stability.learning.belief import Belief, learn_all
from lathesim.stability.learning.lesson_prior import carried_over, lesson_prior
from lathesim.stability.learning.next_cut import Proposal, Range, next_cuts
from lathesim.stability.learning.tried_cuts import TriedCut

_GRID = (121, 80)


@dataclass(frozen=True)
class Learned:
    """A parameter with its 95 % interval."""

    name: str
    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True, eq=False)
class Grid:
    """Probabilities of being stable (widths, speeds) at widths [m]."""

    widths: FloatArray
    stable: FloatArray


@dataclass(frozen=True, eq=False)
class LearnedMap:
    """The belief after all cuts, speeds [rpm], quantiles of the limit [m] (3, speeds) at 2.5, 50 and 97.5 %, and what comes next."""

    belief: Belief
    adequacy: Adequacy
    speeds: tuple[float, ...]
    quantiles: FloatArray
    parameters: tuple[Learned, ...]
    proposals: tuple[Proposal, ...]
    widest: float
    given: tuple[float, float, float]
    told: tuple[str, ...] = ()

    @property
    def best(self) -> TriedCut | None:
        """The stable cut that removed most."""
        stable = [cut for cut in self.belief.cuts if cut.stable]
        return max(stable, key=lambda cut: cut.speed * cut.width, default=None)

    def grid(self) -> Grid:
        """Return the probability of being stable over the whole map."""
        widths = np.linspace(0.0, self.widest, _GRID[1] + 1)[1:]
        limits = self.belief.log_limits(np.array(self.speeds))
        weights = self.belief.weights
        rows = [weights @ (limits > math.log(width)) for width in widths]
        return Grid(widths, np.stack(rows))

    def comparators(self) -> dict[str, FloatArray]:
        """Return the probability of being stable over the map by learners without physics; those that cannot learn are left out."""
        from lathesim.stability.learning.comparators import gaussian_process, network, stable_by

        if len({cut.stable for cut in self.belief.cuts}) < 2:
            raise LessonError("all cuts went alike, and learners without physics need both kinds.", remedy="Try a cut that chatters.")
        grid = self.grid()
        speed, width = np.meshgrid(np.array(self.speeds), grid.widths)
        cuts = self.belief.cuts
        by_network = network(np.array([cut.speed for cut in cuts]), np.array([cut.width for cut in cuts]), [cut.stable for cut in cuts])
        models = {"network 6-6": by_network, "Gaussian process": gaussian_process(cuts)}
        return {name: stable_by(model, speed.ravel(), width.ravel()).reshape(speed.shape) for name, model in models.items()}


def learned_map(
    lesson: Lesson,
    cuts: Sequence[TriedCut],
    inside: Range,
    count: int,
    *,
    risk: float,
    price: float,
    seed: int = 1,
    before: Path | None = None,
) -> LearnedMap:
    """Return the map of a lesson after cuts, with ``count`` next ones; ``before`` is what the cuts at another overhang taught.

    Raises :class:`LessonError` where nothing was uncertain, and where cuts contradict each other, which are then named.
    """
    given = lesson_prior(lesson, needs_uncertain=before is None)
    known = given if before is None else carried_over(given, before)
    against = contradictions(cuts)
    if against:
        first, second = against[0]
        a, b = cuts[first - 1], cuts[second - 1]
        fact = (
            f"cut {first} was stable at {a.speed:.0f} rpm and {1e3 * a.width:.3g} mm, and cut {second} chattered there "
            f"at {1e3 * b.width:.3g} mm: they contradict each other."
        )
        raise LessonError(fact, remedy="Make one of them again, or take it out.")
    belief = learn_all(known.prior, cuts, seed)
    good = adequacy(belief)
    quantiles = limits_after(belief, good, inside)
    proposals = next_cuts(belief, inside, count, risk=risk, price=price) if count else []
    return LearnedMap(
        belief,
        good,
        tuple(inside.speeds.tolist()),
        quantiles,
        _parameters(belief),
        tuple(proposals),
        inside.widest,
        tuple(np.exp(given.prior.mean).tolist()),
        known.told,
    )


def limits_after(belief: Belief, good: Adequacy, inside: Range) -> FloatArray:
    """Return quantiles of the limit [m] at 2.5, 50 and 97.5 %, (3, speeds). The lower one is held where one mode explains no
    longer all cuts."""
    limits = belief.log_limits(inside.speeds)
    quantiles = np.minimum(np.exp(_quantiles(limits, belief.weights)), 50.0 * inside.widest)
    return quantiles if good.good else _held(quantiles, inside.speeds, belief.cuts)


def _quantiles(limits: FloatArray, weights: FloatArray) -> FloatArray:
    order = np.argsort(limits, axis=0)
    ranked = np.take_along_axis(limits, order, axis=0)
    total = np.cumsum(weights[order], axis=0)
    last, columns = len(ranked) - 1, range(limits.shape[1])
    rows = [[ranked[min(int(np.searchsorted(total[:, at], share)), last), at] for at in columns] for share in (0.025, 0.5, 0.975)]
    return np.array(rows)


def _held(quantiles: FloatArray, speeds: FloatArray, cuts: Sequence[TriedCut]) -> FloatArray:
    """Return quantiles with the lower one held at what was seen to be stable there, as the model is not to be trusted."""
    lower = np.zeros(len(speeds))
    for cut in cuts:
        if cut.stable:
            near = np.abs(speeds / cut.speed - 1.0) < 0.01
            lower[near] = np.maximum(lower[near], cut.width)
    failed = min((cut.width for cut in cuts if not cut.stable), default=math.inf)
    return np.stack([np.minimum(quantiles[0], np.maximum(lower, 0.5 * min(failed, float(quantiles[0].min())))), quantiles[1], quantiles[2]])


def _parameters(belief: Belief) -> tuple[Learned, ...]:
    quantiles = np.exp(_quantiles(belief.particles, belief.weights))
    names = (("frequency", "Hz"), ("damping", "1"), ("stiffness_over_cutting_stiffness", "m"))
    return tuple(
        Learned(name, float(quantiles[1, at]), float(quantiles[0, at]), float(quantiles[2, at]), unit)
        for at, (name, unit) in enumerate(names)
    )
