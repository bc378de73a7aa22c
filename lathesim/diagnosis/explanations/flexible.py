"""The flexible explanation: what a machine was doing that predicts what a fitted model leaves.

What is left of a channel, or the force that a moving part lacks, is an unknown function of the operating conditions and noise:

    r = constant + sum over terms f(conditions) + coloured noise

A term is a smooth function or a wave, whose period the spectrum of the residual gives. Terms come in by the marginal likelihood on the
estimation recording, each with a strength of its own: what the recording does not show shrinks to nothing. On the validation recording a
term stays only where it predicts better without being fitted; the constant, the phase of a wave and the level of the noise belong to a
recording. The gain is the log predictive density of the blocks of the validation recording above that of the constant, under one colour of
noise: that of what the flexible explanation leaves.

Sources: MacKay, Bayesian interpolation, Neural Computation 4 (1992), equations 4.8 to 4.10 (strengths); Tipping, Faul, Fast marginal
likelihood maximisation for sparse Bayesian models, AISTATS 2003 (one term at a time); Vehtari, Gelman, Gabry, Practical Bayesian model
evaluation, Statistics and Computing 27 (2017), section 2.2 (paired differences of blocks); Scargle, Studies in astronomical time series
analysis II, Astrophysical Journal 263 (1982) (chance level of a spectrum). Left out: functions of two conditions other than products.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from lathesim.diagnosis.explanations.colour import Colour, colour_of
from lathesim.diagnosis.explanations.conditions import Conditions, Functions, Term
from lathesim.diagnosis.explanations.wave_search import WaveSearch, ways_of
from lathesim.engine.assembly import FloatArray
from lathesim.limit import Limit


class Rules:
    """How a flexible explanation is looked for; of these numbers only ``sure`` decides."""

    sure = Limit(
        2.0, "standard errors", "a term that predicts the validation recording better by more of them holds there", "derived",
        "chance does so in 2.3 % of terms (normal distribution)",
    )  # fmt: skip
    blocks = 40
    most_terms = 8
    most_waves = 3
    fitted = 3
    """Terms that are fitted jointly with those before in each round: the likeliest."""
    iterations = 30
    settled = 0.02
    """Change of the logarithms of all strengths with which they are found."""
    new = 1e-6
    """Share of a term that those before do not explain, for it to be another one."""


_TINY = sys.float_info.min


@dataclass(frozen=True)
class Part:
    """A term of a flexible explanation: its ``gain`` [nats] beside the terms before it, with its standard error, and its ``size``, the root
    mean square on the estimation recording [unit of the residual]."""

    term: Term
    gain: float
    standard_error: float
    size: float

    def __str__(self) -> str:
        """Return what it is, after "it"."""
        return str(self.term)


@dataclass(frozen=True, eq=False)
class Flexible:
    """What a residual depends on, as far as that predicts the validation recording.

    ``gain`` is its log predictive density there above that of the constant [nats], with its ``standard_error``; ``before`` and ``after``
    are root mean squares there, less the mean and less the prediction [unit of the residual]. ``refuted`` are the terms that the estimation
    recording shows and the validation recording does not.
    """

    gain: float
    standard_error: float
    before: float
    after: float
    parts: tuple[Part, ...]
    refuted: tuple[Part, ...]
    functions: Functions
    amounts: tuple[FloatArray, ...]

    @property
    def terms(self) -> tuple[Term, ...]:
        """What it depends on, the strongest first."""
        return tuple(part.term for part in self.parts)

    def predict(self, conditions: Conditions) -> FloatArray:
        """Return the function without its constant (samples,), with the phases of the estimation recording [unit of the residual]."""
        return sum(self.each(conditions), np.zeros(len(conditions.time)))

    def each(self, conditions: Conditions) -> list[FloatArray]:
        """Return what each of the parts adds (samples,) [unit of the residual]."""
        return [self.functions.columns(conditions, one) @ size for one, size in zip(self.terms, self.amounts, strict=True)]


def flexible(
    conditions: Conditions, residual: FloatArray, held_out: tuple[Conditions, FloatArray], unresolved: float = 0.0, every: int = 1
) -> Flexible:
    """Return what a residual (samples,) depends on, judged on the conditions and the residual of the validation recording.

    Samples whose residual is not finite are left out. ``unresolved`` is what a sensor may be off by where it stands, one standard deviation
    [unit of the residual]. ``before`` and ``after`` are those of means of ``every`` so many samples, where noise is most of single ones.
    Without any term that holds on the validation recording, the gain is 0.
    """
    functions = Functions.of(conditions)
    length = min(len(residual), len(held_out[1])) // Rules.blocks
    found = _learned(functions, conditions, residual, length, unresolved)
    names, colour = found.posterior.terms, found.recording.colour
    judge = _Recording(functions, *held_out, colour, names)
    densities = [_densities(found.recording, judge, (), length)]
    kept: list[Part] = []
    refuted: list[Part] = []
    for term in names:
        terms = (*(part.term for part in kept), term)
        trial = _densities(found.recording, judge, terms, length)
        gains = trial - densities[-1]
        error = _standard_error(gains)
        size = found.size_of(term)
        part = Part(term, float(gains.sum()), error, size)
        holds = part.gain > Rules.sure * error
        (kept if holds else refuted).append(part)
        densities += [trial] if holds else []
    gains = densities[-1] - densities[0]
    posterior = _posterior(found.recording, [part.term for part in kept])
    before, after = _left(judge, posterior, every)
    amounts = tuple(posterior.mean[posterior.places[part.term]] for part in kept)
    return Flexible(float(gains.sum()), _standard_error(gains), before, after, tuple(kept), tuple(refuted), functions, amounts)


def _standard_error(gains: FloatArray) -> float:
    return float(np.std(gains, ddof=1) * math.sqrt(len(gains)))


class _Recording:
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
class _Posterior:
    """What a recording says of terms: their amounts, the ``covariance`` of these, and the noise of one whitened sample (a variance)."""

    terms: tuple[Term, ...]
    places: Mapping[Term, slice]
    index: npt.NDArray[np.int64]
    mean: FloatArray
    covariance: FloatArray
    noise: float
    evidence: float


def _posterior(recording: _Recording, terms: Sequence[Term]) -> _Posterior:
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
    noise = max(power / number, _TINY)
    precision = 1e-9 * diagonal / noise
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
        left = max(power - 2.0 * float(mean @ moment) + float(mean @ gram @ mean), _TINY)
        noise = left / max(number - float(known.sum()), 1.0)
        if changed < Rules.settled:
            break
    _, log_determinant = np.linalg.slogdet(gram / noise + np.diag(precision))
    strong = precision[recording.beside.stop :]
    spent = float(mean[recording.beside.stop :] ** 2 @ strong - np.log(strong).sum())
    evidence = -0.5 * (number * math.log(2.0 * math.pi * noise) + left / noise + spent + log_determinant)
    return _Posterior(tuple(terms), places, index, mean, np.asarray(covariance, dtype=np.float64), noise, evidence)


@dataclass(frozen=True, eq=False)
class _Learned:
    """What the estimation recording shows."""

    recording: _Recording
    posterior: _Posterior

    def size_of(self, term: Term) -> float:
        """Return the root mean square of a term [unit of the residual]."""
        one = self.recording
        values = one.functions.columns(one.conditions, term) @ self.posterior.mean[self.posterior.places[term]]
        return float(np.std(values))


def _learned(functions: Functions, conditions: Conditions, residual: FloatArray, length: int, unresolved: float) -> _Learned:
    """Return the terms that the estimation recording shows: under white noise first, then under the colour of what is left."""
    colour, terms = Colour.white(), functions.terms
    for first, last in ((True, False), (False, False), (False, True)):
        recording = _Recording(functions, conditions, residual, colour, terms)
        posterior = _grown(recording, terms)
        if last:
            break
        waves = [term for term in posterior.terms if term.wave]
        # the last round sorts out what the round before has found
        terms = [*functions.terms, *waves] if first else list(posterior.terms)
        colour = colour_of(recording.residual - _prediction(recording, posterior), recording.counted, length, unresolved)
    return _Learned(recording, posterior)


def _prediction(recording: _Recording, posterior: _Posterior) -> FloatArray:
    """Return what a posterior predicts (samples,), with what is absorbed and without the constant."""
    columns = [recording.functions.columns(recording.conditions, term) @ posterior.mean[posterior.places[term]] for term in posterior.terms]
    absorbed = recording.conditions.absorbed
    if absorbed is not None and len(absorbed):
        columns.append(posterior.mean[1 : recording.beside.stop] @ absorbed)
    return sum(columns, np.zeros(len(recording.residual)))


def _grown(recording: _Recording, terms: Sequence[Term]) -> _Posterior:
    """Return the posterior of the terms that raise the marginal likelihood by more than chance among so many does, the strongest first."""
    posterior = _posterior(recording, ())
    pool, due = list(terms), math.log(len(recording.functions.terms))
    search = WaveSearch(ways_of(recording.functions, recording.conditions), recording.colour, recording.counted)
    for _ in range(Rules.most_terms):
        trials = _likeliest(recording, posterior, pool)
        if sum(term.wave is not None for term in posterior.terms) < Rules.most_waves:
            left = recording.white - recording.columns[:, posterior.index] @ posterior.mean
            wave = search.strongest(left, posterior.noise, [term.wave for term in posterior.terms if term.wave])
            if wave is not None and wave[0] > max((gain - due for gain, _ in trials), default=0.0):
                recording.add([wave[1]])
                pool.append(wave[1])
                trials = [wave]
        grown = [_posterior(recording, (*posterior.terms, term)) for _, term in trials]
        best = max(grown, key=lambda trial: trial.evidence, default=posterior)
        if best.evidence <= posterior.evidence + due:
            break
        posterior = best
        pool.remove(posterior.terms[-1])
    return _pruned(recording, posterior, due)


def _pruned(recording: _Recording, posterior: _Posterior, due: float) -> _Posterior:
    """Return a posterior without the terms that later ones made needless."""
    for term in posterior.terms:
        rest = _posterior(recording, [one for one in posterior.terms if one is not term])
        if rest.evidence > posterior.evidence - due:
            posterior = rest
    return posterior


def _likeliest(recording: _Recording, posterior: _Posterior, pool: Sequence[Term]) -> list[tuple[float, Term]]:
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


def _densities(recording: _Recording, judge: _Recording, terms: Sequence[Term], length: int) -> FloatArray:
    """Return the log predictive density of the blocks of the validation recording (blocks,) [nats], each given the estimation recording
    and, for the constant and the phases of waves, the other blocks. The level of the noise of a block is integrated out (Jeffreys)."""
    posterior = _posterior(recording, terms)
    index, mean = judge.index(terms), posterior.mean
    own, prior = _own(posterior)
    shared = ~own
    skipped = len(judge.white) % length
    blocks = judge.columns[skipped:, index].reshape(-1, length, len(index))
    error = (judge.white - judge.columns[:, index] @ np.where(own, 0.0, mean))[skipped:].reshape(-1, length)
    known, ours = blocks[:, :, shared], np.concatenate([blocks[:, :, own], error[:, :, None]], axis=2)
    spread = posterior.covariance[np.ix_(shared, shared)] / posterior.noise
    gram = np.swapaxes(known, 1, 2) @ known
    mixed = np.eye(gram.shape[1]) + spread @ gram
    cross = np.swapaxes(known, 1, 2) @ ours
    # products under the covariance noise (1 + known spread known')
    products = np.swapaxes(ours, 1, 2) @ ours - np.swapaxes(cross, 1, 2) @ np.linalg.solve(mixed, spread @ cross)
    determinant = np.linalg.slogdet(mixed)[1]
    matrix, pull, power = products[:, :-1, :-1], products[:, :-1, -1], products[:, -1, -1]
    others = np.linalg.inv(np.diag(prior * posterior.noise) + matrix.sum(axis=0) - matrix)
    guess = np.einsum("bij,bj->bi", others, pull.sum(axis=0) - pull)
    rest = pull - np.einsum("bij,bj->bi", matrix, guess)
    power = power - np.einsum("bi,bi->b", guess, pull) - np.einsum("bi,bi->b", guess, rest)
    widened = np.eye(matrix.shape[1]) + others @ matrix
    power = power - np.einsum("bi,bij,bj->b", rest, np.linalg.solve(widened, others), rest)
    determinant = determinant + np.linalg.slogdet(widened)[1]
    counted = judge.counted[skipped:].reshape(-1, length).sum(axis=1) / judge.colour.inflation
    return np.asarray(-0.5 * (counted * np.log(np.maximum(power, _TINY)) + determinant))


def _own(posterior: _Posterior) -> tuple[npt.NDArray[np.bool_], FloatArray]:
    """Return which amounts belong to a recording (amounts,), and what is known of those beforehand: one over the variance."""
    own = np.zeros(len(posterior.mean), dtype=bool)
    precision = np.zeros(len(posterior.mean))
    own[0] = True
    for term, place in posterior.places.items():
        if term.wave:
            own[place] = True
            precision[place] = 2.0 / max(float(posterior.mean[place] @ posterior.mean[place]), _TINY)
    return own, precision[own]


def _left(judge: _Recording, posterior: _Posterior, every: int) -> tuple[float, float]:
    """Return the root mean squares of the residual of the validation recording, less its mean and less the prediction."""
    index = judge.index(posterior.terms)
    own, prior = _own(posterior)
    pull = judge.moment[index] - judge.gram[np.ix_(index, index)] @ np.where(own, 0.0, posterior.mean)
    inside = judge.gram[np.ix_(index, index)][np.ix_(own, own)] + np.diag(prior * posterior.noise)
    mean = posterior.mean.copy()
    mean[own] = np.linalg.solve(inside, pull[own])
    predicted = _prediction(judge, replace(posterior, mean=mean))
    found = []
    for values in (judge.residual, judge.residual - predicted):
        kept = values[judge.counted]
        kept = kept[: len(kept) // every * every].reshape(-1, every).mean(axis=1)
        found.append(float(np.std(kept)))
    return found[0], found[1]
