"""When a drift reaches a tolerance: a line whose slope wanders through what was seen, and the interval in which it may be."""

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


def forecast(time: FloatArray, value: FloatArray, tolerance: float, doubt: float = 0.0, bend: float = 0.0) -> Forecast | None:
    """Return when a value reaches ``tolerance`` from below, from at least five points; None where a line through them does not rise.

    The value is a line, a slope that wanders (an integrated Wiener process), and noise:

        v(t) = a + b t + w(t) + e,   cov(w(s), w(t)) = q (3 max(s, t) - min(s, t)) min(s, t)^2 / 6,   q = (share b)^2 / span

    Over the time seen (``span``) the slope wanders by a ``share`` of itself: 0, a half of ``bend``, or all of it, weighed by how likely
    each makes the points. The variance of the noise and the line are integrated out, so that each share foretells a Student distribution.
    The time is where the value is as likely above the tolerance as below, the interval from 2.5 to 97.5 %. ``doubt`` is the standard
    deviation of what all values may be off by together, as a share of them: an error of the model, which no scatter shows.

    Source: G. Wahba, Spline Models for Observational Data (1990), ch. 1; C. E. Rasmussen, C. K. I. Williams, Gaussian Processes for Machine
    Learning (2006), sec. 2.7.
    """
    line = line_through(time, value)
    if line is None or line.rises(0.05) <= 0.0:
        return None
    known = np.isfinite(value)
    seen, values = time[known] - time[known][0], value[known]
    last, span = float(seen[-1]), float(np.ptp(seen))
    straight = float(max(line.middle + (tolerance - line.place) / line.slope - time[known][0], last))
    ahead = np.concatenate([[last], last + np.geomspace(1e-3, 10.0, 400) * max(span, straight - last)])
    each, weights = _above(seen, values, ahead, tolerance, doubt, line, bend)
    likely = np.average(each, axis=0, weights=weights)
    at, low, high = (_first(ahead, likely, share) + float(time[known][0]) for share in (0.5, 0.025, 0.975))
    return Forecast(at if np.isfinite(at) else straight + float(time[known][0]), low, high)


def _above(
    seen: FloatArray, values: FloatArray, ahead: FloatArray, tolerance: float, doubt: float, line: Line, bend: float
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return the probability (shares, times) of a value above the tolerance for each share of the slope, and the weight of each."""
    from scipy.stats import t as student

    count = len(seen)
    noise = max(line.variance, (1e-6 * tolerance) ** 2)
    basis, further = np.column_stack([np.ones(count), seen]), np.column_stack([np.ones(len(ahead)), ahead])
    found, weights = [], []
    for share in (0.0, 0.5 * bend, bend):
        ratio = (share * line.slope) ** 2 / float(np.ptp(seen)) / noise
        root = np.linalg.cholesky(np.eye(count) + ratio * _wandering(seen, seen))
        white, aims = np.linalg.solve(root, basis), np.linalg.solve(root, values)
        normal = white.T @ white
        rest = aims - white @ np.linalg.solve(normal, white.T @ aims)
        square = max(float(rest @ rest), count * (1e-9 * tolerance) ** 2)
        weights.append(-np.log(np.diag(root)).sum() - 0.5 * np.linalg.slogdet(normal)[1] - 0.5 * (count - 2) * np.log(square))
        shared = np.linalg.solve(root, ratio * _wandering(seen, ahead))
        missed = further.T - white.T @ shared
        mean = further @ np.linalg.solve(normal, white.T @ aims) + shared.T @ rest
        own = ratio * _wandering(ahead, ahead, paired=True) - np.sum(shared**2, axis=0)
        variance = square / (count - 2) * (np.maximum(own, 0.0) + np.sum(missed * np.linalg.solve(normal, missed), axis=0))
        found.append(student.sf((tolerance - mean) / np.sqrt(variance + (doubt * tolerance) ** 2), count - 2))
    return np.array(found), np.exp(np.array(weights) - max(weights))


def _wandering(first: FloatArray, second: FloatArray, *, paired: bool = False) -> FloatArray:
    """Return the covariance of an integrated Wiener process between times (first, second), or of ``paired`` times alone."""
    one, other = (first, second) if paired else (first[:, None], second[None])
    least, most = np.minimum(one, other), np.maximum(one, other)
    return np.asarray(least**2 * (3.0 * most - least) / 6.0)


def _first(times: FloatArray, likely: FloatArray, share: float) -> float:
    """Return the first time at which a probability is a share or more; infinite where it never is."""
    above = np.flatnonzero(likely >= share)
    if not len(above):
        return float("inf")
    at = int(above[0])
    if at == 0:
        return float(times[0])
    return float(np.interp(share, likely[at - 1 : at + 1], times[at - 1 : at + 1]))


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
