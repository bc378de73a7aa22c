"""What an emulation makes small: the mean square deviation at the way-points, of positions and, weighted, of speeds.

    Q = sum_channels w mean (y - y_model)^2,   w = 1 for a position, lambda for a speed

Source: A. Tiwari et al., J. Manuf. Syst. 68 (2023), section 2.3. Q adds m^2 and (m/s)^2, as printed there.

The searches of an emulation: each takes an objective and bounds, and returns the best point that it found.

Every population is one batch of runs. All are stopped by Ctrl-C with the best point so far in the objective's history.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.errors import LatheSimError
from lathesim.experiments.free_values import FreeValue, values_of
from lathesim.experiments.replica import Replica
from lathesim.experiments.waypoints import Wandering, Waypoints, likely_wandering, whitened
from lathesim.identification.estimation.fit import Descent, Problem, fit
from lathesim.identification.records import Free
from lathesim.units import same_dimension

FAR = 1.0
"""Deviation [SI] that stands for a run that diverged."""
STEP = 1e-3
"""Step of differences on the scale of the search."""
_WITHIN = 2e-3
"""Time [s] on either side of a way-point within which its speed is taken."""


@dataclass
class TriedPoints:
    """Every point that was tried on the scale of the search, with its Q."""

    points: list[FloatArray] = field(default_factory=list)
    costs: list[float] = field(default_factory=list)

    def best(self) -> FloatArray:
        """Return the point with the smallest Q."""
        return self.points[int(np.argmin(self.costs))]


class Objective:
    """Deviations of a replica from way-points, as a function of points on the scale of the search.

    ``floor`` [SI] is what one deviation is worth in a sum of squares; Q itself knows no floor. With ``wandering`` the squares are those of
    what is new in each deviation, given the earlier ones. Way-points behind ``until`` [s] do not count. Names of the replica that are not
    ``free`` have ``held`` values [SI], those of all its names.
    """

    def __init__(
        self, replica: Replica, free: Sequence[FreeValue], recorded: Sequence[Waypoints], weight: float, floor: float,
        held: FloatArray | None = None,
    ) -> None:  # fmt: skip
        self.replica = replica
        self._held = np.zeros(len(replica.names)) if held is None else held
        self._columns = [replica.names.index(item.name) for item in free]
        self.free = tuple(free)
        self.recorded = tuple(recorded)
        self.weight = weight
        self.floor, self.least = floor, floor
        self.wandering: Wandering | None = None
        self.until = math.inf
        self.history = TriedPoints()
        self._weights = [np.array([self._weight(item, name) for name in item.channels]) for item in recorded]

    def _weight(self, item: Waypoints, name: str) -> float:
        return 1.0 if same_dimension(item.prepared.plan.unit(name), "m") else self.weight

    def _values(self, points: FloatArray) -> FloatArray:
        """Return the values [SI] of all names of the replica at points (members, names)."""
        whole = np.tile(self._held, (len(points), 1))
        whole[:, self._columns] = values_of(self.free, points)
        return whole

    def deviations(self, points: FloatArray, only: Sequence[int] | None = None) -> list[FloatArray]:
        """Return model minus way-points for each recording (members, channels, times); 0 where nothing counts, FAR where a run diverged."""
        rows = np.atleast_2d(points)
        chosen = range(len(self.recorded)) if only is None else only
        found = []
        for position, readings in zip(chosen, self.replica.readings(self._values(rows), only, 0.0, self.until), strict=True):
            measured = np.array([self.recorded[position].values[name] for name in self.recorded[position].channels])
            deviation = readings - measured
            ignored = np.isnan(measured) | (self.recorded[position].time > self.until)
            deviation = np.where(ignored, 0.0, np.where(np.abs(deviation) < FAR, deviation, FAR * np.sign(deviation + 1e-300)))
            found.append(np.where(np.isnan(deviation), FAR, deviation))
        return found

    def costs(self, points: FloatArray) -> FloatArray:
        """Return Q (members,) [m^2], and remember it."""
        rows = np.atleast_2d(points)
        total = np.zeros(len(rows))
        for deviation, weights in zip(self.deviations(rows), self._weights, strict=True):
            total += np.einsum("mct,c->m", np.square(deviation), weights) / deviation.shape[2]
        total /= len(self.recorded)
        self.history.points += list(rows)
        self.history.costs += [float(cost) for cost in total]
        return total

    def vector(self, points: FloatArray) -> FloatArray:
        """Return the weighted deviations in floors (members, numbers), whose squares add up to the misfit."""
        return np.concatenate([rows.reshape(len(rows), -1) for rows in self.news(points)], axis=1)

    def news(self, points: FloatArray) -> list[FloatArray]:
        """Return what is new in the deviations of each recording, in floors (members, channels, times)."""
        found = []
        for place, (deviation, weights) in enumerate(zip(self.deviations(points), self._weights, strict=True)):
            if self.wandering is None:
                found.append(deviation * (np.sqrt(weights)[:, None] / self.floor))
            else:
                time, rates = self.recorded[place].time, self.wandering.rates[place]
                found.append(whitened(deviation, weights, time, rates, self.wandering.spread, self.floor))
        return found

    def rates(self, point: FloatArray) -> tuple[FloatArray, ...]:
        """Return how fast each reading changes at a point, for each recording (channels, times) [SI/s]."""
        values = self._values(np.atleast_2d(point))
        ahead, behind = (self.replica.readings(values, None, sign * _WITHIN) for sign in (1.0, -1.0))
        return tuple(np.nan_to_num((after[0] - before[0]) / (2.0 * _WITHIN)) for after, before in zip(ahead, behind, strict=True))

    def wandering_of(self, recording: int) -> Wandering | None:
        """Return the wandering with the rates of one recording."""
        return self.wandering and Wandering(self.wandering.spread, (self.wandering.rates[recording],))

    def take_floor(self, point: FloatArray) -> None:
        """Set the floor to what is left at a point, at least what it was made with."""
        self.floor = max(self.least, self.floor * float(np.sqrt(np.square(self.vector(point)).mean())))

    def take_clock(self, point: FloatArray) -> None:
        """Set floor and wandering to those under which the deviations at a point are most likely."""
        rates = self.rates(point)
        deviations = [rows[0] for rows in self.deviations(point)]
        spread, floor = likely_wandering(deviations, self._weights, [item.time for item in self.recorded], rates)
        self.floor = max(self.least, floor)
        self.wandering = Wandering(spread, rates) if spread > 0.0 else None

    def slopes(self, point: FloatArray, wanted: Sequence[int] | None = None, here: FloatArray | None = None) -> FloatArray:
        """Return the derivatives of :meth:`vector` (numbers, names) by central differences, in one batch.

        With ``here``, the vector at the point, the differences are one-sided: half the runs, and exact enough to descend by.
        """
        count = len(self.free)
        chosen = list(range(count)) if wanted is None else list(wanted)
        steps = np.zeros((len(chosen), count))
        steps[np.arange(len(chosen)), chosen] = STEP
        if here is not None:
            return np.asarray((self.vector(point + steps) - here).T / STEP)
        moved = self.vector(np.vstack([point + steps, point - steps]))
        return np.asarray((moved[: len(chosen)] - moved[len(chosen) :]).T / (2.0 * STEP))

    def position_rms(self, point: FloatArray, settled: float = 0.0) -> list[float]:
        """Return for each recording sqrt(MSE(x) + MSE(y)) [m] of the positions from ``settled`` [s] on."""
        found = []
        for item, deviation in zip(self.recorded, self.deviations(point), strict=True):
            rows = [place for place, name in enumerate(item.channels) if same_dimension(item.prepared.plan.unit(name), "m")]
            found.append(float(np.sqrt(np.square(deviation[0][rows][:, item.time >= settled]).mean(axis=1).sum())))
        return found


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
        parents = _stochastic_uniform(1.0 / np.sqrt(np.arange(1.0, size + 1.0)), 2 * crossed + size - elite - crossed, random)
        first, second = points[parents[:crossed]], points[parents[crossed : 2 * crossed]]
        children = first + random.random(first.shape) * (second - first)
        mothers = points[parents[2 * crossed :]]
        directions = random.standard_normal(mothers.shape)
        directions *= length * random.random((len(mothers), 1)) / np.maximum(np.abs(directions).max(axis=1, keepdims=True), 1e-300)
        offspring = np.vstack([children, np.clip(mothers + directions * (high - low), low, high)])
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
    return fit(Descent(problem, tolerance=closeness, least=0.0, bent=True), start, most).values


METHODS: dict[str, Callable[[Objective, FloatArray, FloatArray, Effort, int, Tell], FloatArray]] = {
    "replay": replay,
    "genetic": genetic,
    "evolution": evolution,
    "cma": cma_search,
}
"""Name -> search. ``replay`` runs the program again and descends by least squares."""
