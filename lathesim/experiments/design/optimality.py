"""Optimal designs over a set of settings: which to measure, and for which share of the time.

Precision: the information of weights w over settings with regressors f_i is M = sum w_i f_i f_i' (+ prior); D makes ln det M largest, A the
trace of its inverse smallest, E its smallest eigenvalue largest. Discrimination: T makes the sum of squares largest that the best rival
leaves of the truth. A singular M is never inverted: the combination that does not show is told.

Source: Atkinson, Donev, Tobias, Optimum Experimental Designs (2007), chapters 9 to 11 and 20; Atkinson, Fedorov, Biometrika 62 (1975);
Yu, Stat. Sin. 20 (2010) (multiplicative weights).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray

_ROUNDS = 20_000
_KEPT = 1e-4
"""Weight below which a setting is not part of a design."""
_SINGULAR = 1e-12
"""Ratio of eigenvalues below which information is singular."""


@dataclass(frozen=True, eq=False)
class Design:
    """A design: the places (points,) of its settings, their weights, and the value of its criterion."""

    places: FloatArray
    weights: FloatArray
    value: float


def information(regressors: FloatArray, weights: FloatArray, prior: FloatArray | None = None) -> FloatArray:
    """Return sum w f f' (+ prior) for regressors (settings, values) and weights (settings,)."""
    matrix = regressors.T @ (regressors * weights[:, None])
    return np.asarray(matrix if prior is None else matrix + prior)


def hidden_combinations(matrix: FloatArray, names: Sequence[str]) -> list[str]:
    """Return, in words, the combinations of values on which information (values, values) is singular; none where it is not."""
    values, vectors = np.linalg.eigh(matrix)
    told = []
    for size, vector in zip(values, vectors.T, strict=True):
        if size > _SINGULAR * max(float(values[-1]), 1e-300):
            continue
        vector = vector / vector[int(np.argmax(np.abs(vector)))]
        parts = [(name, share) for name, share in zip(names, vector, strict=True) if abs(share) > 1e-6]
        if len(parts) == 1:
            told.append(f"{parts[0][0]} does not show.")
        elif len(parts) == 2 and abs(abs(parts[0][1]) - abs(parts[1][1])) < 1e-6:
            word = "sum" if parts[0][1] * parts[1][1] < 0.0 else "difference"
            told.append(f"Only the {word} of {parts[0][0]} and {parts[1][0]} shows, and neither of them alone.")
        else:
            text = " ".join(f"{share:+.3g} {name}" for name, share in parts)
            told.append(f"Nothing shows along {text}.")
    return told


def criterion_value(matrix: FloatArray, criterion: str) -> float:
    """Return ln det (D), minus the trace of the inverse (A) or the smallest eigenvalue (E); minus infinity where D or A has none."""
    values = np.linalg.eigvalsh(matrix)
    if criterion == "E":
        return float(values[0])
    if values[0] <= _SINGULAR * max(float(values[-1]), 1e-300):
        return -np.inf
    return float(np.log(values).sum()) if criterion == "D" else float(-(1.0 / values).sum())


def d_optimal(places: FloatArray, regressors: FloatArray) -> Design:
    """Return the D-optimal weights over settings, by multiplicative steps w_i <- w_i f_i' M^-1 f_i / p; value is det M.

    Raises ``ValueError`` with the hidden combinations where no weights make the information regular.
    """
    count, size = regressors.shape
    weights = np.full(count, 1.0 / count)
    hidden = hidden_combinations(information(regressors, weights), [f"value {number + 1}" for number in range(size)])
    if hidden:
        raise ValueError(" ".join(hidden))
    for _ in range(_ROUNDS):
        inverse = np.linalg.inv(information(regressors, weights))
        variance = np.einsum("ij,jk,ik->i", regressors, inverse, regressors)
        weights = weights * variance / size
        if variance.max() < size * (1.0 + 1e-9):
            break
    weights[weights < _KEPT / count] = 0.0
    weights /= weights.sum()
    kept = weights > _KEPT
    return Design(places[kept], weights[kept], float(np.linalg.det(information(regressors, weights))))


def t_optimal(places: FloatArray, truth: FloatArray, rival: Callable[[FloatArray], FloatArray] | FloatArray) -> Design:
    """Return the T-optimal weights over settings (points,) between a truth (points,) and a linear rival (points, values).

    T = max over w of min over b of sum w (truth - rival b)^2 is the square of the Chebyshev error of the best rival, so the support is
    where that error is reached, and the weights are those with which the rival's least squares have it as their residual.
    """
    from scipy.optimize import linprog, nnls

    regressors = np.asarray(rival(places) if callable(rival) else rival, dtype=float)
    size = regressors.shape[1]
    bound = np.ones((len(places), 1))
    above = np.block([[-regressors, -bound], [regressors, -bound]])
    found = linprog(
        np.r_[np.zeros(size), 1.0], A_ub=above, b_ub=np.r_[-truth, truth], bounds=[(None, None)] * size + [(0, None)], method="highs"
    )
    error = truth - regressors @ found.x[:size]
    largest = float(np.abs(error).max())
    support = _peaks(error, largest)
    rows = np.vstack([(regressors[support] * np.sign(error[support])[:, None]).T, np.ones(len(support))])
    weights, _ = nnls(rows, np.r_[np.zeros(size), 1.0])
    kept = weights > _KEPT
    return Design(places[support][kept], weights[kept], largest**2)


def _peaks(error: FloatArray, largest: float) -> FloatArray:
    """Return where the error reaches its largest size: the top of each stretch of one sign."""
    signs = np.sign(error)
    edges = np.flatnonzero(np.diff(signs)) + 1
    tops = []
    for stretch in np.split(np.arange(len(error)), edges):
        top = stretch[int(np.argmax(np.abs(error[stretch])))]
        if abs(error[top]) > largest * (1.0 - 1e-4):
            tops.append(top)
    return np.array(tops)
