"""What terms that one recording shows are worth on another one.

The gain is the log predictive density of the blocks of the validation recording above that of the constant, under one colour of noise.
Each block is predicted from the estimation recording and, for what belongs to a recording, the constant and the phases of waves, from the
other blocks; the level of the noise of a block is integrated out (Jeffreys prior).

Source: Vehtari, Gelman, Gabry, Practical Bayesian model evaluation, Statistics and Computing 27 (2017), section 2.2 (paired differences).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from lathesim.diagnosis.explanations.conditions import Rules, Term
from lathesim.diagnosis.explanations.learned import Learned, Posterior, Recording, posterior_of, prediction
from lathesim.engine.assembly import FloatArray

_TINY = sys.float_info.min


@dataclass(frozen=True)
class Worth:
    """By how much terms predict better [nats], with one standard error, from the differences of blocks.

    Chance makes blocks lose as often as it makes them gain, so the blocks that lose show how large it is. A log ratio of likelihoods whose
    mean is g has the variance 2 g (non-central chi-squared). That something acts in few blocks is no chance.
    """

    gain: float
    standard_error: float

    @classmethod
    def of(cls, gains: FloatArray) -> Worth:
        """Sum up the gains of the blocks (blocks,)."""
        lost, gained = np.minimum(gains, 0.0), np.maximum(gains, 0.0)
        return cls(float(gains.sum()), math.sqrt(2.0 * float(lost @ lost) + 2.0 * float(gained.sum())))

    @property
    def is_sure(self) -> bool:
        """Whether it is a gain beyond chance."""
        return self.gain > Rules.sure * self.standard_error

    @property
    def errors(self) -> float:
        """The gain in standard errors."""
        return self.gain / max(self.standard_error, _TINY)


@dataclass(frozen=True, eq=False)
class HeldOut:
    """A validation recording beside the estimation recording that ``learned``; blocks of ``length`` samples; rms of means of ``every``."""

    learned: Learned
    judge: Recording
    length: int
    every: int

    def holding(self) -> list[Term]:
        """Return the terms that hold: each predicts the blocks better beside the others, and all of them leave less than there was."""
        found = [self._leaving_less(self._taken_out()), self._leaving_less(self._put_in())]
        return max(found, key=lambda terms: self.worth_of(terms, ()).gain)

    def _leaving_less(self, terms: Sequence[Term]) -> list[Term]:
        """Return terms without those with which more would be left than there was."""
        kept, before = list(terms), self.left(())
        while kept and self.left(kept) > before:
            kept.remove(min(kept, key=lambda term: self.left([one for one in kept if one is not term])))
        return kept

    def _taken_out(self) -> list[Term]:
        """Return all terms but those without which the blocks are predicted as well, taken out one at a time."""
        kept = list(self.learned.posterior.terms)
        while kept:
            worths = {term: self.worth_of(kept, [one for one in kept if one is not term]) for term in kept}
            worst = min(kept, key=lambda term: worths[term].errors)
            if worths[worst].is_sure:
                break
            kept.remove(worst)
        return kept

    def _put_in(self) -> list[Term]:
        """Return the terms with which the blocks are predicted better, put in one at a time."""
        kept: list[Term] = []
        while True:
            rest = [term for term in self.learned.posterior.terms if term not in kept]
            worths = {term: self.worth_of([*kept, term], kept) for term in rest}
            better = [term for term in rest if worths[term].is_sure]
            if not better:
                return kept
            kept.append(max(better, key=lambda term: worths[term].gain))

    def ranked(self, terms: Sequence[Term]) -> list[Term]:
        """Return terms by what each adds to those before it, the strongest first."""
        found, rest = list[Term](), list(terms)
        while rest:
            best = max(rest, key=lambda term: self.worth_of([*found, term], found).gain)
            found.append(best)
            rest.remove(best)
        return found

    def worth_of(self, terms: Sequence[Term], before: Sequence[Term]) -> Worth:
        """Return by how much terms predict better than others do."""
        return Worth.of(self._densities(tuple(terms)) - self._densities(tuple(before)))

    @cached_property
    def _known(self) -> dict[frozenset[Term], FloatArray]:
        return {}

    @cached_property
    def _products(self) -> FloatArray:
        """The products of the columns and the residual with each other in each block (blocks, columns + 1, columns + 1)."""
        skipped = len(self.judge.white) % self.length
        columns = np.column_stack([self.judge.columns, self.judge.white])[skipped:]
        blocks = columns.reshape(-1, self.length, columns.shape[1])
        return np.asarray(np.swapaxes(blocks, 1, 2) @ blocks)

    def _densities(self, terms: tuple[Term, ...]) -> FloatArray:
        """Return the log predictive density of the blocks (blocks,) [nats]."""
        if frozenset(terms) not in self._known:
            self._known[frozenset(terms)] = self._density(posterior_of(self.learned.recording, terms))
        return self._known[frozenset(terms)]

    def _density(self, posterior: Posterior) -> FloatArray:
        own, prior = _own(posterior)
        places = self.judge.index(posterior.terms)
        error = np.zeros((self._products.shape[1], 1))
        error[places, 0] = np.where(own, 0.0, -posterior.mean)
        error[-1, 0] = 1.0
        picked = np.eye(len(error))[:, places]
        known, ours = picked[:, ~own], np.hstack([picked[:, own], error])
        spread = posterior.covariance[np.ix_(~own, ~own)] / posterior.noise
        gram, cross = known.T @ self._products @ known, known.T @ self._products @ ours
        mixed = np.eye(gram.shape[1]) + spread @ gram
        # products under the covariance noise (1 + known spread known')
        products = ours.T @ self._products @ ours - np.swapaxes(cross, 1, 2) @ np.linalg.solve(mixed, spread @ cross)
        determinant = np.linalg.slogdet(mixed)[1]
        matrix, pull, power = products[:, :-1, :-1], products[:, :-1, -1], products[:, -1, -1]
        others = np.linalg.inv(np.diag(prior * posterior.noise) + matrix.sum(axis=0) - matrix)
        guess = np.einsum("bij,bj->bi", others, pull.sum(axis=0) - pull)
        rest = pull - np.einsum("bij,bj->bi", matrix, guess)
        power = power - np.einsum("bi,bi->b", guess, pull) - np.einsum("bi,bi->b", guess, rest)
        widened = np.eye(matrix.shape[1]) + others @ matrix
        power = power - np.einsum("bi,bij,bj->b", rest, np.linalg.solve(widened, others), rest)
        determinant = determinant + np.linalg.slogdet(widened)[1]
        skipped = len(self.judge.white) % self.length
        counted = self.judge.counted[skipped:].reshape(-1, self.length).sum(axis=1) / self.judge.colour.inflation
        return np.asarray(-0.5 * (counted * np.log(np.maximum(power, _TINY)) + determinant))

    def left(self, terms: Sequence[Term]) -> float:
        """Return the root mean square of what terms leave of the residual, less its mean."""
        posterior, judge = posterior_of(self.learned.recording, terms), self.judge
        places = judge.index(posterior.terms)
        own, prior = _own(posterior)
        gram = judge.gram[np.ix_(places, places)]
        pull = judge.moment[places] - gram @ np.where(own, 0.0, posterior.mean)
        mean = posterior.mean.copy()
        mean[own] = np.linalg.solve(gram[np.ix_(own, own)] + np.diag(prior * posterior.noise), pull[own])
        values = (judge.residual - prediction(judge, replace(posterior, mean=mean)))[judge.counted]
        return float(np.std(values[: len(values) // self.every * self.every].reshape(-1, self.every).mean(axis=1)))


def _own(posterior: Posterior) -> tuple[npt.NDArray[np.bool_], FloatArray]:
    """Return which amounts belong to a recording (amounts,), and what is known of those beforehand: one over the variance."""
    own = np.zeros(len(posterior.mean), dtype=bool)
    precision = np.zeros(len(posterior.mean))
    own[0] = True
    for term, place in posterior.places.items():
        if term.wave:
            own[place] = True
            precision[place] = 2.0 / max(float(posterior.mean[place] @ posterior.mean[place]), _TINY)
    return own, precision[own]
