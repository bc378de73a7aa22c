"""What a fitted machine leaves out: on stretches and programs that were not fitted, as noise, and over each of its values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.objective import Objective

_WIDEST = float(np.log(100.0))
"""Logarithm of the factor from which an interval is told as none."""
_FEWEST = 40
"""Way-points from which a channel is tested."""
_PIECES = 4
"""Pieces of time into which a recording is cut, each of which is left out once; assumed."""
_RELATED = 10
"""Way-points that count as one where deviations are compared: neighbours err alike; assumed."""


def left_out(
    objective: Objective, point: FloatArray, slopes: FloatArray | None = None, judge: Objective | None = None
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return the deviations (numbers,) in floors of each stretch from a machine fitted to the others, and the slopes (numbers, values).

    With a ``judge`` the deviations are counted as that objective counts them.

    With r and J the deviations and derivatives at the best point p, P the weight of what the lesson says, and rows i of one stretch:

        d = -(J_o' J_o / s^2 + P)^-1 (J_o' r_o / s^2 + P p),   o: all other rows;   r_i + J_i d

    which is the fit to the others on straight lines. Each recording is cut into four stretches of time. Whole recordings are not left out:
    what one designed program tells the others cannot. Source: D. M. Allen, Technometrics 16 (1974), 125, for single rows; D. R. Roberts et
    al., Ecography 40 (2017), 913, for stretches of what is related.
    """
    residual = objective.vector(point)[0]
    slopes = objective.slopes(point) if slopes is None else slopes
    pull = np.diag([1.0 / item.spread**2 for item in objective.free])
    noise = max(float(np.square(residual).mean()), 1e-12)
    found, ahead = (residual, slopes) if judge is None else (judge.vector(point)[0], judge.slopes(point))
    found = found.copy()
    owner = owners(objective)
    for one in np.unique(owner):
        own, others = owner == one, owner != one
        matrix = slopes[others].T @ slopes[others] / noise + pull
        shift = np.linalg.solve(matrix, -(slopes[others].T @ residual[others] / noise + pull @ point))
        found[own] += ahead[own] @ shift
    return found, slopes


def owners(objective: Objective) -> FloatArray:
    """Return for each number of the objective's vector the piece of a program that it belongs to."""
    found = []
    for number, item in enumerate(objective.recorded):
        pieces = number * _PIECES + np.arange(len(item.time)) * _PIECES // len(item.time)
        found += [pieces for _ in item.channels]
    return np.concatenate(found)


