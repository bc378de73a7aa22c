"""Fitting free parameters to a recording: least squares of the whitened simulation error, with the given uncertainties as penalties.

    minimise  sum_channels |W (y - y_model(p))|^2  +  sum_i ((p_i - given_i) / uncertainty_i)^2

W whitens by a noise model of the residual, taken anew between rounds. Source: Ljung, System Identification, 2nd ed., section 10.2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypedDict, Unpack

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.covariance import covariance_and_misfit
from lathesim.identification.estimation.fit import Asking, Descent, Fit, Problem, Weighting, descending, side_by_side
from lathesim.identification.noise import NoiseModel, fit_noise_model, whitened, whitened_power
from lathesim.identification.records import Fitted, Free, known_beforehand
from lathesim.identification.replay.simulator import Simulator

ROUGH = 1e-4
"""A descent that decides between models ends when a step gains less than this share of the cost; what is reported is fitted more finely."""
SETTLED = 1.0
"""Gain below which a further round of a fit is not made [nats]."""

Slopes = Literal["corrected", "kept", "anew", "central"]


def log_likelihood(residual: FloatArray, noise: Sequence[NoiseModel], *, full_band: bool = True) -> float:
    """Return the log-likelihood of a residual (channels, samples) under its noise models, up to a constant [nats]."""
    return sum(model.log_likelihood(row, full_band=full_band) for row, model in zip(residual, noise, strict=True))


class Manner(TypedDict, total=False):
    """How a fit is made: the arguments of :func:`fit` after its values, with their usual values.

    ``full_band`` (no) uses all frequencies, not only those of the motion. There are so many ``rounds`` (3), with a noise model taken anew
    after each; ``noise`` gives that of the first. A descent ends after so many ``iterations`` (12), or when a step gains less than
    ``tolerance`` (1e-6) of the cost.
    With ``settle`` (0) the rounds go on until one gains less than so many nats: an effect that explained nearly all leaves a noise model
    that is far too loose, and a fit that ends there leaves errors which the next candidates would explain.
    ``coloured`` (no) lets the noise be slow too: for a machine of which nothing is missing any more, as what is missing would pass for
    noise.
    ``slopes`` (anew) says which are given with the fit: ``kept``, the last ones taken, perhaps of values nearby, good enough to go on from
    and too rough for standard errors; ``corrected``, such that steps have corrected, for a fit that only decides; ``anew``, those at its
    end; ``central`` differences there, for values that are reported: one-sided ones bend, and a mixture of values that nothing shows looks
    as if something did.
    """

    rounds: int
    iterations: int
    noise: Sequence[NoiseModel] | None
    full_band: bool
    tolerance: float
    settle: float
    coloured: bool
    slopes: Slopes


_USUAL: Manner = {
    "rounds": 3, "iterations": 12, "noise": None, "full_band": False, "tolerance": 1e-6, "settle": 0.0, "coloured": False, "slopes": "anew",
}  # fmt: skip


class Begun(NamedTuple):
    """Where a fit begins: what is free, and the constant values that are set. ``known`` gives slopes d channels / d value (channels,
    samples) that are taken as they are, by name: from a fit nearby."""

    free: Sequence[Free]
    constant: Mapping[str, float] | None = None
    known: Mapping[str, FloatArray] | None = None


def fit(simulator: Simulator, free: Sequence[Free], constant: Mapping[str, float] | None = None, **manner: Unpack[Manner]) -> Fitted:
    """Fit the free parameters, the constant ones staying as they are."""
    return fit_each(simulator, [Begun(free, constant)], **manner)[0]


def fit_each(simulator: Simulator, begun: Sequence[Begun], **manner: Unpack[Manner]) -> list[Fitted]:
    """Return the fit from each beginning. They are made side by side: what all of them need at one time is one batch of runs."""
    machines = [_FreeMachine(simulator, tuple(item.name for item in one.free), dict(one.constant or {})) for one in begun]
    names = list(dict.fromkeys(name for machine in machines for name in (*machine.constant, *machine.free)))

    def residuals(places: list[int], rows: list[FloatArray]) -> Sequence[FloatArray]:
        """Return the residual (channels, samples) of all rows of free values."""
        return simulator.residuals(names, np.vstack([machines[place].rows(names, some) for place, some in zip(places, rows, strict=True)]))

    return side_by_side([_fitting(machine, one, _USUAL | manner) for machine, one in zip(machines, begun, strict=True)], residuals)


def _fitting(machine: _FreeMachine, begun: Begun, manner: Manner) -> Asking[Fitted]:
    """Ask for what :func:`fit` returns."""
    free, known, full_band, coloured = begun.free, begun.known or {}, manner["full_band"], manner["coloured"]
    problem = Problem(_unasked, free, {place: known[item.name] for place, item in enumerate(free) if item.name in known})
    here = yield from problem.beginning(np.array([item.start for item in free], dtype=float))
    models = machine.noise(here, coloured=coloured) if manner["noise"] is None else tuple(manner["noise"])
    reached = -np.inf
    for turn in range(manner["rounds"] if manner["settle"] <= 0.0 else 8):
        most = manner["iterations"] if turn else max(3, manner["iterations"] // 2)
        how = Descent(problem, _Whitened(models, full_band), manner["tolerance"], corrects=manner["slopes"] == "corrected")
        here = yield from descending(how, here, most)
        models = machine.noise(here, coloured=coloured)
        likelihood = log_likelihood(here.residual, models, full_band=full_band)
        before, reached = reached, likelihood - 0.5 * problem.penalty(here.values)
        if turn + 1 >= manner["rounds"] and reached - before < manner["settle"]:
            break
    jacobian = yield from _slopes_at(problem, here, manner["slopes"])
    weighting = _Whitened(models, full_band)
    white, beforehand = weighting.white_slopes(jacobian, here.residual), known_beforehand(free)
    lengths = [2 * (len(model.power) if full_band else model.bins(full_band=False)) for model in models]
    covariance, misfit = covariance_and_misfit(white, weighting.white(here.residual), beforehand, lengths)
    penalty = problem.penalty(here.values)
    likelihood = log_likelihood(here.residual, models, full_band=full_band)
    return Fitted(tuple(free), here.values, covariance, here.residual, models, likelihood, penalty, machine.constant, jacobian, misfit)


def _unasked(values: FloatArray) -> Sequence[FloatArray]:
    """Refuse: what fits side by side need is answered for all of them."""
    raise NotImplementedError


def _slopes_at(problem: Problem, here: Fit, wanted: Slopes) -> Asking[FloatArray]:
    """Ask for the slopes of the residual at the end of a fit, by one of three ways."""
    if wanted == "central":
        return (yield from problem.central(here.values, here.residual, wide=here.rough))
    if here.slopes is not None and (wanted in ("corrected", "kept") or here.fresh):
        return here.slopes
    return (yield from problem.sloping(here.values, here.residual, wide=here.rough))


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
        return whitened(self.models, slopes, full_band=self.full_band).T


@dataclass(frozen=True, eq=False)
class _FreeMachine:
    """A simulator whose ``free`` values are fitted while its constant ones stay."""

    simulator: Simulator
    free: tuple[str, ...]
    constant: Mapping[str, float]

    def rows(self, names: Sequence[str], values: FloatArray) -> FloatArray:
        """Return rows of free values as rows of ``names``; those that are not set here have the machine's value."""
        set_here = {**dict.fromkeys(self.free, 0.0), **self.constant}
        found = np.tile([set_here[name] if name in set_here else self.simulator.given(name) for name in names], (len(values), 1))
        found[:, [names.index(name) for name in self.free]] = values
        return found

    def noise(self, here: Fit, *, coloured: bool) -> tuple[NoiseModel, ...]:
        """Return the noise models of the residual of a fit, with the machine at its values."""
        named = {**self.constant, **dict(zip(self.free, here.values.tolist(), strict=True))}
        return tuple(map(fit_noise_model, here.residual, self.simulator.noise_shapes(named, coloured=coloured)))
