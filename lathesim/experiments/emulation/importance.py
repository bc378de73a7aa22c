"""Which values an emulation hangs on: by tree ensembles over the points that were tried, and by profiles of the likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.emulation.objective import Objective

_TREES = 200
_FEWEST = 200
_PROFILED = 0.02


@dataclass(frozen=True)
class Importance:
    """One value: its share of the trees' importance, and by which factor it may be off before the misfit says so (None: it never does)."""

    name: str
    trees: float
    profile: float | None


def importances(objective: Objective, point: FloatArray, noise: float, low: FloatArray, high: FloatArray, seed: int) -> list[Importance]:
    """Return the importance of each value, the most important first.

    Trees: least-squares boosting of log Q over all points tried, importance as the squared risk taken away at the nodes that split on a
    value, averaged over the trees (Tiwari et al. 2023, equation 6), here as shares of one. A search that tried few points is given 200
    more, spread over the bounds. Profile: the value is moved and all others follow it along the best linear answer; told is the
    factor at which the misfit has grown by 1.96^2 noise levels. Source: Raue et al., Bioinformatics 25 (2009).
    """
    names = [item.name for item in objective.free]
    trees = _trees(objective, low, high, seed)
    profiles = _profiles(objective, point, noise, low, high)
    found = [Importance(name, float(share), profile) for name, share, profile in zip(names, trees, profiles, strict=True)]
    return sorted(found, key=lambda item: -item.trees)


def _trees(objective: Objective, low: FloatArray, high: FloatArray, seed: int) -> FloatArray:
    try:
        from sklearn.ensemble import GradientBoostingRegressor
    except ImportError:
        return np.full(len(low), np.nan)
    points, costs = np.array(objective.history.points), np.array(objective.history.costs)
    if len(points) < _FEWEST:
        from scipy.stats import qmc

        spread = qmc.Sobol(len(low), seed=seed).random(256)
        points = np.clip(low + spread * (high - low), low, high)
        kept = len(objective.history.costs)
        costs = objective.costs(points)
        del objective.history.points[kept:], objective.history.costs[kept:]
    model = GradientBoostingRegressor(n_estimators=_TREES, max_depth=3, learning_rate=0.1, random_state=seed)
    model.fit(points, np.log(np.maximum(costs, 1e-18)))
    return np.asarray(model.feature_importances_)


def _profiles(objective: Objective, point: FloatArray, noise: float, low: FloatArray, high: FloatArray) -> list[float | None]:
    slopes = objective.slopes(point) * (objective.floor / noise)
    gram = slopes.T @ slopes
    inverse = np.linalg.pinv(gram + 1e-9 * np.eye(len(gram)), hermitian=True)
    here = float(np.square(objective.vector(point)[0]).sum()) * (objective.floor / noise) ** 2
    ends = []
    for place in range(len(point)):
        width = 1.96 * np.sqrt(max(inverse[place, place], 0.0))
        direction = inverse[:, place] / max(inverse[place, place], 1e-300)
        reach = min(width, float(high[place] - low[place]))
        ends += [np.clip(point + sign * reach * direction, low, high) for sign in (1.0, -1.0)]
    costs = np.square(objective.vector(np.array(ends))).sum(axis=1) * (objective.floor / noise) ** 2 - here
    return [_factor(point, place, ends, costs) for place in range(len(point))]


def _factor(point: FloatArray, place: int, ends: Sequence[FloatArray], costs: FloatArray) -> float | None:
    """Return the factor at which the misfit has grown by 3.84, by a parabola through what the two ends cost."""
    grown = max(float(costs[2 * place : 2 * place + 2].max()), 1e-12)
    moved = max(abs(float(ends[2 * place][place] - point[place])), abs(float(ends[2 * place + 1][place] - point[place])))
    if moved == 0.0 or grown < _PROFILED:
        return None
    width = moved * np.sqrt(3.84 / grown)
    return float(np.exp(width)) if width < np.log(100.0) else None
