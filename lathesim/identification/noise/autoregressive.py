"""What one sample of a misfit tells that the samples before did not: an autoregressive model of it, with less trust in what is far out.

    w_k = trust_k (r_k - sum_j a_j r_(k-j)) / spread

Source: Ljung, System Identification, 2nd ed., section 7.2 (prediction errors); Huber, Robust Statistics, chapter 7 (far-out samples).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray

_LEAST_ORDERS = 20
"""Samples for each coefficient without which none is fitted."""
_FAR = 4.0
"""Misfits beyond so many spreads count less (Huber): a cut that begins or ends a little elsewhere is not noise."""
_ORDER = 6
"""Samples back to which what is left is predicted."""


@dataclass(frozen=True, eq=False)
class Whitening:
    """What one channel's misfit is predicted by, from the samples before, and the spread of what is not [floors].

    ``trust`` (samples,) is 1 where that is as usual and less where it is far out.
    """

    prediction: FloatArray
    spread: float
    trust: FloatArray | None = None

    def whiten(self, rows: FloatArray) -> FloatArray:
        """Return rows (..., samples) without what the samples before tell of them; the first samples count nothing."""
        from scipy.signal import lfilter

        if not len(self.prediction):
            return np.asarray(rows / self.spread)
        white = np.asarray(lfilter(np.concatenate([[1.0], -self.prediction]), [self.spread], rows, axis=-1))
        white[..., : len(self.prediction)] = 0.0
        return white if self.trust is None else np.asarray(white * self.trust)


def no_whitening(channels: int) -> list[Whitening]:
    """Weigh every channel by its floor."""
    return [Whitening(np.zeros(0), 1.0)] * channels


def whitening_of(row: FloatArray) -> Whitening:
    """Return the autoregressive model of a channel's misfit (samples,), by least squares."""
    if len(row) < _LEAST_ORDERS * _ORDER:
        return Whitening(np.zeros(0), max(float(np.sqrt(np.mean(np.square(row)))), 1.0))
    before = np.column_stack([row[_ORDER - lag : len(row) - lag] for lag in range(1, _ORDER + 1)])
    trust, new = np.ones(len(row)), row
    prediction = np.zeros(_ORDER)
    for _ in range(2):
        now = trust[_ORDER:]
        prediction = np.asarray(np.linalg.lstsq(before * now[:, None], row[_ORDER:] * now, rcond=None)[0])
        new = row[_ORDER:] - before @ prediction
        usual = 1.4826 * float(np.median(np.abs(new)))
        if usual > 0.0:
            trust[_ORDER:] = np.sqrt(_FAR * usual / np.maximum(np.abs(new), _FAR * usual))
    return Whitening(prediction, max(float(np.sqrt(np.mean(np.square(new * trust[_ORDER:])))), 1e-3), trust)
