"""What a vibration keeps from turn to turn: the mark that tells chatter from noise.

Chatter repeats itself: after a turn it is a complex multiple of what it was, so its band is coherent over turns, and its amplitude is
steady once it has set in. A mode that the noise of the cut shakes is narrow-band Gaussian noise: it forgets, and its envelope follows
Rayleigh's distribution, whose standard deviation is sqrt(4/pi - 1) = 0.52 of its mean. Chips that break in segments have a steady
amplitude but a phase that walks. Source: S. O. Rice, Bell Syst. Tech. J. 23 (1944); T. Insperger, G. Stepan,
Semi-Discretization for Time-Delay Systems (2011), multipliers of a turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.record import FloatArray
from lathesim.stability.thresholds import REPEATS

_TURNS = 2.0
"""Distance in turns over which the memory of a band is judged: whole and half orders both come back to themselves in two."""
_BANDS = (0.06, 0.2)
"""Half widths of a band over its frequency, assumed: wider than a mode, so that the band does not make a memory of its own; and as wide as
segments that scatter by 15 %. Noise varies as much in both, so the steadier one counts."""
_BAND_TURNS = 0.3
_OF_NOISE = math.sqrt(4.0 / math.pi - 1.0)


@dataclass(frozen=True)
class TurnMemory:
    """Of the later half of a vibration's band: ``kept``, the coherence with itself two turns before, from 0 to 1; ``variation``, the
    standard deviation of its envelope over the mean; and ``independent``, how many values of the envelope are independent of each other."""

    kept: float
    variation: float
    independent: float = 1.0

    @property
    def is_steady(self) -> bool:
        """Whether the amplitude varies less than that of noise would, which varies by 0.52 give or take 0.52/sqrt(2 independent)."""
        return self.variation < _OF_NOISE - REPEATS.errors * _OF_NOISE / math.sqrt(2.0 * max(self.independent, 1.0))


def turn_memory(values: FloatArray, rate: float, turning: float, frequency: float, *, orders: bool = False) -> TurnMemory:
    """Return the memory of the band around a frequency [Hz]; whole orders of the spindle in it are taken off unless ``orders`` asks."""
    kept, variation, independent = 0.0, math.inf, 1.0
    rest = values if orders else without_orders(values, rate, turning)
    for place, share in enumerate(_BANDS[:1] if orders else _BANDS):
        half_band = max(_BAND_TURNS * turning, share * frequency)
        band = _later(_analytic(rest, rate, frequency, half_band), rate / turning)
        if place == 0:
            kept = _coherence(band, round(_TURNS * rate / turning))
        envelope = np.abs(band)
        mean = float(envelope.mean()) if len(envelope) else 0.0
        varies = float(envelope.std()) / mean if mean > 0.0 else math.inf
        if varies < variation:
            variation, independent = varies, independent_values(band)
    return TurnMemory(kept, variation, independent)


def independent_values(band: Any) -> float:
    """Return how many values of a complex band are independent: its length over the sum of the squares of its autocorrelation.

    Source: J. S. Bendat, A. G. Piersol, Random Data (2010), section 8.2.
    """
    count = len(band)
    if count < 2:
        return 1.0
    spectrum = np.abs(np.fft.fft(band)) ** 2
    total = float((spectrum**2).sum())
    return max(1.0, float(spectrum.sum() ** 2) / total) if total > 0.0 else 1.0


def _later(band: Any, turn: float) -> Any:
    """Return the later half of a band less half a turn at its end; all of a short one."""
    edge = int(0.5 * turn)
    later = band[len(band) // 2 : len(band) - edge]
    return later if len(later) > 2 * _TURNS * turn else band[edge : len(band) - edge]


def _coherence(band: Any, lag: int) -> float:
    """Return how alike a band is to itself ``lag`` samples before, from 0 to 1."""
    if len(band) <= lag + 8:
        return 0.0
    now, before = band[lag:], band[:-lag]
    size = math.sqrt(float(np.vdot(now, now).real) * float(np.vdot(before, before).real))
    return float(abs(np.vdot(before, now)) / size) if size > 0.0 else 0.0


def turn_shares(values: FloatArray, rate: float, turning: float) -> tuple[float, float]:
    """Return the shares of the power that repeat every turn, and that repeat every turn with the sign changed: whole and half orders.

    They are the power of the mean turn, and of the mean with alternating signs, less what noise leaves in means of so many turns.
    """
    rows = _turns(values, rate / turning)
    total = float(rows.var())
    if len(rows) < 4 or not total > 0.0:
        return 0.0, 0.0
    signs = np.where(np.arange(len(rows)) % 2 == 0, 1.0, -1.0)[:, None]
    shares = []
    for turned in (rows, signs * rows):
        mean = turned.mean(axis=0)
        left = float(((turned - mean) ** 2).mean()) / (len(rows) - 1)
        shares.append(max(0.0, float((mean**2).mean()) - left) / total)
    return shares[0], shares[1]


def _turns(values: FloatArray, turn: float) -> FloatArray:
    """Return whole turns of a signal, (turns, samples of a turn), straight between samples."""
    count, samples = int((len(values) - 1) / turn), int(turn)
    places = (np.arange(count)[:, None] + np.arange(samples)[None, :] / samples) * turn
    return np.interp(places.ravel(), np.arange(len(values)), values).reshape(count, samples)


def without_orders(values: FloatArray, rate: float, turning: float) -> FloatArray:
    """Return a signal less its mean turn."""
    turn = rate / turning
    mean = _turns(values, turn).mean(axis=0)
    place = np.mod(np.arange(len(values)), turn) / turn * len(mean)
    return np.asarray(values - np.interp(place, np.arange(len(mean) + 1), np.append(mean, mean[0])))


def _analytic(values: FloatArray, rate: float, frequency: float, half_band: float) -> Any:
    spectrum = np.fft.fft(values)
    place = np.fft.fftfreq(len(values), 1.0 / rate)
    return 2.0 * np.fft.ifft(spectrum * np.exp(-0.5 * ((place - frequency) / half_band) ** 2))
