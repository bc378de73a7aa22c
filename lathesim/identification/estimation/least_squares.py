"""Fitting free parameters to a recording: least squares of the whitened simulation error, with the given uncertainties as penalties.

    minimise  sum_channels |W (y - y_model(p))|^2  +  sum_i ((p_i - given_i) / uncertainty_i)^2

W whitens by a noise model of the residual, taken anew between rounds. Source: Ljung, System Identification, 2nd ed., section 10.2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.covariance import covariance_and_misfit
from lathesim.identification.estimation.fit import Fit, Problem, Weighting
from lathesim.identification.estimation.fit import fit as descend
from lathesim.identification.noise.noise_model import NoiseModel, NoiseShapes, fit_noise_model, whitened_power
from lathesim.identification.records.fit import Fitted, Free, known_beforehand
from lathesim.identification.replay.simulator import Simulator

_MOST_ROUNDS = 8
ROUGH = 1e-4
"""A descent that decides between models ends when a step gains less than this share of the cost; what is reported is fitted more finely."""

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
    constant, known = dict(constant or {}), known or {}
    machine = _FreeMachine(simulator, tuple(item.name for item in free), constant, coloured)
    problem = Problem(machine.residuals, free, {place: known[item.name] for place, item in enumerate(free) if item.name in known})
    here = problem.begin(np.array([item.start for item in free], dtype=float))
    models = tuple(noise) if noise is not None else machine.noise(here.values, here.residual)
    reached = -np.inf
    for turn in range(rounds if settle <= 0.0 else _MOST_ROUNDS):
        most = iterations if turn else max(3, iterations // 2)
        here = descend(problem, free, here, weighting=_Whitened(models, full_band), iterations=most, tolerance=tolerance)
        models = machine.noise(here.values, here.residual)
        likelihood = log_likelihood(here.residual, models, full_band=full_band)
        before, reached = reached, likelihood - 0.5 * problem.penalty(here.values)
        if turn + 1 >= rounds and reached - before < settle:
            break
    jacobian = _slopes_at(problem, here, slopes)
    weighting = _Whitened(models, full_band)
    white, beforehand = weighting.white_slopes(jacobian, here.residual), known_beforehand(free)
    lengths = [2 * len(model.power) for model in models]
    covariance, misfit = covariance_and_misfit(white, weighting.white(here.residual), beforehand, lengths)
    penalty = problem.penalty(here.values)
    likelihood = log_likelihood(here.residual, models, full_band=full_band)
    return Fitted(tuple(free), here.values, covariance, here.residual, models, likelihood, penalty, constant, jacobian, misfit)


def _slopes_at(problem: Problem, here: Fit, wanted: Slopes) -> FloatArray:
    """Return the slopes of the residual at the end of a fit, by one of three ways."""
    if wanted == "central":
        return problem.central_slopes(here.values)
    if here.slopes is not None and (wanted == "kept" or here.fresh):
        return here.slopes
    return problem.slopes(here.values, here.residual)


@dataclass(frozen=True, eq=False)
class _Whitened(Weighting):
    """A residual (channels, samples) as the noise models of its channels make it white."""

    models: Sequence[NoiseModel]
    full_band: bool

    def power(self, residual: FloatArray) -> float:
        return whitened_power(residual, self.models, full_band=self.full_band)

    def white(self, residual: FloatArray) -> FloatArray:
        return np.asarray(self.white_slopes(residual[None], residual)[:, 0])

    def white_slopes(self, slopes: FloatArray, residual: FloatArray) -> FloatArray:
        rows = [model.whiten(slopes[:, channel], full_band=self.full_band) for channel, model in enumerate(self.models)]
        return np.concatenate(rows, axis=1).T


@dataclass(frozen=True, eq=False)
class _FreeMachine:
    """A simulator whose ``free`` values are fitted while its constant ones stay."""

    simulator: Simulator
    free: tuple[str, ...]
    constant: Mapping[str, float]
    coloured: bool

    def residuals(self, values: FloatArray) -> Sequence[FloatArray]:
        """Return the residual (channels, samples) of each row of free values."""
        rows = np.hstack([np.tile(list(self.constant.values()), (len(values), 1)), values]) if self.constant else values
        return self.simulator.residuals([*self.constant, *self.free], rows)

    def noise(self, values: FloatArray, residual: FloatArray) -> tuple[NoiseModel, ...]:
        """Return the noise models of a residual, with the machine at ``values``."""
        named = {**self.constant, **dict(zip(self.free, values.tolist(), strict=True))}
        return noise_of(residual, self.simulator.noise_shapes(named, coloured=self.coloured))
