"""Which candidates are worth a fit: how much of the whitened residual their response explains, beside what the baseline can absorb.

For each candidate the responses at a few starting values are projected, together with the sensitivities of the free parameters, onto the
residual. No optimiser is involved; all runs are one batch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.diagnosis.fit import Fitted
from lathesim.diagnosis.simulator import Simulator
from lathesim.diagnosis.terms import Term
from lathesim.engine.assembly import FloatArray


@dataclass(frozen=True)
class Screened:
    """A candidate with the log-likelihood its responses promise [nats], and the starting values that promise most, best first.

    ``share`` is the share of the whitened residual that they promise to take away in the channel where that is most, in the band of the
    motion or on all frequencies.
    """

    term: Term
    gain: float
    starts: tuple[FloatArray, ...]
    share: float = 1.0


@dataclass(frozen=True)
class Screening:
    """The candidates that move a channel at all, the most promising first, and what chance reaches among them [nats]."""

    ranked: tuple[Screened, ...]
    chance: float


_DRAWS = 20


def screen(simulator: Simulator, fitted: Fitted, terms: Sequence[Term], points: Mapping[str, FloatArray] | None = None) -> Screening:
    """Screen the candidates; ``points`` adds starting values by term part.

    What chance reaches is the largest gain among all candidates on noise as the noise model has it, with nothing hidden in it; the largest
    of 20 such draws is given.
    """
    names = list(fitted.by_name)
    base = np.array(list(fitted.by_name.values()))
    everything = list(dict.fromkeys([*names, *[name for term in terms for name in term.parameters]]))
    origin = np.concatenate([base, [_neutral(terms, name) for name in everything[len(names) :]]])
    rows, owners = [], []
    for term in terms:
        for point in _points(term, points):
            row = origin.copy()
            row[[everything.index(name) for name in term.parameters]] = point
            rows.append(row)
            owners.append((term, point))
    if not rows:
        return Screening((), 0.0)
    absorb = _Absorber(simulator, fitted)
    residuals = simulator.residuals(everything, np.array(rows))
    responses = absorb.left(fitted.residual - np.array(residuals))
    powers = np.einsum("ij,ij->i", responses, responses)
    shares = responses @ absorb.residual / np.maximum(powers, 1e-300)
    found: dict[str, list[tuple[float, float, FloatArray, FloatArray]]] = {}
    for (term, point), response, power, share in zip(owners, responses, powers, shares, strict=True):
        if np.isfinite(power) and power > 1e-6:
            found.setdefault(term.part, []).append((0.5 * share * share * power, float(share), point, response))
    result: list[Screened] = []
    bases: list[FloatArray] = []
    for term in terms:
        tried = sorted(found.get(term.part, ()), key=lambda item: -item[0] * _plausible(term, item[1]))
        if tried:
            basis = _basis(tried)
            bases.append(basis)
            starts = tuple(_start(term, item) for item in tried[:3])
            result.append(Screened(term, _gain(basis, absorb.residual), starts, absorb.share(basis @ (basis.T @ absorb.residual))))
    draws = absorb.draws(fitted.residual, _DRAWS)
    chance = max((float(np.max(0.5 * np.sum((basis.T @ draws.T) ** 2, axis=0))) for basis in bases), default=0.0)
    return Screening(tuple(sorted(result, key=lambda item: -item.gain)), chance)


def _neutral(terms: Sequence[Term], name: str) -> float:
    for term in terms:
        if name in term.parameters:
            return float(term.neutral[term.parameters.index(name)])
    raise KeyError(name)


def _points(term: Term, points: Mapping[str, FloatArray] | None) -> FloatArray:
    extra = (points or {}).get(term.part)
    return term.points if extra is None or not len(extra) else np.vstack([extra, term.points])


def _plausible(term: Term, share: float) -> float:
    """Weigh a response that would have to be turned round: right for signed sizes and phases, wrong for a friction below zero."""
    if share > 0.0 or bool((term.low < 0.0).any()):
        return 1.0
    return 0.05


def _start(term: Term, item: tuple[float, float, FloatArray, FloatArray]) -> FloatArray:
    _, share, point, _ = item
    size = float(np.clip(abs(share), 0.02, 20.0))
    if share < 0.0 and bool((term.low < 0.0).any()) and not any(name.endswith("phase") for name in term.parameters):
        size = -size
    away = np.array([name.partition(".")[2] in term.effect.neutral for name in term.parameters])
    scaled = np.where(away, term.neutral + (point - term.neutral) * size, point)
    return np.clip(scaled, term.low, term.high)


def _basis(tried: Sequence[tuple[float, float, FloatArray, FloatArray]]) -> FloatArray:
    """Give orthonormal columns that span the responses of a candidate."""
    responses = np.stack([item[3] / np.sqrt(item[3] @ item[3]) for item in tried], axis=1)
    values, vectors = np.linalg.eigh(responses.T @ responses)
    good = values > 1e-6 * values[-1]
    return np.asarray(responses @ (vectors[:, good] / np.sqrt(values[good])))


def _gain(basis: FloatArray, residual: FloatArray) -> float:
    amount = basis.T @ residual
    return 0.5 * float(amount @ amount)


class _Absorber:
    """Takes out of whitened signals what the free parameters, within their uncertainties, can explain."""

    def __init__(self, simulator: Simulator, fitted: Fitted) -> None:
        self.noise = fitted.noise
        white = self._whiten(fitted.sensitivity) if fitted.sensitivity is not None and len(fitted.free) else None
        precision = np.array([1.0 / item.uncertainty if np.isfinite(item.uncertainty) else 0.0 for item in fitted.free])
        self._stacked = None
        if white is not None:
            scale = np.array([item.scale for item in fitted.free])
            stacked = np.vstack([white.T, np.diag(precision)]) * scale
            q, r = np.linalg.qr(stacked)
            good = np.abs(np.diag(r)) > 1e-10 * np.abs(np.diag(r)).max(initial=1e-300)
            self._stacked = q[:, good]
        self._extra = len(fitted.free) if white is not None else 0
        # what holds the baseline away from its given values is evidence too: a candidate may take that strain away
        strain = precision * (np.array([item.given for item in fitted.free]) - fitted.values) if self._extra else np.zeros(0)
        self.residual = self._less_absorbed(np.concatenate([self._whiten(fitted.residual), strain]))

    def _whiten(self, arrays: FloatArray) -> FloatArray:
        return np.concatenate([model.whiten(arrays[..., channel, :], wide=True) for channel, model in enumerate(self.noise)], axis=-1)

    def share(self, explained: FloatArray) -> float:
        """Give the share of the residual that is gone with ``explained``, in the channel and band where it is most."""
        best, begin = 0.0, 0
        for model in self.noise:
            half = len(model.power)
            parts = [slice(begin, begin + 2 * half)]
            if model.band < half:
                parts.append(np.r_[begin : begin + model.band, begin + half : begin + half + model.band])
            for part in parts:
                power = float(np.sum(self.residual[part] ** 2))
                if power > 0.0:
                    best = max(best, 1.0 - float(np.sum((self.residual[part] - explained[part]) ** 2)) / power)
            begin += 2 * half
        return best

    def draws(self, residual: FloatArray, number: int) -> FloatArray:
        """Give noise of the size of the residual (channels, samples), whitened, less what the baseline absorbs; (number, values)."""
        random = np.random.Generator(np.random.Philox(0))
        noise = np.zeros((number, len(self.residual)))
        noise[:, : noise.shape[1] - self._extra] = random.standard_normal((number, noise.shape[1] - self._extra))
        return self._less_absorbed(noise)

    def left(self, signals: FloatArray) -> FloatArray:
        """Give signals (..., channels, samples) whitened, less what the baseline absorbs."""
        white = self._whiten(signals)
        return self._less_absorbed(np.concatenate([white, np.zeros((*white.shape[:-1], self._extra))], axis=-1))

    def _less_absorbed(self, white: FloatArray) -> FloatArray:
        if self._stacked is None:
            return white
        return np.asarray(white - (white @ self._stacked) @ self._stacked.T)
