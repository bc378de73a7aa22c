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
    """A candidate with the log-likelihood its responses promise [nats], and the starting values that promise most, best first."""

    term: Term
    gain: float
    starts: tuple[FloatArray, ...]


def screen(simulator: Simulator, fitted: Fitted, terms: Sequence[Term], points: Mapping[str, FloatArray] | None = None) -> list[Screened]:
    """Give the candidates that move a channel at all, the most promising first. ``points`` adds starting values by term part."""
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
        return []
    absorb = _Absorber(simulator, fitted)
    residuals = simulator.residuals(everything, np.array(rows))
    found: dict[str, list[tuple[float, float, FloatArray, FloatArray]]] = {}
    for (term, point), other in zip(owners, residuals, strict=True):
        response = absorb.left(fitted.residual - other)
        power = float(response @ response)
        if not np.isfinite(power) or power < 1e-6:
            continue
        share = float(absorb.residual @ response) / power
        found.setdefault(term.part, []).append((0.5 * share * share * power, share, point, response))
    result = []
    for term in terms:
        tried = sorted(found.get(term.part, ()), key=lambda item: -item[0] * _plausible(term, item[1]))
        if tried:
            result.append(Screened(term, _joint_gain(absorb.residual, tried), tuple(_start(term, item) for item in tried[:3])))
    return sorted(result, key=lambda item: -item.gain)


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
    away = np.array([name.partition(".")[2] in term.effect.neutral for name in term.parameters])
    scaled = np.where(away, term.neutral + (point - term.neutral) * size, point)
    return np.clip(scaled, term.low, term.high)


def _joint_gain(residual: FloatArray, tried: Sequence[tuple[float, float, FloatArray, FloatArray]]) -> float:
    responses = np.stack([item[3] / np.sqrt(item[3] @ item[3]) for item in tried], axis=1)
    basis, values, _ = np.linalg.svd(responses, full_matrices=False)
    kept = basis[:, values > 1e-3 * values[0]]
    amount = kept.T @ residual
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
        self.residual = self.left(fitted.residual)

    def _whiten(self, arrays: FloatArray) -> FloatArray:
        return np.concatenate([model.whiten(arrays[..., channel, :], wide=True) for channel, model in enumerate(self.noise)], axis=-1)

    def left(self, signal: FloatArray) -> FloatArray:
        """Give a signal (channels, samples) whitened, less what the baseline absorbs."""
        white = np.concatenate([self._whiten(signal), np.zeros(self._extra)])
        if self._stacked is None:
            return white
        return np.asarray(white - self._stacked @ (self._stacked.T @ white))
