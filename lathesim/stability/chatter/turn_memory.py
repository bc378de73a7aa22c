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

_TURNS = 2.0
"""Distance in turns over which the memory of a band is judged: whole and half orders both come back to themselves in two."""
_BANDS = (0.06, 0.2)
"""Half widths of a band over its frequency, assumed: wider than a mode, so that the band does not make a memory of its own; and as wide as
segments that scatter by 15 %. Noise varies as much in both, so the steadier one counts."""
_BAND_TURNS = 0.3
_REACH = 3.0


@dataclass(frozen=True)
class TurnMemory:
    """Of the later half of a vibration's band: ``kept``, the coherence with itself two turns before, from 0 to 1, and ``variation``, the
    standard deviation of its envelope over the mean."""

    kept: float
    variation: float


def turn_memory(values: FloatArray, rate: float, turning: float, frequency: float, *, orders: bool = False) -> TurnMemory:
    """Return the memory of the band around a frequency [Hz]; whole orders of the spindle in it are taken off unless ``orders`` asks."""
    kept, variation = 0.0, math.inf
    for place, share in enumerate(_BANDS[:1] if orders else _BANDS):
        half_band = max(_BAND_TURNS * turning, share * frequency)
        rest = values if orders else _without_orders(values, rate, turning, frequency, _REACH * half_band)
        band = _later(_analytic(rest, rate, frequency, half_band), rate / turning)
        if place == 0:
            kept = _coherence(band, round(_TURNS * rate / turning))
        envelope = np.abs(band)
        mean = float(envelope.mean()) if len(envelope) else 0.0
        variation = min(variation, float(envelope.std()) / mean if mean > 0.0 else math.inf)
    return TurnMemory(kept, variation)


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


def _without_orders(values: FloatArray, rate: float, turning: float, frequency: float, reach: float) -> FloatArray:
    """Return a signal less the whole orders within ``reach`` [Hz] of a frequency, by least squares."""
    first, last = max(1, math.ceil((frequency - reach) / turning)), math.floor((frequency + reach) / turning)
    if last < first:
        return values
    time = np.arange(len(values)) / rate
    orders = np.arange(first, last + 1)
    phases = np.exp(2j * np.pi * turning * np.outer(orders, time))
    columns = np.concatenate([phases.real, phases.imag])
    amounts = np.linalg.solve(columns @ columns.T, columns @ values)
    return np.asarray(values - amounts @ columns)


def _analytic(values: FloatArray, rate: float, frequency: float, half_band: float) -> Any:
    spectrum = np.fft.fft(values)
    place = np.fft.fftfreq(len(values), 1.0 / rate)
    return 2.0 * np.fft.ifft(spectrum * np.exp(-0.5 * ((place - frequency) / half_band) ** 2))