def gained(before: FloatArray, after: FloatArray) -> float:
    """Return by how many standard errors the squares of deviations fell: neighbours are taken together.

    Source: A. Vehtari, A. Gelman, J. Gabry, Statistics and Computing 27 (2017), section 5, with squares for log densities.
    """
    fell = np.square(before) - np.square(after)
    sums = fell[: len(fell) // _RELATED * _RELATED].reshape(-1, _RELATED).sum(axis=1)
    error = float(sums.std(ddof=1)) * np.sqrt(len(sums)) if len(sums) > 1 else np.inf
    return float(sums.sum()) / max(error, 1e-300)


_TREES = 200
_TRIED = 200
"""Points from which trees are grown; a search that tried fewer is given more."""
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
    if len(points) < _TRIED:
        from scipy.stats import qmc

        points = np.clip(low + qmc.Sobol(len(low), seed=seed).random(256) * (high - low), low, high)
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
    return float(np.exp(width)) if width < _WIDEST else None


_LAGS = 8
_CHANCE = 1e-3
"""Probability below which what is left is no noise; assumed."""


def is_noise(objective: Objective, point: FloatArray, slopes: FloatArray | None = None) -> bool:
    """Return whether the deviations of each channel are as large and as unrelated in motion as at rest.

    Two tests: their autocorrelation over eight way-points (Ljung and Box, Biometrika 65, 1978), and their size among the fifth of the
    way-points where the values have most to show against the other half (an F test).
    """
    from scipy.stats import chi2, f

    busyness = np.square(objective.slopes(point) if slopes is None else slopes).sum(axis=1)
    taken = 0
    for deviation in objective.news(point):
        for row in deviation[0]:
            activity = busyness[taken : taken + len(row)]
            taken += len(row)
            if not np.any(activity) or len(row) < _FEWEST:
                continue
            centred = row - row.mean()
            power = float(np.square(centred).sum())
            if power == 0.0:
                continue
            related = [float((centred[lag:] * centred[:-lag]).sum() / power) for lag in range(1, _LAGS + 1)]
            sums = sum(size * size / (len(row) - lag) for lag, size in enumerate(related, 1)) * len(row) * (len(row) + 2)
            order = np.argsort(activity)
            quiet, busy = centred[order[: len(row) // 2]], centred[order[-(len(row) // 5) :]]
            ratio = float(np.square(busy).mean() / max(np.square(quiet).mean(), 1e-300))
            if chi2.sf(sums, _LAGS) < _CHANCE or f.sf(ratio, len(busy), len(quiet)) < _CHANCE:
                return False
    return True


_COVERED = 0.95


@dataclass(frozen=True)
class Unseen:
    """One recording that was not fitted: rms of each channel [SI], the largest deviation, and which share of the points is in the band."""

    name: str
    rms: dict[str, float]
    largest: dict[str, float]
    covered: float
    band: dict[str, FloatArray]
    deviation: dict[str, FloatArray]


@dataclass(frozen=True, eq=False)
class DeviationBand:
    """How far a machine may be off: a, b, z, the covariance of the values, and what they might be before the fit (values,)."""

    level: float
    share: float
    factor: float
    covariance: FloatArray
    spread: FloatArray


def own_band(fitted: Objective, point: FloatArray) -> DeviationBand:
    """Return a, b and z that suit the fitted programs where each is left out of the fit in turn."""
    spread = np.array([item.spread for item in fitted.free])
    slopes = fitted.slopes(point)
    residual = left_out(fitted, point, slopes)[0]
    noise = max(float(np.square(fitted.vector(point)[0]).mean()), 1e-12)
    inverse = np.asarray(np.linalg.inv(slopes.T @ slopes / noise + np.diag(1.0 / np.square(spread))))
    activity = np.sqrt(np.square(slopes * spread).sum(axis=1))
    level, share = _levels(residual, activity)
    size = np.sqrt(level**2 + share**2 * np.square(activity) + np.einsum("ij,jk,ik->i", slopes, inverse, slopes))
    return DeviationBand(level, share, float(np.quantile(np.abs(residual) / size, _COVERED)), inverse, spread)


def judge_unseen(fitted: Objective, unseen: Objective, point: FloatArray) -> list[Unseen]:
    """Return how the fitted machine does on recordings that were not fitted.

    The band is +-z s with s^2 = a^2 + b^2 g^2 + j C j'. C is the covariance of the values, g^2 what the values' own uncertainty before the
    fit would make of a reading: a structure that is not quite right errs where the machine has something to show. a, b and z are those
    that suit the fitted programs where each is left out of the fit in turn: by likelihood, and so that 95 % of their points are inside.
    Where the control's clock wanders, it is off by q t after a time t, and an axis at speed v by v^2 q t more.
    """
    own = own_band(fitted, point)
    ahead = unseen.slopes(point)
    activity = np.square(ahead * own.spread).sum(axis=1)
    reach = np.sqrt(own.level**2 + own.share**2 * activity + np.einsum("ij,jk,ik->i", ahead, own.covariance, ahead))
    deviations, found, taken = unseen.deviations(point), [], 0
    rates = unseen.rates(point)
    for place, (item, deviation) in enumerate(zip(unseen.recorded, deviations, strict=True)):
        count = len(item.time)
        bands: dict[str, FloatArray] = {}
        inside: list[FloatArray] = []
        for row, name in enumerate(item.channels):
            weight = np.sqrt(unseen._weight(item, name)) or 1.0
            late = fitted.wandering.spread * item.time if fitted.wandering else 0.0
            size = np.square(unseen.floor / weight * reach[taken : taken + count]) + late * np.square(rates[place][row])
            bands[name] = own.factor * np.sqrt(size)
            taken += count
            inside.append(np.abs(deviation[0][row]) <= bands[name])
        rms = {name: float(np.sqrt(np.square(deviation[0][row]).mean())) for row, name in enumerate(item.channels)}
        largest = {name: float(np.abs(deviation[0][row]).max()) for row, name in enumerate(item.channels)}
        drawn = {name: deviation[0][row] for row, name in enumerate(item.channels)}
        found.append(Unseen(item.name, rms, largest, float(np.mean(inside)), bands, drawn))
    return found


def _levels(residual: FloatArray, activity: FloatArray) -> tuple[float, float]:
    """Return a and b of the variance a^2 + b^2 g^2 under which the deviations are most likely, from a grid."""
    total = float(np.sqrt(np.square(residual).mean())) or 1e-9
    active = float(np.sqrt(np.square(activity).mean())) or 1.0
    best, found = np.inf, (total, 0.0)
    for constant in total * np.geomspace(0.03, 1.5, 16):
        for share in total / active * np.concatenate([[0.0], np.geomspace(0.03, 2.0, 16)]):
            variance = constant**2 + share**2 * np.square(activity)
            cost = float((np.log(variance) + np.square(residual) / variance).sum())
            if cost < best:
                best, found = cost, (float(constant), float(share))
    return found
