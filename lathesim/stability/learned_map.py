"""The map that cuts have taught: limits with their bounds, parameters, the next cuts, and whether the model explains them.

Learners without physics, to hold the map against: a network of two hidden layers of six, and a Gaussian process.

Both take speed and width of cuts and say how probably a cut is stable. Source: T. Schmitz, H. Cherukuri, Towards self-aware manufacturing
(slides): network of 6 and 6 neurons on 2001 cuts; scikit-learn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.errors import LatheSimError, LessonError
from lathesim.lessons.lesson import Lesson
from lathesim.record import FloatArray
from lathesim.stability.belief import MISLABELLED, Belief, TriedCut, learn_all, log_likelihood
from lathesim.stability.next_cut import CutRange, Proposal, next_cuts
from lathesim.stability.stability_thresholds import MAP, ROUNDING
from lathesim.stability.uncertain_cut import carried_over, lesson_prior
from lathesim.units import in_unit

SAME_SPEED = 0.001
"""Speeds this close, relative, are the same."""
_STRAINED = 16.0
"""Squared distance of the best machine from what was given, in standard deviations of three parameters: one in a thousand by chance."""
_VIOLATION = math.log(10.0 * MISLABELLED)


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
            if same and stable.stable and not other.stable and other.width <= stable.width * (1.0 + ROUNDING):
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
        at = f"{cut.speed:.0f} rpm, {in_unit(cut.width, 'mm', '.2f')}"
        return Adequacy(False, f"no mode near the one given explains that cut {worst + 1} ({at}) {said}{told}")
    if distance[best] > _STRAINED:
        names = ("natural frequency", "damping", "stiffness over cutting stiffness")
        place = int(np.argmax(np.abs(z[best])))
        return Adequacy(False, f"the cuts ask for a {names[place]} {abs(z[best, place]):.1f} standard deviations from what was given")
    return Adequacy(True)


def _misfit(particles: FloatArray, cut: TriedCut) -> FloatArray:
    """Return twice the negative logarithm of a cut's likelihood over the largest that it could have had."""
    found = log_likelihood(particles, cut)
    if not cut.stable and math.isfinite(cut.frequency):
        found = found + math.log(math.hypot(1.0, 0.003 * cut.frequency))
    return np.asarray(-2.0 * found)


RESTARTS = 6


def network(speeds: FloatArray, widths: FloatArray, stable: Any, restarts: int = RESTARTS, seed: int = 0) -> Any:
    """Return the best of some networks of six and six neurons, trained on cuts; it has ``predict_proba`` of scaled (speed, width)."""
    _need("sklearn")
    import warnings

    from sklearn.neural_network import MLPClassifier
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    table = np.stack([speeds, 1e3 * np.asarray(widths)], axis=1)
    best, best_loss = None, np.inf
    for turn in range(restarts):
        learner = MLPClassifier(
            (6, 6), activation="tanh", solver="lbfgs", max_iter=3000, max_fun=60000, random_state=seed + turn, alpha=1e-5
        )
        model = make_pipeline(StandardScaler(), learner)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # an optimiser that used all its steps is judged by its loss like the others
            model.fit(table, stable)
        loss = float(learner.loss_)
        if loss < best_loss:
            best, best_loss = model, loss
    return best


def gaussian_process(cuts: Sequence[TriedCut]) -> Any:
    """Return a Gaussian process classifier trained on cuts; none where all cuts went alike."""
    _need("sklearn")
    import warnings

    from sklearn.gaussian_process import GaussianProcessClassifier
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    if len({cut.stable for cut in cuts}) < 2:
        return None
    table = np.array([[cut.speed, 1e3 * cut.width] for cut in cuts])
    kernel = ConstantKernel(10.0, (0.1, 1e4)) * RBF((1.0, 1.0), (0.05, 20.0))
    model = make_pipeline(StandardScaler(), GaussianProcessClassifier(kernel, random_state=0))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a length at its bound is an answer here
        model.fit(table, [cut.stable for cut in cuts])
    return model


def stable_by(model: Any, speeds: FloatArray, widths: FloatArray) -> FloatArray:
    """Return the probability of being stable by a comparator, for speeds [rpm] and widths [m] of one shape (cuts,)."""
    return np.asarray(model.predict_proba(np.stack([speeds, 1e3 * np.asarray(widths)], axis=1))[:, 1])


