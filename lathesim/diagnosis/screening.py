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

    ``shares`` are the shares of the whitened residual that they promise to take away, for each channel in the band of the motion and on
    all frequencies.
    """

    term: Term
    gain: float
    starts: tuple[FloatArray, ...]
    shares: FloatArray

    @property
    def share(self) -> float:
        """The largest of the shares."""
        return float(self.shares.max(initial=0.0))


@dataclass(frozen=True)
class Screening:
    """The candidates that move a channel at all, the most promising first, and what chance reaches among them [nats]."""

    ranked: tuple[Screened, ...]
    chance: float


_DRAWS = 20
_FEWEST_PHASES = 3
_TURNS = 72
_FAR_BEYOND = 100.0
_AT_END = 1e-6
"""Scales from a bound within which a value lies at it."""
_SINGLE = np.float32
"""Screening ranks candidates: it needs no more digits, and half the memory takes half the time."""
_Response = tuple[float, float, FloatArray, FloatArray]
"""What a response promises [nats], by how much it is to be scaled, its starting value, and itself (values,)."""


def screen(simulator: Simulator, fitted: Fitted, terms: Sequence[Term], points: Mapping[str, FloatArray] | None = None) -> Screening:
    """Screen the candidates; ``points`` adds starting values by term part.

    What chance reaches is the largest gain among all candidates on noise as the noise model has it, with nothing hidden in it; the largest
    of 20 such draws is given.
    """
    absorb = _Absorber(simulator, fitted)
    draws = absorb.draws(_DRAWS)
    result: list[Screened] = []
    chance = 0.0
    for term in terms:
        tried = _responses(simulator, fitted, absorb, term, _points(term, points))
        if tried:
            basis = _basis(tried)
            starts = tuple(_start(term, item) for item in _apart(term, tried)[:3])
            result.append(Screened(term, _gain(basis, absorb.residual), starts, absorb.shares(basis @ (basis.T @ absorb.residual))))
            chance = max(chance, float(np.max(0.5 * np.sum((basis.T @ draws.T) ** 2, axis=0))))
    return Screening(tuple(sorted(result, key=lambda item: -item.gain)), chance)


def screened_instead(simulator: Simulator, fitted: Fitted, term: Term, finer: Term, starts: Sequence[FloatArray]) -> Screened:
    """Say what a finer form promises in the place of a term of the model."""
    absorb = _Absorber(simulator, fitted)
    without = dict(zip(term.parameters, term.neutral.tolist(), strict=True))
    tried = _responses(simulator, fitted, absorb, finer, np.array(starts), without)
    if not tried:
        return Screened(finer, 0.0, tuple(starts), np.zeros(1))
    basis = _basis(tried)
    return Screened(finer, _gain(basis, absorb.residual), tuple(starts), absorb.shares(basis @ (basis.T @ absorb.residual)))


def least_shown(simulator: Simulator, fitted: Fitted, term: Term, finer: Term) -> float:
    """Give what a finer form in the place of a term would gain [nats] if it were there, with that of its own values which shows least.

    Each value that the term does not have takes a usual size by itself. Little to gain means that the recording cannot tell.
    """
    absorb = _Absorber(simulator, fitted)
    shared = {name.partition(".")[2]: fitted.by_name[name] for name in term.parameters}
    base = [shared.get(name.partition(".")[2], neutral) for name, neutral in zip(finer.parameters, finer.neutral, strict=True)]
    own = [place for place, name in enumerate(finer.parameters) if name.partition(".")[2] not in shared]
    starts = np.tile(np.array(base), (len(own), 1))
    for start, place in zip(starts, own, strict=True):
        start[place] = finer.points[int(np.argmax(np.abs(finer.points[:, place]))), place]
    without = dict(zip(term.parameters, term.neutral.tolist(), strict=True))
    tried = _responses(simulator, fitted, absorb, finer, starts, without)
    return min((0.5 * float(response @ response) for *_, response in tried), default=0.0) if len(tried) >= len(own) else 0.0


def _responses(
    simulator: Simulator,
    fitted: Fitted,
    absorb: _Absorber,
    term: Term,
    points: FloatArray,
    others: Mapping[str, float] | None = None,
) -> list[_Response]:
    """Give what a term at each starting value, and ``others`` with it, do to the residual, beside what the baseline absorbs; the most
    promising first."""
    base = {**fitted.by_name, **dict(zip(term.parameters, term.neutral.tolist(), strict=True)), **(others or {})}
    names = list(base)
    rows = np.tile(np.array(list(base.values())), (len(points), 1))
    rows[:, [names.index(name) for name in term.parameters]] = points
    found = []
    for point, response in zip(points, simulator.responses(names, rows, absorb.references, absorb.left), strict=True):
        power = float(response @ response) if response is not None else 0.0
        if response is not None and np.isfinite(power) and power > 1e-6:
            share = float(response @ absorb.residual) / power
            found.append((0.5 * share * share * power, share, point, response))
    found += _at_best_phases(term, found, absorb.residual)
    return sorted(found, key=lambda item: -item[0] * _plausible(term, item[1]))


def _phases(term: Term) -> list[int]:
    return [place for place, name in enumerate(term.parameters) if name.endswith("phase")]


def _apart(term: Term, tried: Sequence[_Response]) -> list[_Response]:
    """Give the responses that differ in more than their phase, of each the best: from the others a fit would end in the same place."""
    kept: dict[bytes, _Response] = {}
    for item in tried:
        kept.setdefault(np.delete(item[2], _phases(term)).tobytes(), item)
    return list(kept.values())


def _at_best_phases(term: Term, tried: Sequence[_Response], residual: FloatArray) -> list[_Response]:
    """Give what a wave would do at its best phase, from what it does at some phases of the same wavelength.

    r(phase) = r_0 + r_s cos(phase) + r_c sin(phase) by least squares; of the phases the one with the largest (r'e)^2 / r'r is taken.
    """
    columns, alike = _phases(term), dict[bytes, list[_Response]]()
    found: list[_Response] = []
    for item in tried if columns else ():
        alike.setdefault(np.delete(item[2], columns).tobytes(), []).append(item)
    for items in alike.values():
        phases = np.array([item[2][columns[0]] for item in items])
        if len(set(phases.tolist())) < _FEWEST_PHASES:
            continue
        parts = np.linalg.pinv(_turning(phases)) @ np.stack([item[3] for item in items])
        turns = np.linspace(-np.pi, np.pi, _TURNS, endpoint=False)
        turning = _turning(turns)
        power = np.sum((turning @ (parts @ parts.T)) * turning, axis=1)
        shares = (turning @ (parts @ residual)) / np.maximum(power, 1e-300)
        gains = np.where(shares > 0.0, 0.5 * shares * shares * power, 0.0)
        best = int(np.argmax(gains))
        point = np.array(items[0][2])
        point[columns] = turns[best]
        found.append((float(gains[best]), float(shares[best]), point, np.asarray(turning[best] @ parts, dtype=_SINGLE)))
    return found


def _turning(phases: FloatArray) -> FloatArray:
    return np.stack([np.ones_like(phases), np.cos(phases), np.sin(phases)], axis=1)


def _points(term: Term, points: Mapping[str, FloatArray] | None) -> FloatArray:
    extra = (points or {}).get(term.part)
    return term.points if extra is None or not len(extra) else np.vstack([extra, term.points])


def _plausible(term: Term, share: float) -> float:
    """Weigh a response that would have to be turned round: right for signed sizes and phases, wrong for a friction below zero."""
    if share > 0.0 or bool((term.low < 0.0).any()):
        return 1.0
    return 0.05


def _start(term: Term, item: _Response) -> FloatArray:
    _, share, point, _ = item
    size = float(np.clip(abs(share), 0.02, 20.0))
    if share < 0.0 and bool((term.low < 0.0).any()) and not any(name.endswith("phase") for name in term.parameters):
        size = -size
    away = np.array([name.partition(".")[2] in term.effect.neutral for name in term.parameters]) & ~is_limit(term)
    scaled = np.where(away, term.neutral + (point - term.neutral) * size, point)
    if share < 0.0:
        # a wave of negative size is the same wave half a turn on
        scaled[_phases(term)] += np.pi
    return np.clip(scaled, term.low, term.high)


def is_limit(term: Term) -> np.ndarray:
    """Say for each parameter whether it vanishes far beyond its usual sizes, as a limit does: then there is nothing to scale."""
    usual = np.abs(term.points).max(axis=0, initial=0.0)
    return np.asarray(np.abs(term.neutral) > _FAR_BEYOND * usual)


def _basis(tried: Sequence[_Response]) -> FloatArray:
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
        self.references = (simulator.with_long_steps(fitted.by_name), fitted.residual)
        white = self._whiten(fitted.sensitivity) if fitted.sensitivity is not None and len(fitted.free) else None
        precision = np.array([1.0 / item.uncertainty if np.isfinite(item.uncertainty) else 0.0 for item in fitted.free])
        self._stacked = None
        if white is not None:
            scale = np.array([item.scale for item in fitted.free])
            # a value that is as far off as the lesson holds possible takes up no more
            low, high = np.array([item.low for item in fitted.free]), np.array([item.high for item in fitted.free])
            moves = np.minimum(fitted.values - low, high - fitted.values) > _AT_END * scale
            stacked = (np.vstack([white.T, np.diag(precision)]) * scale)[:, moves]
            q, r = np.linalg.qr(stacked)
            good = np.abs(np.diag(r)) > 1e-10 * np.abs(np.diag(r)).max(initial=1e-300)
            self._stacked = np.ascontiguousarray(q[:, good], dtype=_SINGLE)
        self._extra = len(fitted.free) if white is not None else 0
        # what holds the baseline away from its given values is evidence too: a candidate may take that strain away
        strain = precision * (np.array([item.given for item in fitted.free]) - fitted.values) if self._extra else np.zeros(0)
        self.residual = self._less_absorbed(np.concatenate([self._whiten(fitted.residual), strain], dtype=_SINGLE))

    def _whiten(self, arrays: FloatArray) -> FloatArray:
        return np.concatenate([model.whiten(arrays[..., channel, :], wide=True) for channel, model in enumerate(self.noise)], axis=-1)

    def shares(self, explained: FloatArray) -> FloatArray:
        """Give the share of the residual that is gone with ``explained``: for each channel in the band of the motion and on all."""
        found, begin = [], 0
        for model in self.noise:
            half = len(model.power)
            band = min(model.band, half)
            for part in (np.r_[begin : begin + band, begin + half : begin + half + band], slice(begin, begin + 2 * half)):
                power = float(np.sum(self.residual[part] ** 2))
                left = float(np.sum((self.residual[part] - explained[part]) ** 2))
                found.append(1.0 - left / power if power > 0.0 else 0.0)
            begin += 2 * half
        return np.array(found)

    def draws(self, number: int) -> FloatArray:
        """Give noise as the noise model has it, whitened, less what the baseline absorbs; (number, values)."""
        random = np.random.Generator(np.random.Philox(0))
        noise = np.zeros((number, len(self.residual)), dtype=_SINGLE)
        noise[:, : noise.shape[1] - self._extra] = random.standard_normal((number, noise.shape[1] - self._extra), dtype=_SINGLE)
        return self._less_absorbed(noise)

    def left(self, signals: FloatArray) -> FloatArray:
        """Give signals (..., channels, samples) whitened, less what the baseline absorbs."""
        white = self._whiten(signals)
        return self._less_absorbed(np.concatenate([white, np.zeros((*white.shape[:-1], self._extra))], axis=-1, dtype=_SINGLE))

    def _less_absorbed(self, white: np.ndarray) -> FloatArray:
        if self._stacked is None:
            return white
        return np.asarray(white - (white @ self._stacked) @ self._stacked.T, dtype=_SINGLE)
