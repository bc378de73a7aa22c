"""When a drift reaches a tolerance: a straight line through what was seen, and the interval in which it may be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.record import FloatArray

LEAST_POINTS = 5
"""Points that a line needs: two for the line, and three to tell how far they lie from it."""


@dataclass(frozen=True)
class Forecast:
    """When a tolerance is reached: ``time`` [s] and its 95 % interval ``low`` to ``high``, which may be infinite."""

    time: float
    low: float
    high: float


@dataclass(frozen=True)
class Line:
    """A straight line ``place + slope (t - middle)`` through ``count`` points: their ``variance`` about it, larger where they depend on
    their neighbours, and the ``spread`` of their times (sum of squares)."""

    middle: float
    place: float
    slope: float
    variance: float
    spread: float
    count: int

    def at(self, time: float) -> float:
        """Return the value of the line at a time [s]."""
        return float(self.place + self.slope * (time - self.middle))

    def rises(self, error: float) -> float:
        """Return the sign of the slope where it is not 0 at a probability of ``error`` to be wrong, else 0."""
        limit = _student(1.0 - 0.5 * error, self.count - 2.0) * np.sqrt(self.variance / self.spread)
        return float(np.sign(self.slope)) if abs(self.slope) > limit else 0.0


def line_through(time: FloatArray, value: FloatArray) -> Line | None:
    """Return the line through points by least squares; None with less than five of them.

    Points that depend on their neighbours are counted by their first autocorrelation rho: as n (1 - rho) / (1 + rho).
    """
    known = np.isfinite(value)
    t, v = time[known], value[known]
    if len(t) < LEAST_POINTS:
        return None
    middle = float(t.mean())
    slope, place = np.polyfit(t - middle, v, 1)
    rest = v - place - slope * (t - middle)
    square = float(np.sum(rest * rest))
    correlation = float(np.clip(np.sum(rest[1:] * rest[:-1]) / max(square, 1e-300), 0.0, 0.95))
    effective = max(3.0, len(t) * (1.0 - correlation) / (1.0 + correlation))
    variance = square / max(1.0, len(t) - 2) * len(t) / effective
    return Line(middle, float(place), float(slope), variance, float(np.sum((t - middle) ** 2)), len(t))


def forecast(time: FloatArray, value: FloatArray, tolerance: float, doubt: float = 0.0) -> Forecast | None:
    """Return when a value reaches ``tolerance`` from below, by a straight line through at least five points; None where it does not rise.

    The interval holds the line's slope and place at 95 % (Fieller's: where the line's own interval meets the tolerance). ``doubt`` is the
    standard deviation of what all values may be off by together, as a share of them: an error of the model, which no scatter shows.
    """
    line = line_through(time, value)
    if line is None or line.rises(0.05) <= 0.0:
        return None
    last = float(time[np.isfinite(value)][-1])
    at = line.middle + (tolerance - line.place) / line.slope
    if at < last:
        return Forecast(at, at, at)
    quantile = _student(0.975, line.count - 2.0)
    # Fieller: (goal - place - slope u)^2 = q^2 (variance (1/n + u^2/spread) + (doubt goal)^2), u = time - middle
    a = line.slope**2 - quantile**2 * line.variance / line.spread
    b = -2.0 * line.slope * (tolerance - line.place)
    c = (tolerance - line.place) ** 2 - quantile**2 * (line.variance / line.count + (doubt * tolerance) ** 2)
    root = b * b - 4.0 * a * c
    if a <= 0.0 or root < 0.0:
        return Forecast(at, last, float("inf"))
    low, high = sorted((-b + sign * np.sqrt(root)) / (2.0 * a) for sign in (-1.0, 1.0))
    return Forecast(at, float(max(last, line.middle + low)), float(line.middle + high))


def bend(time: FloatArray, value: FloatArray) -> float:
    """Return since when [s] a value goes on a slope, having been level before: least squares over the place of the bend."""
    best, at = np.inf, float(time[0])
    for begin in time[:-2]:
        rise = np.column_stack([np.ones_like(time), np.maximum(0.0, time - begin)])
        _, rest, *_ = np.linalg.lstsq(rise, value, rcond=None)
        square = float(rest[0]) if len(rest) else np.inf
        if square < best:
            best, at = square, float(begin)
    return at


def _student(share: float, freedom: float) -> float:
    from scipy.stats import t

    return float(t.ppf(share, max(1.0, freedom)))
