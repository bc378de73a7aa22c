"""Limits and chatter frequencies of one mode, for many machines at once.

In units of the mode, rho = w/w_n, r = n/(60 f_n) and beta = b Ks mu/k, the limit is beta = -1/(2 Re g(rho)) with g = 1/(1 - rho^2 + 2 j
zeta rho), met where  rho = r (N + eps(rho)/(2 pi)).  For each lobe N there is one such rho above 1, as eps falls from 2 pi to pi. Above the
limit the cut vibrates as exp(s t) with  s^2 + 2 zeta s + 1 + beta (1 - exp(-2 pi s/r)) = 0.

Source: Y. Altintas, Manufacturing Automation (2012), section 4.2; T. Schmitz, K. S. Smith, Machining Dynamics (2019), chapter 3.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from lathesim.record import FloatArray

_LOBES = 5
"""Lobes looked at, from the first that reaches above the natural frequency; higher ones lie above."""
_HALVINGS = 44
_RATES = (0.012, 8.0, 2400)
_DAMPINGS = (0.002, 0.6, 60)


def lobes_of(rate: FloatArray, damping: FloatArray, halvings: int = _HALVINGS) -> tuple[FloatArray, FloatArray]:
    """Return the limits beta and the frequencies rho of the lobes around, both (lobes, ...), for r and zeta of one shape."""
    first = np.maximum(np.ceil(1.0 / rate - 1.0 + 1e-12), 0.0)
    limits, places = [], []
    for lobe in range(_LOBES):
        number = first + lobe
        low, high = np.maximum(1.0, rate * (number + 0.5)), rate * (number + 1.0)
        for _ in range(halvings):
            middle = 0.5 * (low + high)
            turn = np.arctan2(2.0 * damping * middle, middle * middle - 1.0) / np.pi
            # arg g = -(pi - that angle); eps/(2 pi) = 1/2 + angle/pi
            above = middle - rate * (number + 0.5 + turn) > 0.0
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        rho = 0.5 * (low + high)
        real = (1.0 - rho**2) / ((1.0 - rho**2) ** 2 + (2.0 * damping * rho) ** 2)
        limits.append(np.where(real < 0.0, -0.5 / np.minimum(real, -1e-300), np.inf))
        places.append(rho)
    return np.stack(limits), np.stack(places)


@functools.cache
def _table() -> tuple[FloatArray, float, float, float, float]:
    """Return the logarithm of the limit over the logarithms of r and zeta, and the grid's beginnings and steps."""
    low, high, count = _RATES
    rates = np.linspace(math.log(low), math.log(high), count)
    least, most, lines = _DAMPINGS
    dampings = np.linspace(math.log(least), math.log(most), lines)
    r, z = np.meshgrid(np.exp(rates), np.exp(dampings), indexing="ij")
    limits = lobes_of(r, z, 24)[0].min(axis=0)
    return np.log(limits), float(rates[0]), float(rates[1] - rates[0]), float(dampings[0]), float(dampings[1] - dampings[0])


def log_limit(log_rate: FloatArray, log_damping: FloatArray) -> FloatArray:
    """Return the logarithm of the limit beta at logarithms of r and zeta, linear in a table; beyond its ends the end counts."""
    table, first, step, begin, width = _table()
    x = np.clip((log_rate - first) / step, 0.0, table.shape[0] - 1.001)
    y = np.clip((log_damping - begin) / width, 0.0, table.shape[1] - 1.001)
    i, j = x.astype(np.int64), y.astype(np.int64)
    u, v = x - i, y - j
    return np.asarray((1 - u) * ((1 - v) * table[i, j] + v * table[i, j + 1]) + u * ((1 - v) * table[i + 1, j] + v * table[i + 1, j + 1]))


def chatter_places(rate: FloatArray, damping: FloatArray, beta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rho of the limit and of the fastest growing vibration at a width beta, both as ``rate``; both are equal where it is stable."""
    limits, places = lobes_of(rate, damping)
    lowest = np.take_along_axis(places, limits.argmin(axis=0)[None], axis=0)[0]
    best_growth, best = np.full(rate.shape, -np.inf), lowest.copy()
    delay = 2.0 * np.pi / rate
    for limit, place in zip(limits, places, strict=True):
        unstable = limit < beta
        if not unstable.any():
            continue
        s = 1j * place
        for part in (0.25, 0.5, 0.75, 1.0):
            now = np.where(unstable, limit * np.exp(part * np.log(np.where(unstable, beta / limit, 1.0))), 1.0)
            for _ in range(4):
                s = s - _newton(s, damping, now, delay)
        growth = np.where(unstable & np.isfinite(s.real) & (s.imag > 0.5) & (s.imag < 6.0), s.real, -np.inf)
        better = growth > best_growth
        best, best_growth = np.where(better, s.imag, best), np.where(better, growth, best_growth)
    return lowest, best


def _newton(s: Any, damping: FloatArray, beta: FloatArray, delay: FloatArray) -> Any:
    wave = np.exp(np.clip(-(s * delay).real, -50.0, 50.0) - 1j * (s * delay).imag)
    value = s * s + 2.0 * damping * s + 1.0 + beta * (1.0 - wave)
    slope = 2.0 * s + 2.0 * damping + beta * delay * wave
    step = value / slope
    size = np.abs(step)
    return step * np.minimum(1.0, 0.1 / np.maximum(size, 1e-300))
