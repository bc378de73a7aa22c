"""Which candidates are worth a fit: how much of the whitened residual their response explains, beside what the baseline can absorb.

For each candidate the responses at a few starting values are projected, together with the sensitivities of the free parameters, onto the
residual. No optimiser is involved; all runs are one batch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.fft import rfft

from lathesim.diagnosis.records.found import Screened
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.execution import together
from lathesim.identification.records import FAR_BEYOND, Candidate, Fitted
from lathesim.identification.replay.simulator import Simulator
from lathesim.identification.signal import SLOPE_ROUNDING

_NOTHING = 1e-6
"""Whitened power of a response, share of the largest eigenvalue, and scales from a bound below which there is nothing."""
_FEWEST_PHASES = 3
"""Phases of a wave that must be tried for the best one between them to be known."""


_SINGLE = np.float32
"""Screening ranks candidates: it needs no more digits, and half the memory takes half the time."""
_Response = tuple[float, float, FloatArray, FloatArray]
"""What a response scores [nats], by how much it is to be scaled, its starting value, and itself (values,)."""


def screen(
    simulator: Simulator, fitted: Fitted, candidates: Sequence[Candidate], points: Mapping[str, FloatArray] | None = None
) -> tuple[Screened, ...]:
    """Return how the candidates that move a channel score, the best first; ``points`` are starting values by part instead of usual ones."""
    absorb = _Absorber(simulator, fitted)

    def one(candidate: Candidate) -> Screened | None:
        tried = _responses(simulator, fitted, absorb, candidate, _points(candidate, points))
        if candidate.otherwise:
            tried += _responses(simulator, fitted, absorb, candidate, _points(candidate, points), candidate.otherwise)
            tried.sort(key=lambda item: -item[0] * _plausible(candidate, item[1]))
        if not tried:
            return None
        starts = tuple(_start(candidate, item) for item in _apart(candidate, tried)[:3])
        amount = _basis(tried) @ absorb.residual
        return Screened(candidate, 0.5 * float(amount @ amount), starts)

    found = [promised for promised in together(one, candidates) if promised is not None]
    return tuple(sorted(found, key=lambda item: -item.gain))


def _responses(
    simulator: Simulator,
    fitted: Fitted,
    absorb: _Absorber,
    candidate: Candidate,
    points: FloatArray,
    others: Mapping[str, float] | None = None,
) -> list[_Response]:
    """Return what a candidate at each start, with ``others``, does to the residual beside what the baseline absorbs, the best first."""
    base = {**fitted.by_name, **dict(zip(candidate.parameters, candidate.neutral.tolist(), strict=True)), **(others or {})}
    names = list(base)
    rows = np.tile(np.array(list(base.values())), (len(points), 1))
    rows[:, [names.index(name) for name in candidate.parameters]] = points
    runs = simulator.responses(names, rows, absorb.references, absorb.tapered)
    there = [(point, run) for point, run in zip(points, runs, strict=True) if run is not None]
    found = []
    for (point, _), response in zip(there, absorb.left([run for _, run in there]), strict=True):
        power = float(response @ response)
        if np.isfinite(power) and power > _NOTHING:
            share = float(response @ absorb.residual) / power
            found.append((0.5 * share * share * power, share, point, response))
    found += _at_best_phases(candidate, found, absorb.residual)
    return sorted(found, key=lambda item: -item[0] * _plausible(candidate, item[1]))


def _phases(candidate: Candidate) -> list[int]:
    phases = candidate.named(candidate.effect.identification.phases)
    return [place for place, name in enumerate(candidate.parameters) if name in phases]


def _apart(candidate: Candidate, tried: Sequence[_Response]) -> list[_Response]:
    """Return the responses that differ in more than their phase, of each the best: from the others a fit would end in the same place."""
    kept: dict[bytes, _Response] = {}
    for item in tried:
        kept.setdefault(np.delete(item[2], _phases(candidate)).tobytes(), item)
    return list(kept.values())


def _at_best_phases(candidate: Candidate, tried: Sequence[_Response], residual: FloatArray) -> list[_Response]:
    """Return what a wave would do at its best phase, from what it does at some phases of the same wavelength.

    r(phase) = r_0 + r_s cos(phase) + r_c sin(phase) by least squares; of the phases the one with the largest (r'e)^2 / r'r is taken.
    """
    columns, alike = _phases(candidate), dict[bytes, list[_Response]]()
    found: list[_Response] = []
    for item in tried if columns else ():
        alike.setdefault(np.delete(item[2], columns).tobytes(), []).append(item)
    for items in alike.values():
        phases = np.array([item[2][columns[0]] for item in items])
        if len(set(phases.tolist())) < _FEWEST_PHASES:
            continue
        parts = np.linalg.pinv(_turning(phases)) @ np.stack([item[3] for item in items])
        turns = np.linspace(-np.pi, np.pi, 72, endpoint=False)
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


def _points(candidate: Candidate, points: Mapping[str, FloatArray] | None) -> FloatArray:
    """Return where a candidate starts: what was read off the recording, else its usual values."""
    read_off = (points or {}).get(candidate.part)
    return candidate.points if read_off is None or not len(read_off) else read_off


def _plausible(candidate: Candidate, share: float) -> float:
    """Weigh a response that would have to be turned round: right for signed sizes and phases, wrong for a friction below zero."""
    return 1.0 if share > 0.0 or bool((candidate.low < 0.0).any()) else 0.05


def _start(candidate: Candidate, item: _Response) -> FloatArray:
    _, share, point, _ = item
    size = share if bool((candidate.low < 0.0).any()) and not _phases(candidate) else abs(share)
    scaled = np.where(in_proportion(candidate), candidate.neutral + (point - candidate.neutral) * size, point)
    if share < 0.0:
        # a wave of negative size is the same wave half a turn on
        scaled[_phases(candidate)] += np.pi
    return np.clip(scaled, candidate.low, candidate.high)


def in_proportion(candidate: Candidate) -> np.ndarray:
    """Return for each parameter whether it is a size in proportion to which the effect acts: a limit and the step of a grid are not."""
    names = [Place.of(name).port for name in candidate.parameters]
    sizes = np.array([name in candidate.effect.neutral and name != candidate.effect.identification.spacing for name in names])
    return np.asarray(sizes & ~is_limit(candidate))


def is_limit(candidate: Candidate) -> np.ndarray:
    """Return for each parameter whether it vanishes far beyond its usual sizes, as a limit does: then there is nothing to scale."""
    return np.asarray(np.abs(candidate.neutral) > FAR_BEYOND * np.abs(candidate.points).max(axis=0, initial=0.0))


def _basis(tried: Sequence[_Response]) -> FloatArray:
    """Return orthonormal rows that span the responses of a candidate."""
    responses = np.stack([item[3] / np.sqrt(item[3] @ item[3]) for item in tried])
    values, vectors = np.linalg.eigh(responses @ responses.T)
    good = values > _NOTHING * values[-1]
    return np.asarray((vectors[:, good] / np.sqrt(values[good])).T @ responses)


class _Absorber:
    """Takes out of whitened signals what the free parameters, within their uncertainties, can explain."""

    def __init__(self, simulator: Simulator, fitted: Fitted) -> None:
        self.noise = fitted.noise
        self.references = (simulator.with_long_steps(fitted.by_name), fitted.residual)
        self._extra = 0
        white = self._whiten(self.tapered(fitted.sensitivity)) if fitted.sensitivity is not None and len(fitted.free) else None
        precision = np.array([1.0 / item.uncertainty if np.isfinite(item.uncertainty) else 0.0 for item in fitted.free])
        self._stacked = None
        if white is not None:
            scale = np.array([item.scale for item in fitted.free])
            # a value that is as far off as the lesson holds possible takes up no more
            low, high = np.array([item.low for item in fitted.free]), np.array([item.high for item in fitted.free])
            moves = np.minimum(fitted.values - low, high - fitted.values) > _NOTHING * scale
            stacked = (np.vstack([white.T.astype(float), np.diag(precision)]) * scale)[:, moves]
            q, r = np.linalg.qr(stacked)
            good = np.abs(np.diag(r)) > SLOPE_ROUNDING * np.abs(np.diag(r)).max(initial=np.finfo(float).tiny)
            self._stacked = np.ascontiguousarray(q[:, good].T, dtype=_SINGLE)
        self._extra = len(fitted.free) if white is not None else 0
        # what holds the baseline away from its given values is evidence too: a candidate may take that strain away
        strain = precision * (np.array([item.given for item in fitted.free]) - fitted.values) if self._extra else np.zeros(0)
        self.residual = self._whiten(self.tapered(fitted.residual))
        self.residual[len(self.residual) - len(strain) :] = strain
        self._less_absorbed(self.residual[None])

    def tapered(self, signals: FloatArray) -> FloatArray:
        """Return signals (..., channels, samples) as they are to be transformed; the last two values of each channel keep its mean."""
        found = np.zeros((*signals.shape[:-1], signals.shape[-1] + 2), dtype=_SINGLE)
        for channel, model in enumerate(self.noise):
            found[..., channel, :-2] = model.tapered(signals[..., channel, :])
            found[..., channel, -1] = model.mean_of(signals[..., channel, :]) / model.mean_spread
        return found

    def _whiten(self, tapered: FloatArray) -> FloatArray:
        """Return tapered signals (..., channels, samples + 2) whitened, (..., values): each real part with its imaginary one beside it, and
        zeros for what holds the baseline.

        All are transformed in one call: several at a time take a third of the time.
        """
        spectra = rfft(tapered[..., :-2], axis=-1)
        spectra *= np.array([model.gain for model in self.noise], dtype=_SINGLE)
        white = spectra.view(_SINGLE)
        white[..., 1] = tapered[..., -1]
        flat = white.reshape(*tapered.shape[:-2], -1)
        return np.concatenate([flat, np.zeros((*flat.shape[:-1], self._extra), dtype=_SINGLE)], axis=-1)

    def left(self, tapered: Sequence[FloatArray]) -> FloatArray:
        """Return :meth:`tapered` signals whitened, (signals, values), less what the baseline absorbs."""
        return self._less_absorbed(self._whiten(np.stack(tapered))) if tapered else np.zeros((0, len(self.residual)), dtype=_SINGLE)

    def _less_absorbed(self, white: FloatArray) -> FloatArray:
        if self._stacked is not None:
            white -= (white @ self._stacked.T) @ self._stacked
        return white
