"""What the estimation recording shows of the terms of a flexible explanation: their amounts, and which of them there are.

Terms come in by the marginal likelihood, each with a strength of its own: what the recording does not show shrinks to nothing.

Sources: MacKay, Bayesian interpolation, Neural Computation 4 (1992), equations 4.8 to 4.10 (strengths); Tipping, Faul, Fast marginal
likelihood maximisation for sparse Bayesian models, AISTATS 2003 (one term at a time).
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lathesim.diagnosis.explanations.colour import Colour, colour_of
from lathesim.diagnosis.explanations.conditions import Conditions, Functions, Rules, Term
from lathesim.diagnosis.explanations.wave_search import WaveSearch, ways_of
from lathesim.engine.assembly import FloatArray

_TINY = sys.float_info.min


class Recording:
    """The whitened columns of terms and the whitened residual of a recording, with their products. It grows by terms."""

    def __init__(
        self, functions: Functions, conditions: Conditions, residual: FloatArray, colour: Colour, terms: Sequence[Term] = ()
    ) -> None:
        self.functions, self.conditions, self.colour = functions, conditions, colour
        self.counted = np.isfinite(residual)
        self.residual = np.where(self.counted, residual, 0.0)
        self.white = colour.whiten(self.residual, self.counted)
        self.number = float(np.count_nonzero(self.counted)) / colour.inflation
        self.places: dict[Term, slice] = {}
        beside = [np.ones((len(residual), 1))]
        if conditions.absorbed is not None and len(conditions.absorbed):
            beside.append(conditions.absorbed.T)
        self.columns = colour.whiten(np.hstack(beside), self.counted)
        self.beside = slice(0, self.columns.shape[1])
        self.gram, self.moment = self.columns.T @ self.columns, self.columns.T @ self.white
        self.add(terms)

    def add(self, terms: Sequence[Term]) -> None:
        """Take in terms."""
        raw = [self.functions.columns(self.conditions, term) for term in terms]
        if not raw:
            return
        new = self.colour.whiten(np.hstack(raw), self.counted)
        cross = self.columns.T @ new
        self.gram = np.block([[self.gram, cross], [cross.T, new.T @ new]])
        self.moment = np.concatenate([self.moment, new.T @ self.white])
        begin = self.columns.shape[1]
        self.columns = np.hstack([self.columns, new])
        for term, columns in zip(terms, raw, strict=True):
            self.places[term] = slice(begin, begin + columns.shape[1])
            begin += columns.shape[1]

    def index(self, terms: Sequence[Term]) -> npt.NDArray[np.int64]:
        """Return the columns of the constant, of what is absorbed, and of terms."""
        places = (self.beside, *(self.places[term] for term in terms))
        return np.concatenate([np.arange(place.start, place.stop) for place in places])


@dataclass(frozen=True, eq=False)
class Posterior:
    """What a recording says of terms: their amounts, the ``covariance`` of these, and the noise of one whitened sample (a variance)."""

    terms: tuple[Term, ...]
    places: Mapping[Term, slice]
    index: npt.NDArray[np.int64]
    mean: FloatArray
    covariance: FloatArray
    noise: float
    evidence: float


def posterior_of(recording: Recording, terms: Sequence[Term]) -> Posterior:
    """Return the posterior with the strength of each term and the noise at the maximum of the marginal likelihood, MacKay 4.8 to 4.10."""
    index = recording.index(terms)
    gram, moment = recording.gram[np.ix_(index, index)], recording.moment[index]
    power, number = float(recording.white @ recording.white), recording.number
    places, begin = {}, recording.beside.stop
    for term in terms:
        width = recording.places[term].stop - recording.places[term].start
        places[term] = slice(begin, begin + width)
        begin += width
    diagonal = np.maximum(np.diag(gram), _TINY)
    least = _TINY**0.25 * float(diagonal.max())  # a residual of zeros has no noise: gram / noise^2 stays within the range of numbers
    noise = max(power, least) / number
    precision = np.ones(len(index))
    precision[0] = 1e-9 * diagonal[0] / noise
    for place in places.values():
        precision[place] = diagonal[place].mean() / number / noise
    for _ in range(Rules.iterations):
        covariance = np.linalg.inv(gram / noise + np.diag(precision))
        mean = covariance @ moment / noise
        known = 1.0 - precision * np.diag(covariance)
        changed = 0.0
        for place in places.values():
            largest = 1e6 * diagonal[place].mean() / noise
            new = min(max(float(known[place].sum()), 1e-9) / max(float(mean[place] @ mean[place]), _TINY), largest)
            changed = max(changed, abs(math.log(new / precision[place.start])))
            precision[place] = new
        left = max(power - 2.0 * float(mean @ moment) + float(mean @ gram @ mean), least)
        noise = left / max(number - float(known.sum()), 1.0)
        if changed < Rules.settled:
            break
    _, log_determinant = np.linalg.slogdet(gram / noise + np.diag(precision))
    spent = float(mean[1:] ** 2 @ precision[1:] - np.log(precision[1:]).sum())
    evidence = -0.5 * (number * math.log(2.0 * math.pi * noise) + left / noise + spent + log_determinant)
    return Posterior(tuple(terms), places, index, mean, np.asarray(covariance, dtype=np.float64), noise, evidence)


@dataclass(frozen=True, eq=False)
class Learned:
    """What the estimation recording shows."""

    recording: Recording
    posterior: Posterior

    def size_of(self, term: Term, beside: Sequence[Term]) -> float:
        """Return the root mean square of a term beside others [unit of the residual]."""
        one, posterior = self.recording, posterior_of(self.recording, beside)
        return float(np.std(one.functions.columns(one.conditions, term) @ posterior.mean[posterior.places[term]]))


def learned(functions: Functions, conditions: Conditions, residual: FloatArray, length: int, unresolved: float) -> Learned:
    """Return the terms that the estimation recording shows: under white noise first, then under the colour of what is left."""
    colour, terms = Colour.white(), functions.terms
    for first, last in ((True, False), (False, False), (False, True)):
        recording = Recording(functions, conditions, residual, colour, terms)
        posterior = _grown(recording, terms)
        if last:
            break
        waves = [term for term in posterior.terms if term.wave]
        # the last round sorts out what the round before has found
        terms = [*functions.terms, *waves] if first else list(posterior.terms)
        colour = colour_of(recording.residual - prediction(recording, posterior), recording.counted, length, unresolved)
    return Learned(recording, posterior)


def prediction(recording: Recording, posterior: Posterior) -> FloatArray:
    """Return what a posterior predicts (samples,), with what is absorbed and without the constant."""
    columns = [recording.functions.columns(recording.conditions, term) @ posterior.mean[posterior.places[term]] for term in posterior.terms]
    absorbed = recording.conditions.absorbed
    if absorbed is not None and len(absorbed):
        columns.append(posterior.mean[1 : recording.beside.stop] @ absorbed)
    return sum(columns, np.zeros(len(recording.residual)))


def _grown(recording: Recording, terms: Sequence[Term]) -> Posterior:
    """Return the posterior of the terms that raise the marginal likelihood by more than chance among so many does, the strongest first."""
    posterior = posterior_of(recording, ())
    if not recording.white.any():  # what a law follows exactly leaves nothing to explain
        return posterior
    pool, due = list(terms), math.log(len(recording.functions.terms))
    search = WaveSearch(ways_of(recording.functions, recording.conditions), recording.colour, recording.counted)
    for _ in range(Rules.most_terms):
        trials = _likeliest(recording, posterior, pool)
        if sum(term.wave is not None for term in posterior.terms) < Rules.most_waves:
            left = recording.white - recording.columns[:, posterior.index] @ posterior.mean
            wave = search.strongest(left, posterior.noise, [term.wave for term in (*pool, *posterior.terms) if term.wave])
            if wave is not None and wave[0] > max((gain - due for gain, _ in trials), default=0.0):
                recording.add([wave[1]])
                pool.append(wave[1])
                trials = [wave]
        grown = [posterior_of(recording, (*posterior.terms, term)) for _, term in trials]
        best = max(grown, key=lambda trial: trial.evidence, default=posterior)
        if best.evidence <= posterior.evidence + due:
            break
        posterior = best
        pool.remove(posterior.terms[-1])
    return _pruned(recording, posterior, due)


def _pruned(recording: Recording, posterior: Posterior, due: float) -> Posterior:
    """Return a posterior without the terms that later ones made needless."""
    for term in posterior.terms:
        rest = posterior_of(recording, [one for one in posterior.terms if one is not term])
        if rest.evidence > posterior.evidence - due:
            posterior = rest
    return posterior


def _likeliest(recording: Recording, posterior: Posterior, pool: Sequence[Term]) -> list[tuple[float, Term]]:
    """Return the terms that raise the log marginal likelihood most, each at its best strength, beside what is in already [nats]."""
    index, noise = posterior.index, posterior.noise
    left = recording.moment - recording.gram[:, index] @ posterior.mean
    found = []
    for term in pool:
        place = recording.places[term]
        cross = recording.gram[index, place]
        gram = recording.gram[place, place] / noise - cross.T @ posterior.covariance @ cross / noise**2
        values, vectors = np.linalg.eigh(gram)
        # what is in already takes up the rest
        new = values > Rules.new * float(np.trace(recording.gram[place, place])) / noise
        values, pull = values[new], (vectors[:, new].T @ left[place] / noise) ** 2
        if not len(values):
            continue
        strength = np.geomspace(1e-6, 1e3, 46)[:, None] * max(float(values.max()), _TINY)
        gain = float(np.max(0.5 * np.sum(pull / (strength + values) - np.log1p(values / strength), axis=1)))
        found.append((gain, term))
    return sorted(found, key=lambda item: -item[0])[: Rules.fitted]
