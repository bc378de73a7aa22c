"""The colour of a noise: a filter that makes it white as far as its memory is short, and how many samples count as one beyond that.

Source: Ljung, System Identification, 2nd ed., section 7.2 (autoregressive prediction errors); Priestley, Spectral Analysis and Time Series,
section 5.3.2 (variance of the mean of correlated samples).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from lathesim.engine.assembly import FloatArray

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Colour:
    """A ``filter`` (coefficients,) that whitens, how many whitened samples count as one, and the share of its mean that each block of so
    many samples is relieved of: over a block a quantised sensor may be off."""

    ORDER: ClassVar[int] = 30
    """Coefficients, as far as there are twenty samples for each."""
    SLOW: ClassVar[float] = 0.3
    """Gain that the filter keeps at frequency zero: what is left of a wrong model is slow, and is not to be taken for a walk of noise."""
    TABLE: ClassVar[int] = 4096
    """Frequencies at which the gain is tabulated."""

    filter: FloatArray
    inflation: float = 1.0
    length: int = 1
    relieved: float = 0.0

    @classmethod
    def white(cls) -> Colour:
        """Return the colour of white noise."""
        return cls(np.ones(1))

    def whiten(self, columns: FloatArray, counted: BoolArray) -> FloatArray:
        """Return columns (samples, ...) whitened; the first samples, and those that are not ``counted`` (samples,), are 0."""
        white = columns if len(self.filter) == 1 else lfilter(self.filter, 1.0, columns, axis=0)
        white = np.asarray(white / np.sqrt(self.inflation))
        if not counted.all():
            usable = np.convolve(~counted, np.ones(len(self.filter)))[: len(counted)] == 0.0
            white[~usable] = 0.0
        white[: len(self.filter) - 1] = 0.0
        self._relieve(white)
        return white

    def _relieve(self, white: FloatArray) -> None:
        """Multiply by the inverse square root of 1 + spread over the block, which takes a share of the mean of each block off, in place."""
        if self.relieved:
            blocks = white[len(white) % self.length :].reshape(-1, self.length, *white.shape[1:])
            blocks -= self.relieved * blocks.mean(axis=1, keepdims=True)

    def matched(self, white: FloatArray) -> FloatArray:
        """Return whitened values (samples,) filtered backwards: their products with columns are those of the whitened columns."""
        white = white.copy()
        self._relieve(white)
        return np.asarray(lfilter(self.filter, 1.0, white[::-1])[::-1] / np.sqrt(self.inflation))

    def power(self, frequency: FloatArray) -> FloatArray:
        """Return by how much the filter multiplies the power at frequencies [cycles a sample]."""
        table = np.abs(rfft(self.filter, self.TABLE)) ** 2 / self.inflation
        return np.asarray(table[np.minimum(frequency * self.TABLE, self.TABLE // 2).astype(np.int64)])


def colour_of(noise: FloatArray, counted: BoolArray, length: int, unresolved: float) -> Colour:
    """Return the colour of a noise (samples,): an autoregressive filter, and the sum of the correlations that it leaves within ``length``.
    ``unresolved`` is by how much sensors may be off over a block of that length, one standard deviation [unit of the noise]."""
    centred = np.zeros(len(noise))
    centred[counted] = noise[counted] - np.mean(noise[counted])
    order = min(Colour.ORDER, len(noise) // 20)
    correlation = _correlation(centred, max(order + 1, length))
    if correlation[0] <= 0.0:
        return Colour.white()
    floor = 1e-6
    while True:
        lags = correlation[: order + 1].copy()
        lags[0] *= 1.0 + floor
        filtered = np.concatenate([[1.0], -solve_toeplitz(lags[:-1], lags[1:])]) if order else np.ones(1)
        if abs(filtered.sum()) >= Colour.SLOW:
            break
        floor *= 2.0
    after = _correlation(Colour(filtered).whiten(centred, counted), length)
    weights = 1.0 - np.arange(1, length) / length
    inflation = max(1.0, 1.0 + 2.0 * float(weights @ after[1:]) / max(float(after[0]), 1e-300))
    spread = float(after[0]) / np.count_nonzero(counted)
    block = length / inflation * (filtered.sum() * unresolved) ** 2 / max(spread, 1e-300)
    return Colour(filtered, inflation, length, 1.0 - 1.0 / np.sqrt(1.0 + block))


def _correlation(values: FloatArray, lags: int) -> FloatArray:
    """Return the sums of products of values so many samples apart (lags,)."""
    transformed = rfft(values, next_fast_len(2 * len(values), real=True))
    return np.asarray(irfft(np.abs(transformed) ** 2, next_fast_len(2 * len(values), real=True))[:lags])
