"""Training: several starts by any of the searches for weights, and the best one judged beside no regulator at all."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lathesim.compensation.training_question import AsScored, TrainingQuestion
from lathesim.engine.assembly import FloatArray
from lathesim.errors import LessonError, SimulationError, nearest
from lathesim.identification.estimation.fit import Descent, fit

ReportStep = Callable[[int, float], None]
_SAME = 1e-7
"""Share by which a score must still fall; below it a search is done."""
_WORST = 1e6
"""Score that a run is given that diverges, for searches that compare."""


@dataclass(frozen=True)
class Trained:
    """What one start ended with: weights, mean score over the situations while searching, and rounds."""

    vector: FloatArray
    score: float
    rounds: int

    @property
    def diverged(self) -> bool:
        """Whether no finite score was reached."""
        return not math.isfinite(self.score)


def descent(question: TrainingQuestion, start: FloatArray, rounds: int, tell: ReportStep) -> Trained:
    """Follow the gradient downhill; a step that makes it worse is halved, one that helps grows by a half."""
    return _stepping(question, start, rounds, tell, adam=False)


def adam(question: TrainingQuestion, start: FloatArray, rounds: int, tell: ReportStep) -> Trained:
    """Follow the gradient with momentum and a scale for each weight (Kingma, Ba, Adam, 2015, algorithm 1), steps of 0.03 that shrink."""
    return _stepping(question, start, rounds, tell, adam=True)


def _stepping(question: TrainingQuestion, start: FloatArray, rounds: int, tell: ReportStep, *, adam: bool) -> Trained:
    vector, best, least = start.copy(), start.copy(), math.inf
    mean, square, step = np.zeros_like(start), np.zeros_like(start), 1.0
    for turn in range(rounds):
        value, gradient = question.slopes(vector)
        tell(turn + 1, min(least, value))
        if not (math.isfinite(value) and np.all(np.isfinite(gradient))):
            return Trained(best, least, turn + 1)
        if value < least:
            least, best = value, vector.copy()
            step *= 1.5
        else:
            step *= 0.5
        if adam:
            mean = 0.9 * mean + 0.1 * gradient
            square = 0.999 * square + 0.001 * gradient * gradient
            size = 0.03 * (1.0 - turn / rounds) + 1e-3
            vector = vector - size * (mean / (1.0 - 0.9 ** (turn + 1))) / (np.sqrt(square / (1.0 - 0.999 ** (turn + 1))) + 1e-12)
        else:
            vector = best - step * gradient / max(float(np.linalg.norm(gradient)), 1e-12) * 0.05
    return Trained(best, least, rounds)


def least_squares(question: TrainingQuestion, start: FloatArray, rounds: int, tell: ReportStep) -> Trained:
    """Fit the weights: the traces of the score by least squares, divided by their sizes (:class:`AsScored`)."""
    way: list[float] = []

    def report(turn: int, cost: float) -> None:
        if cost not in way[-1:]:
            way.append(cost)
        tell(turn, cost)

    found = fit(Descent(question.problem, AsScored(question.score), tolerance=_SAME, least=0.0, bent=True), start, rounds, report)
    return Trained(found.values, found.cost, len(way))


def evolution(question: TrainingQuestion, start: FloatArray, rounds: int, tell: ReportStep) -> Trained:
    """Draw, score and move a cloud of weights (CMA-ES of the package ``cma``): no gradient, for scores that jump."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the package, about plots that nobody makes
        import cma

        options = {"seed": 1 + int(1e6 * abs(float(start[0]))) % 100_000, "verbose": -9, "maxiter": rounds, "tolfun": 1e-12}
        strategy = cma.CMAEvolutionStrategy(start, 0.3, options)
        turns = 0
        while not strategy.stop():
            cloud = strategy.ask()
            scores = np.nan_to_num(question.scores([np.asarray(item) for item in cloud]).mean(axis=1), nan=_WORST, posinf=_WORST)
            strategy.tell(cloud, list(scores))
            turns += 1
            tell(turns, float(strategy.result.fbest))
    best = float(strategy.result.fbest)
    return Trained(np.asarray(strategy.result.xbest), best if best < _WORST else math.inf, turns)


@dataclass(frozen=True)
class TrainingMethod:
    """A search and how many rounds it takes where nobody says."""

    search: Callable[[TrainingQuestion, FloatArray, int, ReportStep], Trained]
    rounds: int


METHODS = {
    "descent": TrainingMethod(descent, 250),
    "adam": TrainingMethod(adam, 250),
    "least-squares": TrainingMethod(least_squares, 25),
    "evolution": TrainingMethod(evolution, 150),
}
"""The searches, by name."""


def method_named(name: str) -> TrainingMethod:
    """Return a search; :class:`LessonError` with the nearest name where there is none."""
    if name not in METHODS:
        raise LessonError(f"there is no method '{name}'.", remedy=nearest(name, METHODS) or f"Methods: {', '.join(METHODS)}.")
    return METHODS[name]


Tell = Callable[[str], None]


@dataclass(frozen=True)
class Training:
    """All starts, the best of them, and its score in each situation with the lesson's own steps beside that of the zero regulator."""

    starts: tuple[Trained, ...]
    best: Trained
    scores: dict[str, float]
    zero: dict[str, float]
    table: FloatArray


def train(
    question: TrainingQuestion,
    method: TrainingMethod,
    *,
    starts: int,
    rounds: int | None,
    seed: int,
    judged: TrainingQuestion | None = None,
    tell: Tell = lambda text: None,
) -> Training:
    """Search from several starts and return all of them with the best, judged in the situations of ``judged``, else in its own.

    Raises :class:`SimulationError` where every start diverges.
    """
    rng = np.random.default_rng([seed, 3])
    wanted = rounds or method.rounds
    ended = []
    for number in range(starts):

        def told(turn: int, score: float, number: int = number) -> None:
            tell(f"start {number + 1} of {starts}, round {turn} of {wanted}: score {score:.4g}")

        ended.append(method.search(question, question.shape.start(rng), wanted, told))
    finite = [item for item in ended if not item.diverged]
    if not finite:
        raise SimulationError(
            f"the training diverges from all {starts} starts.", remedy="Lower the regulator's gain, or start anew with another --seed."
        )
    best = min(finite, key=lambda item: item.score)
    judging = judged or question
    exact = judging.scores([best.vector, np.zeros_like(best.vector)], exact=True)
    scores = dict(zip(judging.situations, map(float, exact[0]), strict=True))
    zero = dict(zip(judging.situations, map(float, exact[1]), strict=True))
    return Training(tuple(ended), best, scores, zero, question.shape.table(best.vector))
