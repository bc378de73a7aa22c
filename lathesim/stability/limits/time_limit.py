"""The limit of the chip width in the time domain: the width at which a small difference neither grows nor shrinks in the engine."""

from __future__ import annotations

import math

import numpy as np

from lathesim.stability.limits.growth import Rig, growth

_AT_ONCE = 6
_RISE = 1.15
_CLOSE = 2e-4
"""The limit is known when its bracket is this narrow."""


def time_limit(made: Rig, guess: float, largest: float) -> tuple[float, complex]:
    """Return the smallest chip width [m] at which a rig chatters, and the multiplier there; infinity where none up to ``largest``.

    Widths are raised from ``guess`` by a seventh at a time until one grows; then the bracket is halved, each half by a line through its
    ends.
    """
    low, low_rate = 0.0, -math.inf
    width = guess
    while True:
        widths = np.asarray(width * _RISE ** np.arange(_AT_ONCE), dtype=np.float64)
        found = growth(made, widths)
        rates = [_rate(value) for value in found]
        above = next((place for place, rate in enumerate(rates) if rate > 0.0), None)
        if above is None:
            low, low_rate = float(widths[-1]), rates[-1]
            width = low * _RISE
            if width > largest:
                return math.inf, 0j
            continue
        if above == 0 and low == 0.0:
            width = 0.5 * float(widths[0])
            if width < 1e-9 * guess:
                return 0.0, found[0]
            continue
        if above > 0:
            low, low_rate = float(widths[above - 1]), rates[above - 1]
        return _refined(made, low, low_rate, float(widths[above]), rates[above], found[above])


def _rate(multiplier: complex) -> float:
    size = abs(multiplier)
    return math.log(size) if 0.0 < size < math.inf else math.copysign(50.0, size - 1.0)


def _refined(made: Rig, low: float, low_rate: float, high: float, high_rate: float, at_high: complex) -> tuple[float, complex]:
    """Return the width between two at which the rate is 0, by false position held to the middle where it lags."""
    for _ in range(12):
        if high - low < _CLOSE * high:
            break
        part = min(max(-low_rate / (high_rate - low_rate), 0.05), 0.95)
        width = low + part * (high - low)
        near = 0.1 * _CLOSE * high
        probe = np.array([max(width - near, 0.5 * (low + width)), min(width + near, 0.5 * (high + width))])
        values = growth(made, probe)
        for at, value in zip(probe.tolist(), values, strict=True):
            rate = _rate(value)
            if rate > 0.0 and at < high:
                high, high_rate, at_high = at, rate, value
            elif rate <= 0.0 and at > low:
                low, low_rate = at, rate
    part = -low_rate / (high_rate - low_rate) if high_rate > low_rate else 0.5
    return low + part * (high - low), at_high
