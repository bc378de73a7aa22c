"""The precision of a design: what measured settings say about values, by the criteria D, A and E.

The information of weights w over settings with regressors f_i is M = sum w_i f_i f_i' (+ prior); D makes ln det M largest, A the trace of
its inverse smallest, E its smallest eigenvalue largest. A singular M is never inverted: the combination that does not show is named.

Source: Atkinson, Donev, Tobias, Optimum Experimental Designs (2007), chapters 9 to 11.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lathesim.engine.assembly import FloatArray

_SINGULAR = 1e-12
"""Ratio of eigenvalues below which information is singular."""


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
