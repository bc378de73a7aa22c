"""How well an emulated machine follows programs that were not fitted, with a band that says how well it thinks it does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.emulation.left_out import left_out
from lathesim.experiments.emulation.objective import Objective

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
class Band:
    """How far a machine may be off: a, b, z, the covariance of the values, and what they might be before the fit (values,)."""

    level: float
    share: float
    factor: float
    covariance: FloatArray
    spread: FloatArray


def own_band(fitted: Objective, point: FloatArray) -> Band:
    """Return a, b and z that suit the fitted programs where each is left out of the fit in turn."""
    spread = np.array([item.spread for item in fitted.free])
    slopes = fitted.slopes(point)
    residual = left_out(fitted, point, slopes)[0]
    noise = max(float(np.square(fitted.vector(point)[0]).mean()), 1e-12)
    inverse = np.asarray(np.linalg.inv(slopes.T @ slopes / noise + np.diag(1.0 / np.square(spread))))
    activity = np.sqrt(np.square(slopes * spread).sum(axis=1))
    level, share = _levels(residual, activity)
    size = np.sqrt(level**2 + share**2 * np.square(activity) + np.einsum("ij,jk,ik->i", slopes, inverse, slopes))
    return Band(level, share, float(np.quantile(np.abs(residual) / size, _COVERED)), inverse, spread)


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
