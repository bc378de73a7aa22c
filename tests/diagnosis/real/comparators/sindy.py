"""Comparator "SINDy on three residuals": sparse regression of what is left over on a library of terms, each term standing for an effect.

The residuals of force, drive and geometry are taken from the filtered recording, without a simulation. In each, terms are taken out one
after the other until every one left is worth its place (stepwise sparse regression, the thresholding that collinear libraries need); this
is repeated on blocks drawn anew, and a term is kept that survives in most of the draws. What a wrong mass, gain or friction coefficient
leaves is in every regression, held by the lesson's uncertainties, and never taken out.

Sources: S. L. Brunton, J. L. Proctor, J. N. Kutz, PNAS 113 (2016); L. Boninsegna, F. Nueske, C. Clementi, J. Chem. Phys. 148 (2018);
U. Fasel, J. N. Kutz, B. W. Brunton, S. L. Brunton, Ensemble-SINDy, Proc. R. Soc. A 478 (2022).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

DRAWS = 30
BLOCKS = 40
KEPT = 0.6
"""Share of the draws in which a term has to survive."""
THRESHOLD = 0.06
"""Share of the residual's square, less what the baseline takes of it, that a term must remove beside the others."""
MOST = 4


@dataclass(frozen=True)
class Residual:
    """A residual (samples,) and its library.

    ``baseline`` holds columns with the standard deviation of their coefficients (infinite: free); ``terms`` the columns (samples, n) of an
    effect by its key, other forms of the same as ``key:form``; ``ties`` what a key's columns stand for as well. What a term removes has to
    be of at least the size ``smallest`` (root mean square): the threshold of the regression, in the residual's unit.
    """

    values: np.ndarray
    baseline: Sequence[tuple[np.ndarray, float]]
    terms: Mapping[str, np.ndarray]
    smallest: float = 0.0
    ties: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


class _Grams:
    """Inner products of all columns and the residual, block by block, so that a draw is a sum; ``owner`` names each column's term."""

    def __init__(self, residual: Residual) -> None:
        self.smallest = residual.smallest**2 * len(residual.values)
        columns = [("", column, deviation) for column, deviation in residual.baseline]
        for name, term in residual.terms.items():
            columns += [(name, column, np.inf) for column in term.reshape(len(residual.values), -1).T]
        sizes = [float(np.sqrt(np.mean(column**2))) for _, column, _ in columns]
        kept = [(one, size) for one, size in zip(columns, sizes, strict=True) if size > 0.0]
        self.owner = [name for (name, _, _), _ in kept]
        self.names = [name for name in residual.terms if name in self.owner]
        table = np.column_stack([*[column / size for (_, column, _), size in kept], residual.values])
        # a prior weighs as one sample whose error is the residual's
        power = float(np.mean(residual.values**2))
        self.prior = np.array([power / (deviation * size) ** 2 for (_, _, deviation), size in kept])
        self.blocks = np.array([block.T @ block for block in np.array_split(table, BLOCKS)])

    def missed(self, gram: np.ndarray, names: Sequence[str]) -> tuple[float, np.ndarray]:
        """Return the squared residual with the baseline and some terms fitted, and by how much more it is without each of the terms.

        With G the inner products and b the coefficients, leaving out the columns S costs b_S' ((G^-1)_SS)^-1 b_S.
        """
        kept = [place for place, owner in enumerate(self.owner) if not owner or owner in names]
        if not kept:
            return float(gram[-1, -1]), np.zeros(0)
        matrix, side = gram[np.ix_(kept, kept)].copy(), gram[kept, -1]
        matrix[np.diag_indices(len(kept))] += self.prior[kept] + 1e-7 * gram[kept, kept]
        inverse = np.linalg.pinv(matrix, hermitian=True)
        solved = inverse @ side
        costs = []
        for name in names:
            mine = [place for place, column in enumerate(kept) if self.owner[column] == name]
            costs.append(float(solved[mine] @ np.linalg.pinv(inverse[np.ix_(mine, mine)], hermitian=True) @ solved[mine]))
        return float(gram[-1, -1] - side @ solved), np.array(costs)


def active(residual: Residual) -> dict[str, float]:
    """Return the terms that survive in most draws, with the share of the residual that each removes beside the others."""
    grams = _Grams(residual)
    whole = grams.blocks.sum(axis=0)
    chosen = thresholded(grams, whole)
    counts = dict.fromkeys(chosen, 0)
    rng = np.random.default_rng(0)
    for _ in range(DRAWS if chosen else 0):
        keys = {name.partition(":")[0] for name in thresholded(grams, grams.blocks[rng.integers(0, BLOCKS, BLOCKS)].sum(axis=0))}
        for name in chosen:
            counts[name] += name.partition(":")[0] in keys
    kept = [name for name in chosen if counts[name] >= KEPT * DRAWS]
    rest, _ = grams.missed(whole, [])
    _, costs = grams.missed(whole, kept)
    return dict(zip(kept, (costs / rest).tolist(), strict=True))


def thresholded(grams: _Grams, gram: np.ndarray) -> list[str]:
    """Take terms out, always the one that is missed least for its columns, until each is worth its place."""
    kept = list(grams.names)
    rest, _ = grams.missed(gram, [])
    number = np.array([grams.owner.count(name) for name in kept])
    while kept:
        _, costs = grams.missed(gram, kept)
        least = int(np.argmin(costs / number))
        if costs[least] >= max(THRESHOLD * rest * number[least], grams.smallest):
            return kept
        kept.pop(least)
        number = np.delete(number, least)
    return kept


def sparse_terms(residuals: Sequence[Residual]) -> list[tuple[str, tuple[str, ...]]]:
    """Return the keys of the effects whose terms are active in any residual, with their ties, the one that explains most first."""
    found: dict[str, float] = {}
    ties: dict[str, tuple[str, ...]] = {}
    for residual in residuals:
        for name, share in active(residual).items():
            key = name.partition(":")[0]
            found[key] = max(found.get(key, 0.0), share)
            ties[key] = residual.ties.get(key, ())
    return [(key, ties[key]) for key in sorted(found, key=lambda key: -found[key])[:MOST]]