def _need(package: str) -> None:
    import importlib.util

    if importlib.util.find_spec(package) is None:
        raise LatheSimError("scikit-learn is not installed.", remedy="Install lathesim with its extra: pip install 'lathesim[stability]'.")


_GRID = (121, 80)


@dataclass(frozen=True)
class LearnedValue:
    """A parameter with its 95 % interval."""

    name: str
    value: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True, eq=False)
class StabilityGrid:
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
    parameters: tuple[LearnedValue, ...]
    proposals: tuple[Proposal, ...]
    widest: float
    given: tuple[float, float, float]
    told: tuple[str, ...] = ()

    @property
    def best(self) -> TriedCut | None:
        """The stable cut that removed most."""
        return max((cut for cut in self.belief.cuts if cut.stable), key=lambda cut: cut.speed * cut.width, default=None)

    def grid(self) -> StabilityGrid:
        """Return the probability of being stable over the whole map."""
        widths = np.linspace(0.0, self.widest, _GRID[1] + 1)[1:]
        limits = self.belief.log_limits(np.array(self.speeds))
        weights = self.belief.weights
        return StabilityGrid(widths, np.stack([weights @ (limits > math.log(width)) for width in widths]))

    def comparators(self) -> dict[str, FloatArray]:
        """Return the probability of being stable over the map by learners without physics; those that cannot learn are left out."""
        if len({cut.stable for cut in self.belief.cuts}) < 2:
            raise LessonError("all cuts were stable, or all chattered.", remedy="Try cuts of the other kind.")
        speed, width = np.meshgrid(np.array(self.speeds), self.grid().widths)
        cuts = self.belief.cuts
        by_network = network(np.array([cut.speed for cut in cuts]), np.array([cut.width for cut in cuts]), [cut.stable for cut in cuts])
        models = {"network 6-6": by_network, "Gaussian process": gaussian_process(cuts)}
        return {name: stable_by(model, speed.ravel(), width.ravel()).reshape(speed.shape) for name, model in models.items()}


def learned_map(
    lesson: Lesson,
    cuts: Sequence[TriedCut],
    inside: CutRange,
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
            f"cut {first} was stable at {a.speed:.0f} rpm and {in_unit(a.width, 'mm', '.3g')}, and cut {second} chattered there "
            f"at {in_unit(b.width, 'mm', '.3g')}: they contradict each other."
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


def limits_after(belief: Belief, good: Adequacy, inside: CutRange) -> FloatArray:
    """Return quantiles of the limit [m] at 2.5, 50 and 97.5 %, (3, speeds); the lower is held where one mode no longer explains all."""
    quantiles = np.minimum(np.exp(_quantiles(belief.log_limits(inside.speeds), belief.weights)), 50.0 * inside.widest)
    return quantiles if good.good else _held(quantiles, inside.speeds, belief.cuts)


def _quantiles(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Return weighted quantiles of each column at 2.5, 50 and 97.5 %, (3, columns)."""
    return np.quantile(values, (0.025, 0.5, 0.975), axis=0, weights=weights, method="inverted_cdf")


def _held(quantiles: FloatArray, speeds: FloatArray, cuts: Sequence[TriedCut]) -> FloatArray:
    """Return quantiles with the lower one held at what was seen to be stable there, as the model is not to be trusted."""
    lower = np.zeros(len(speeds))
    for cut in cuts:
        if cut.stable:
            near = np.abs(speeds / cut.speed - 1.0) < MAP.same_speed
            lower[near] = np.maximum(lower[near], cut.width)
    failed = min((cut.width for cut in cuts if not cut.stable), default=math.inf)
    return np.stack([np.minimum(quantiles[0], np.maximum(lower, 0.5 * min(failed, float(quantiles[0].min())))), quantiles[1], quantiles[2]])


def _parameters(belief: Belief) -> tuple[LearnedValue, ...]:
    quantiles = np.exp(_quantiles(belief.particles, belief.weights))
    return tuple(
        LearnedValue(name, float(quantiles[1, at]), float(quantiles[0, at]), float(quantiles[2, at]), unit)
        for at, (name, unit) in enumerate((("frequency", "Hz"), ("damping", "1"), ("stiffness_over_cutting_stiffness", "m")))
    )
