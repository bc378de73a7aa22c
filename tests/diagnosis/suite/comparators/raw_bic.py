"""Comparator "raw BIC": every candidate is added to a grey box in closed loop and fitted, and the best Bayesian criterion wins.

    minimise  n sum_channels log rms(y - y_model)  +  1/2 sum ((p - given)/sigma)^2,    BIC = 2 (minimum) + k log(n channels)

The residual is taken to be white; nothing is asked of chance, of a held-out recording, of the size of an effect, or of what is left. The
uncertain values of the lesson are fitted with every candidate and held by their priors; effects come in one at a time, and those that no
longer pay are taken out again. Source: G. Schwarz, Annals of Statistics 6 (1978).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

MOST_EFFECTS = 4
FITTED = 5
"""Candidates fitted in a round, of those that promise most by their linear response."""
TIE = 6.0
"""Difference of the criterion below which two candidates are as good (Kass and Raftery 1995: positive, not strong, evidence)."""
_SLOPE = 2e-3
_DAMPINGS = (0.0, 1e-2, 1.0, 1e2)


@dataclass(frozen=True)
class Candidate:
    """An effect of the grey box: ``key`` in this suite's words, its parameters, and groups of starting points.

    A group is a neutral point and points of typical size whose responses may be added: its sizes come from a linear fit when ``scalable``.
    ``told`` gives the catalogue's parameters by those of the grey box, two of which are sine and cosine of one amplitude.
    """

    key: str
    names: tuple[str, ...]
    groups: tuple[tuple[tuple[float, ...], tuple[tuple[float, ...], ...]], ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    scalable: bool = True
    told: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


class GreyBox(Protocol):
    """A rig with its recording: ``observed`` (channels, samples), uncertain values as (given, sigma) by name, and how it is simulated."""

    observed: np.ndarray
    uncertain: Mapping[str, tuple[float, float]]

    def run(self, values: Mapping[str, float]) -> np.ndarray:
        """Simulate, (channels, samples)."""


@dataclass(frozen=True)
class Fit:
    """A fitted model: values by name, the criterion's minimum, slopes by name (channels, samples) and standard errors."""

    candidates: tuple[Candidate, ...]
    values: dict[str, float]
    cost: float
    residual: np.ndarray
    slopes: dict[str, np.ndarray]
    errors: dict[str, float]

    @property
    def bic(self) -> float:
        """The criterion; less is better. The uncertain values are in every model and not counted."""
        return 2.0 * self.cost + sum(len(one.names) for one in self.candidates) * float(np.log(self.residual.size))


@dataclass(frozen=True)
class Selected:
    """What was selected: the model, and for each effect those that were as good when it came in."""

    baseline: Fit
    model: Fit
    ties: dict[str, tuple[str, ...]]


def select(box: GreyBox, candidates: Sequence[Candidate]) -> Selected:
    """Select effects by the criterion: forward, with backward elimination."""
    baseline = fit(box, (), {name: given for name, (given, _) in box.uncertain.items()}, {}, 6)
    model, ties = baseline, {}
    while len(model.candidates) < MOST_EFFECTS:
        taken = {name for one in model.candidates for name in one.names}
        left = [one for one in candidates if not taken & set(one.names)]
        promised = sorted(promises(box, model, left), key=lambda item: -item[0])
        trials = [
            fit(box, (*model.candidates, one), {**model.values, **start}, model.slopes, 4)
            for gain, one, start in promised[:FITTED]
            if gain > 0.1 * promised[0][0]
        ]
        trials = sorted((one for one in trials if one.bic < model.bic), key=lambda one: one.bic)
        if not trials:
            break
        best = trials[0]
        key = best.candidates[-1].key
        ties[key] = tuple(one.candidates[-1].key for one in trials[1:] if one.bic - best.bic < TIE)
        model = fit(box, best.candidates, best.values, {}, 2)
        model = _thinned(box, model)
        if key not in {one.key for one in model.candidates}:
            break
    return Selected(baseline, model, ties)


def _thinned(box: GreyBox, model: Fit) -> Fit:
    """Take out effects whose parameters the criterion no longer pays for; the last one stays."""
    for one in model.candidates[:-1]:
        rest = tuple(other for other in model.candidates if other is not one)
        values = {name: value for name, value in model.values.items() if name not in one.names}
        without = fit(box, rest, values, model.slopes, 2)
        if without.bic < model.bic:
            return without
    return model


