"""The searches of an emulation: each takes an objective and bounds, and returns the best point that it found.

Every population is one batch of runs. All are stopped by Ctrl-C with the best point so far in the objective's history.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.errors import LatheSimError
from lathesim.experiments.objective import STEP, Objective
from lathesim.identification.estimation.fit import Problem, fit
from lathesim.identification.records.fit import Free

Tell = Callable[[int, float], None]
"""Is told how many simulations were made and the smallest Q so far."""


@dataclass(frozen=True)
class Effort:
    """How much a search may do. The defaults are those published: population 50, 100 generations, 5 % elite, 80 % crossover."""

    population: int = 50
    generations: int = 100
    elite: float = 0.05
    crossover: float = 0.8


def genetic(objective: Objective, low: FloatArray, high: FloatArray, effort: Effort, seed: int, tell: Tell) -> FloatArray:
    """Return the best of a genetic algorithm as published.

    Rank scaling, stochastic uniform selection, crossover by a random average of two parents, adaptive mutation in a random direction whose
    length grows after a better generation and shrinks after one without. Source: Tiwari et al. (2023), section 3.1, which names MATLAB's
    routine; Goldberg (1989). Where the printed description is silent: fitness 1/sqrt(rank), mutation steps between 1e-6 and 1 ranges.
    """
    random = np.random.default_rng(seed)
    count, size = len(low), effort.population
    elite = min(size - 1, math.ceil(effort.elite * size))
    crossed = round(effort.crossover * (size - elite))
    points = low + random.random((size, count)) * (high - low)
    points[0] = np.clip(0.0, low, high)
    costs = objective.costs(points)
    length, best = 1.0, float(costs.min())
    for generation in range(1, effort.generations):
        order = np.argsort(costs, kind="stable")
        points, costs = points[order], costs[order]
        weights = 1.0 / np.sqrt(np.arange(1.0, size + 1.0))
        parents = _stochastic_uniform(weights, 2 * crossed + size - elite - crossed, random)
        first, second = points[parents[:crossed]], points[parents[crossed : 2 * crossed]]
        children = first + random.random(first.shape) * (second - first)
        mothers = points[parents[2 * crossed :]]
        directions = random.standard_normal(mothers.shape)
        directions *= length * random.random((len(mothers), 1)) / np.maximum(np.abs(directions).max(axis=1, keepdims=True), 1e-300)
        mutants = np.clip(mothers + directions * (high - low), low, high)
        offspring = np.vstack([children, mutants])
        points = np.vstack([points[:elite], offspring])
        costs = np.concatenate([costs[:elite], objective.costs(offspring)])
        now = float(costs.min())
        length = min(1.0, 4.0 * length) if now < best else max(1e-6, length / 4.0)
        best = min(best, now)
        tell((generation + 1) * size, best)
    return objective.history.best()


def _stochastic_uniform(weights: FloatArray, count: int, random: np.random.Generator) -> Any:
    """Return parents chosen by equal steps along a line on which each has the length of its weight, in random order."""
    edges = np.cumsum(weights / weights.sum())
    steps = (random.random() + np.arange(count)) / count
    return random.permutation(np.minimum(np.searchsorted(edges, steps), len(weights) - 1))


def evolution(objective: Objective, low: FloatArray, high: FloatArray, effort: Effort, seed: int, tell: Tell) -> FloatArray:
    """Return the best of differential evolution, best/1/bin with scipy's defaults. Source: Storn and Price, J. Glob. Optim. 11 (1997)."""
    from scipy.optimize import differential_evolution

    random = np.random.default_rng(seed)
    first = low + random.random((effort.population, len(low))) * (high - low)
    first[0] = np.clip(0.0, low, high)

    def costs(columns: FloatArray) -> FloatArray:
        found = objective.costs(np.atleast_2d(columns.T))
        tell(len(objective.history.costs), min(objective.history.costs))
        return found

    differential_evolution(
        costs, list(zip(low, high, strict=True)), init=first, maxiter=effort.generations - 1, tol=0.0, polish=False, vectorized=True,
        updating="deferred", rng=random,
    )  # fmt: skip
    return objective.history.best()


def cma_search(objective: Objective, low: FloatArray, high: FloatArray, effort: Effort, seed: int, tell: Tell) -> FloatArray:
    """Return the best of CMA-ES from the given values. Source: Hansen, The CMA evolution strategy, arXiv 1604.00772 (2016)."""
    try:
        import cma
    except ImportError:
        raise LatheSimError(
            "the package 'cma' is not installed.", remedy="Install it with 'pip install cma', or take --method evolution."
        ) from None
    options = {
        "bounds": [list(low), list(high)], "popsize": effort.population, "seed": seed + 1, "verbose": -9, "maxiter": effort.generations,
        "tolfun": 0.0, "tolx": 1e-9, "tolfunhist": 0.0, "tolflatfitness": 100,
    }  # fmt: skip
    strategy = cma.CMAEvolutionStrategy(list(np.clip(0.0, low, high)), 0.25 * float(np.min(high - low)), options)
    while not strategy.stop() and len(objective.history.costs) < effort.population * effort.generations:
        points = np.clip(np.array(strategy.ask()), low, high)
        strategy.tell(list(points), list(objective.costs(points)))
        tell(len(objective.history.costs), min(objective.history.costs))
    return objective.history.best()


def replay(objective: Objective, low: FloatArray, high: FloatArray, effort: Effort, seed: int, tell: Tell) -> FloatArray:
    """Return the end of a least-squares descent from the given values."""
    return descend(objective, low, high, np.zeros(len(low)), tell, 40)


def descend(
    objective: Objective, low: FloatArray, high: FloatArray, start: FloatArray, tell: Tell, most: int, closeness: float = 1e-4
) -> FloatArray:
    """Return the end of a least-squares descent from ``start``, with what the lesson says of the values as a weak pull.

    ``most`` are steps at most, and one that gains less than a share ``closeness`` is the last.
    """

    def left(rows: FloatArray) -> list[FloatArray]:
        found = objective.vector(rows)
        costs = (np.square(found).mean(axis=1) * objective.floor**2).tolist()
        objective.history.points += list(rows)
        objective.history.costs += costs
        tell(objective.replica.runs, min(costs))
        return list(found)

    ends = zip(low.tolist(), high.tolist(), strict=True)
    free = [Free(item.name, 0.0, item.spread, *both, item.spread) for item, both in zip(objective.free, ends, strict=True)]
    problem = Problem(left, free, steps=lambda values, before: np.full(len(values), STEP))
    return fit(problem, free, start, iterations=most, tolerance=closeness, least=0.0, bent=True).values


METHODS: dict[str, Callable[[Objective, FloatArray, FloatArray, Effort, int, Tell], FloatArray]] = {
    "replay": replay,
    "genetic": genetic,
    "evolution": evolution,
    "cma": cma_search,
}
"""Name -> search. ``replay`` runs the program again and descends by least squares."""
