"""What a machine leaves of a stretch when it is fitted to the rest: a look at what was not fitted, without running anything again."""

from __future__ import annotations

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.emulation.objective import Objective

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
    whole = len(fell) // _RELATED * _RELATED
    sums = fell[:whole].reshape(-1, _RELATED).sum(axis=1)
    error = float(sums.std(ddof=1)) * np.sqrt(len(sums)) if len(sums) > 1 else np.inf
    return float(sums.sum()) / max(error, 1e-300)