def promises(box: GreyBox, model: Fit, candidates: Sequence[Candidate]) -> list[tuple[float, Candidate, dict[str, float]]]:
    """Return for each candidate what its responses, beside those of the free values, would gain linearly, and from where to start."""
    weights = 1.0 / _rms(model.residual)[:, None]
    flat = (model.residual * weights).ravel()
    free = np.array([(slope * weights).ravel() for slope in model.slopes.values()]).T.reshape(flat.size, -1)
    basis = np.linalg.qr(free / np.maximum(np.linalg.norm(free, axis=0), 1e-300))[0]
    flat = flat - basis @ (basis.T @ flat)
    simulated = box.observed - model.residual
    found = []
    for one in candidates:
        best: tuple[float, dict[str, float]] | None = None
        for neutral, points in one.groups:
            moves = [box.run({**model.values, **dict(zip(one.names, point, strict=True))}) - simulated for point in points]
            rows = np.array([(move * weights).ravel() for move in moves]).T
            if not np.isfinite(rows).all() or not rows.any():
                continue
            rows = rows - basis @ (basis.T @ rows)
            sizes = np.linalg.lstsq(rows, flat, rcond=None)[0]
            start = np.array(points[0])
            if one.scalable:
                start = np.array(neutral) + sum(s * (np.array(p) - neutral) for s, p in zip(sizes, points, strict=True))
                start = np.clip(start, one.low, one.high)
                sizes = sizes if np.any(start != np.array(neutral)) else 0.0 * sizes
            gain = float(flat @ flat - np.sum((flat - rows @ sizes) ** 2))
            if best is None or gain > best[0]:
                best = gain, dict(zip(one.names, start.tolist(), strict=True))
        if best is not None:
            found.append((best[0], one, best[1]))
    return found


def fit(
    box: GreyBox, candidates: tuple[Candidate, ...], start: Mapping[str, float], known: Mapping[str, np.ndarray], iterations: int
) -> Fit:
    """Fit all free values from ``start`` by damped Gauss-Newton steps; slopes in ``known`` are taken as they are."""
    names = [*box.uncertain, *[name for one in candidates for name in one.names]]
    values = np.array([start[name] for name in names])
    prior = {name: sigma for name, (_, sigma) in box.uncertain.items()}
    low = np.array([*[given - 4.0 * sigma for given, sigma in box.uncertain.values()], *[low for one in candidates for low in one.low]])
    high = np.array([*[given + 4.0 * sigma for given, sigma in box.uncertain.values()], *[high for one in candidates for high in one.high]])
    typical = [np.abs(np.array(point)) for one in candidates for point in (_typical(one),)]
    scale = np.array([*prior.values(), *[max(size, 1e-9) for sizes in typical for size in sizes]])
    given = np.array([*[given for given, _ in box.uncertain.values()], *[0.0] * (len(names) - len(prior))])
    precision = np.array([*[1.0 / sigma**2 for sigma in prior.values()], *[0.0] * (len(names) - len(prior))])

    def residual_of(point: np.ndarray) -> np.ndarray:
        return np.asarray(box.observed - box.run(dict(zip(names, point.tolist(), strict=True))))

    def cost_of(point: np.ndarray, residual: np.ndarray) -> float:
        if not np.isfinite(residual).all():
            return np.inf
        return float(residual.shape[1] * np.sum(np.log(_rms(residual))) + 0.5 * np.sum(precision * (point - given) ** 2))

    values = np.clip(values, low, high)
    residual = residual_of(values)
    cost = cost_of(values, residual)
    if not np.isfinite(cost):
        return Fit(candidates, dict(zip(names, values.tolist(), strict=True)), np.inf, box.observed, {}, {})
    slopes, gram = _slopes(names, values, residual, scale, high, known, residual_of), np.eye(len(names))
    for turn in range(iterations):
        weights = 1.0 / _rms(residual)[:, None]
        rows = np.array([(slope * weights).ravel() for slope in slopes]).T * scale
        gram = rows.T @ rows + np.diag(precision * scale**2)
        down = rows.T @ (residual * weights).ravel() - precision * scale * (values - given)
        for damping in _DAMPINGS:
            step = np.linalg.lstsq(gram + damping * np.diag(np.diag(gram)) + 1e-12 * np.eye(len(names)), down, rcond=None)[0] * scale
            there = np.clip(values + step, low, high)
            other = residual_of(there)
            lower = cost_of(there, other)
            if lower < cost:
                break
        else:
            break
        gained, values, residual, cost = cost - lower, there, other, lower
        if gained < 0.5:
            break
        if turn < iterations - 1:
            slopes = _slopes(names, values, residual, scale, high, known, residual_of)
    errors = np.sqrt(np.maximum(np.diag(np.linalg.pinv(gram)), 0.0)) * scale
    by_name = dict(zip(names, values.tolist(), strict=True))
    return Fit(candidates, by_name, cost, residual, dict(zip(names, slopes, strict=True)), dict(zip(names, errors.tolist(), strict=True)))


def _slopes(
    names: Sequence[str], values: np.ndarray, residual: np.ndarray, scale: np.ndarray, high: np.ndarray, known: Mapping[str, np.ndarray],
    residual_of: Callable[[np.ndarray], np.ndarray],
) -> list[np.ndarray]:  # fmt: skip
    """Return what each value changes in the channels (channels, samples), by one-sided differences that stay within the bounds."""
    slopes = []
    for place, name in enumerate(names):
        if name in known:
            slopes.append(known[name])
            continue
        step = _SLOPE * max(float(scale[place]), 0.1 * abs(float(values[place])))
        moved = values.copy()
        moved[place] += -step if moved[place] + step > high[place] else step
        slope = (residual - residual_of(moved)) / (moved[place] - values[place])
        slopes.append(np.nan_to_num(slope, posinf=0.0, neginf=0.0))
    return slopes


def _typical(one: Candidate) -> np.ndarray:
    return np.abs(np.array([point for _, points in one.groups for point in points])).max(axis=0)


def _rms(residual: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(residual**2, axis=1)) + 1e-15
