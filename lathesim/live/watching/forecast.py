"""When a drift reaches a tolerance: a straight line through what was seen, and the interval in which it may be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.record import FloatArray


@dataclass(frozen=True)
class Forecast:
    """When a tolerance is reached: ``time`` [s] and its 95 % interval ``low`` to ``high``, which may be infinite."""

    time: float
    low: float
    high: float


def forecast(time: FloatArray, value: FloatArray, tolerance: float) -> Forecast | None:
    """Return when |value| reaches ``tolerance``, by a straight line through at least five points; None where it does not go there.

    The interval holds the line's slope and place at 95 % (Fieller's: where the line's own interval meets the tolerance), with points that
    depend on their neighbours counted by their first autocorrelation.
    """
    known = np.isfinite(value)
    t, v = time[known], value[known]
    if len(t) < 5:
        return None
    middle = t.mean()
    slope, place = np.polyfit(t - middle, v, 1)
    rest = v - place - slope * (t - middle)
    spread = float(np.sum((t - middle) ** 2))
    correlation = float(np.clip(np.sum(rest[1:] * rest[:-1]) / max(np.sum(rest * rest), 1e-300), 0.0, 0.95))
    effective = max(3.0, len(t) * (1.0 - correlation) / (1.0 + correlation))
    variance = float(np.sum(rest * rest)) / max(1.0, len(t) - 2) * len(t) / effective
    if abs(slope) <= 2.0 * np.sqrt(variance / spread):
        return None
    goal = np.copysign(tolerance, slope)
    at = middle + (goal - place) / slope
    if at < t[-1]:
        return Forecast(float(at), float(at), float(at)) if abs(place + slope * (t[-1] - middle)) >= tolerance else None
    quantile = _student(effective - 2.0)
    # Fieller: (goal - place - slope u)^2 = q^2 variance (1/n + u^2/spread), u = time - middle
    a = slope**2 - quantile**2 * variance / spread
    b = -2.0 * slope * (goal - place)
    c = (goal - place) ** 2 - quantile**2 * variance / len(t)
    root = b * b - 4.0 * a * c
    if a <= 0.0 or root < 0.0:
        return Forecast(float(at), float(t[-1]), float("inf"))
    low, high = sorted((-b + sign * np.sqrt(root)) / (2.0 * a) for sign in (-1.0, 1.0))
    return Forecast(float(at), float(max(t[-1], middle + low)), float(middle + high))


def _student(freedom: float) -> float:
    from scipy.stats import t

    return float(t.ppf(0.975, max(1.0, freedom)))
