"""Fitting free parameters to a recording: least squares of the whitened simulation error, with the given uncertainties as penalties.

    minimise  sum_channels |W (y - y_model(p))|^2  +  sum_i ((p_i - given_i) / uncertainty_i)^2

W whitens by a noise model of the residual, taken anew between rounds. All runs of a Jacobian are one batch, and it is kept as long as
steps gain what it foretells: most machines are nearly linear in most of their values, and a step costs one run then. Within bounds the
step is the best one that keeps them. Source: Ljung, System Identification, 2nd ed., section 10.2 (damped Gauss-Newton); Nocedal, Wright,
Numerical Optimization, 2nd ed., section 10.3 (Levenberg-Marquardt).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from scipy.optimize import lsq_linear

from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.covariance import covariance_and_misfit
from lathesim.identification.noise.noise_model import NoiseModel, NoiseShapes, fit_noise_model, whitened_power
from lathesim.identification.records.fit import Fitted, Free, known_beforehand
from lathesim.identification.replay.simulator import Simulator
from lathesim.identification.signal.rounding import ROUNDING

_STEP = 3e-3
_MOST_ROUNDS = 8
_DAMPINGS = (np.array([0.03, 3.0]), np.array([30.0, 1e3, 3e4, 1e6]))
"""Factors on the last damping: two are tried at once, the stronger ones where both fail."""
_AS_FORETOLD = 0.1
"""Slopes are kept after a step whose gain differs by less than this share from what they foretold."""
ROUGH = 1e-4
"""A descent that decides between models ends when a step gains less than this share of the cost; what is reported is fitted more finely."""
_LEAST_GAIN = 0.05
"""Gain in cost under which a step is not worth its run."""

Slopes = Literal["kept", "anew", "central"]


def noise_of(residual: FloatArray, shapes: Sequence[NoiseShapes]) -> tuple[NoiseModel, ...]:
    """Return the noise model of every channel of a residual."""
    return tuple(fit_noise_model(row, shape) for row, shape in zip(residual, shapes, strict=True))


def log_likelihood(residual: FloatArray, noise: Sequence[NoiseModel], *, full_band: bool = True) -> float:
    """Return the log-likelihood of a residual (channels, samples) under its noise models, up to a constant [nats]."""
    return sum(model.log_likelihood(row, full_band=full_band) for row, model in zip(residual, noise, strict=True))


def fit(
    simulator: Simulator,
    free: Sequence[Free],
    constant: Mapping[str, float] | None = None,
    *,
    rounds: int = 3,
    iterations: int = 12,
    noise: Sequence[NoiseModel] | None = None,
    full_band: bool = False,
    tolerance: float = 1e-6,
    known: Mapping[str, FloatArray] | None = None,
    settle: float = 0.0,
    coloured: bool = False,
    slopes: Slopes = "anew",
) -> Fitted:
    """Fit the free parameters, the constant ones staying as they are.

    ``full_band`` uses all frequencies, not only those of the motion; a descent ends when a step gains less than ``tolerance`` of the cost.
    ``known`` gives slopes d channels / d value (channels, samples) that are taken as they are, by name: from a fit nearby.
    With ``settle`` the rounds go on until one gains less than so many nats: an effect that explained nearly all leaves a noise model that
    is far too loose, and a fit that ends there leaves errors which the next candidates would explain.
    ``coloured`` lets the noise be slow too: for a machine of which nothing is missing any more, as what is missing would pass for noise.
    ``slopes`` says which are given with the fit: ``kept``, the last ones taken, perhaps of values nearby, good enough to go on from and too
    rough for standard errors; ``anew``, those at its end; ``central`` differences there, for values that are reported: one-sided ones bend,
    and a mixture of values that nothing shows looks as if something did.
    """
    problem = _Problem(simulator, tuple(free), dict(constant or {}), full_band, tolerance, known or {}, coloured)
    values = np.array([item.start for item in free], dtype=float)
    values = np.clip(values, problem.low, problem.high)
    residual = problem.residual(values)
    models = tuple(noise) if noise is not None else problem.noise(values, residual)
    reached = -np.inf
    for turn in range(rounds if settle <= 0.0 else _MOST_ROUNDS):
        values, residual = problem.descend(values, residual, models, iterations if turn else max(3, iterations // 2))
        models = problem.noise(values, residual)
        before, reached = reached, log_likelihood(residual, models, full_band=full_band) - 0.5 * problem.penalty(values)
        if turn + 1 >= rounds and reached - before < settle:
            break
    if slopes == "central":
        jacobian = problem.central_jacobian(values)
    else:
        jacobian = problem.slopes(values, residual) if slopes == "kept" else problem.jacobian(values, residual)
    white = problem.whitened(jacobian, models)
    beforehand = known_beforehand(free)
    lengths = [2 * len(model.power) for model in models]
    covariance, misfit = covariance_and_misfit(white, problem.whitened(residual[None], models)[:, 0], beforehand, lengths)
    penalty = problem.penalty(values)
    likelihood = log_likelihood(residual, models, full_band=full_band)
    return Fitted(tuple(free), values, covariance, residual, models, likelihood, penalty, dict(constant or {}), jacobian, misfit)


class _Problem:
    def __init__(
        self,
        simulator: Simulator,
        free: tuple[Free, ...],
        constant: dict[str, float],
        full_band: bool,
        tolerance: float,
        known: Mapping[str, FloatArray],
        coloured: bool,
    ) -> None:
        self.simulator = simulator
        self.coloured = coloured
        self.tolerance = tolerance
        self.kept: FloatArray | None = None
        self.known = [known.get(item.name) for item in free]
        self.full_band = full_band
        self.names = [*constant, *[item.name for item in free]]
        self.fixed = np.array(list(constant.values()))
        self.low = np.array([item.low for item in free])
        self.high = np.array([item.high for item in free])
        self.scale = np.array([item.scale for item in free])
        self.given = np.array([item.given for item in free])
        uncertainty = np.array([item.uncertainty for item in free])
        self.precision = np.where(np.isfinite(uncertainty), 1.0 / np.maximum(uncertainty, 1e-300) ** 2, 0.0)

    def rows(self, values: FloatArray) -> FloatArray:
        values = np.atleast_2d(values)
        return np.hstack([np.tile(self.fixed, (len(values), 1)), values]) if len(self.fixed) else values

    def noise(self, values: FloatArray, residual: FloatArray) -> tuple[NoiseModel, ...]:
        """Return the noise models of a residual, with the machine at ``values``."""
        named = dict(zip(self.names, self.rows(values)[0].tolist(), strict=True))
        return noise_of(residual, self.simulator.noise_shapes(named, coloured=self.coloured))

    def residual(self, values: FloatArray) -> FloatArray:
        return self.simulator.residuals(self.names, self.rows(values))[0]

    def jacobian(self, values: FloatArray, residual: FloatArray) -> FloatArray:
        """Return d output / d value, shape (parameters, channels, samples), by one-sided differences that stay inside the bounds."""
        steps = _STEP * self.scale
        steps = np.where(values + steps > self.high, -steps, steps)
        if not len(values):
            return np.zeros((0, *residual.shape))
        asked = [place for place, slope in enumerate(self.known) if slope is None]
        moved = iter(self.simulator.residuals(self.names, self.rows((values + np.diag(steps))[asked])) if asked else [])
        slopes = [(residual - next(moved)) / steps[place] if slope is None else slope for place, slope in enumerate(self.known)]
        return np.array(slopes)

    def central_jacobian(self, values: FloatArray) -> FloatArray:
        """Return d output / d value, shape (parameters, channels, samples), by central differences, one-sided at a bound."""
        if not len(values):
            return np.zeros((0, *self.residual(values).shape))
        steps = np.diag(_STEP * self.scale)
        ahead, behind = np.minimum(values + steps, self.high), np.maximum(values - steps, self.low)
        found = self.simulator.residuals(self.names, self.rows(np.vstack([ahead, behind])))
        width = np.diag(ahead - behind)
        return np.array([(found[len(values) + place] - found[place]) / width[place] for place in range(len(values))])

    def whitened(self, arrays: FloatArray, models: Sequence[NoiseModel]) -> FloatArray:
        """Return arrays (n, channels, samples) whitened, as columns (channels * samples, n)."""
        rows = [model.whiten(arrays[:, channel], full_band=self.full_band) for channel, model in enumerate(models)]
        return np.concatenate(rows, axis=1).T

    def penalty(self, values: FloatArray) -> float:
        return float(np.sum(self.precision * (values - self.given) ** 2))

    def cost(self, values: FloatArray, residual: FloatArray, models: Sequence[NoiseModel]) -> float:
        return whitened_power(residual, models, full_band=self.full_band) + self.penalty(values)

    def slopes(self, values: FloatArray, residual: FloatArray) -> FloatArray:
        """Return the last Jacobian while it holds, else a new one."""
        if self.kept is None:
            self.kept = self.jacobian(values, residual)
        return self.kept

    def descend(
        self, values: FloatArray, residual: FloatArray, models: Sequence[NoiseModel], iterations: int
    ) -> tuple[FloatArray, FloatArray]:
        if not len(values):
            return values, residual
        damping = 1e-3
        cost = self.cost(values, residual, models)
        jacobian, gram = None, np.zeros((0, 0))
        white = np.zeros((0, 0))
        for _ in range(iterations):
            taken_anew = self.kept is None
            if jacobian is not (slopes := self.slopes(values, residual)):
                jacobian, white = slopes, self.whitened(slopes, models) * self.scale
                gram = white.T @ white + np.diag(self.precision * self.scale**2)
            slope = white.T @ self.whitened(residual[None], models)[:, 0] - self.precision * self.scale * (values - self.given)
            enough = _LEAST_GAIN + self.tolerance * cost
            if self._foretold(self._step(values, gram, slope, 0.0), values, gram, slope) < enough:
                break  # no step within the bounds could gain as much
            tried = self._try_steps(values, gram, slope, models, damping, cost, one=not taken_anew)
            if tried is None:
                if taken_anew:
                    break
                self.kept = None  # from slopes of another place no step gets better: once more with those of this one
                continue
            found, residual, found_cost, damping = tried
            gain, foretold = cost - found_cost, self._foretold(found, values, gram, slope)
            values, cost = found, found_cost
            if abs(gain - foretold) > _AS_FORETOLD * foretold + _LEAST_GAIN:
                self.kept = None
            if gain < enough:
                break
        return values, residual

    def _try_steps(
        self,
        values: FloatArray,
        gram: FloatArray,
        slope: FloatArray,
        models: Sequence[NoiseModel],
        damping: float,
        cost: float,
        *,
        one: bool,
    ) -> tuple[FloatArray, FloatArray, float, float] | None:
        """Return the first step that gets better (values, residual, cost, damping), none where none does; ``one`` tries one first."""
        for factors in (*(_DAMPINGS[0][:, None] if one else _DAMPINGS[:1]), _DAMPINGS[1]):
            trials = damping * factors
            candidates = np.array([self._step(values, gram, slope, amount) for amount in trials])
            residuals = self.simulator.residuals(self.names, self.rows(candidates))
            costs = [self.cost(trial, other, models) for trial, other in zip(candidates, residuals, strict=True)]
            best = int(np.argmin(costs))
            if costs[best] < cost:
                return candidates[best], residuals[best], costs[best], float(np.clip(trials[best], 1e-9, 1e6))
        return None

    def _foretold(self, found: FloatArray, values: FloatArray, gram: FloatArray, slope: FloatArray) -> float:
        """Return by how much the cost falls from ``values`` to ``found`` as far as the slopes can tell."""
        step = (found - values) / self.scale
        return float(2.0 * step @ slope - step @ gram @ step)

    def _step(self, values: FloatArray, gram: FloatArray, slope: FloatArray, amount: float) -> FloatArray:
        """Return the values after a damped step that is the best one within the bounds: one that ran into them and was cut short would take
        the other values where they belong only together with it."""
        diagonal = np.diag(gram)
        matrix = gram + amount * np.diag(diagonal + 1e-9 * max(float(diagonal.max()), 1e-300))
        step = self._undamped(matrix, slope)
        low, high = (self.low - values) / self.scale, (self.high - values) / self.scale
        if np.any(step < low) or np.any(step > high):
            step = _bounded(matrix, slope, low, high)
        return np.asarray(np.clip(values + step * self.scale, self.low, self.high))

    def _undamped(self, matrix: FloatArray, slope: FloatArray) -> FloatArray:
        """Return the step, in scales, with which the slopes vanish; none where a run grew beyond all bounds: from there is no way on."""
        if not (np.isfinite(matrix).all() and np.isfinite(slope).all()):
            return np.zeros_like(slope)
        return np.asarray(np.linalg.lstsq(matrix, slope, rcond=None)[0])


def _bounded(matrix: FloatArray, slope: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the step s between two bounds with the least s'Ms/2 - s'g, by the active-set method of Stark and Parker."""
    ridge = ROUNDING * max(float(np.diag(matrix).max()), 1e-300)
    root = np.linalg.cholesky(matrix + ridge * np.eye(len(matrix))).T
    goal = np.linalg.solve(root.T, slope)
    movable = high > low
    step = np.where(movable, 0.0, low)
    step[movable] = lsq_linear(root[:, movable], goal, bounds=(low[movable], high[movable]), method="bvls").x
    return step
