"""A smooth curve through the samples of a path: cubic splines with not-a-knot ends, a new one after each retraction.

A spline clamped to zero slope at its ends would make the slope q'(s) vanish there, and a timing of it degenerate. That the axes stand at
the ends is said by the speed along the path, not by the shape.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from lathesim.motion.joint_path import FloatArray, MotionError

RETRACTION = np.deg2rad(150.0)
"""A turn of the path by more than this is a retraction: the axes stop there. A path sampled for cutting turns by a few degrees."""
_SAME = 1e-13
"""Samples nearer than this share of the whole path are one: their direction is rounding."""


@dataclass(frozen=True, eq=False)
class Curve:
    """Positions q(s) of the axes over a path parameter s: a cubic in each span.

    ``knots`` (spans + 1,); ``coefficients`` (4, spans, axes), the highest power first, in s - knots[span]; ``stops`` (pieces + 1,) are the
    numbers of the knots where the axes stand: both ends and every retraction.
    """

    knots: FloatArray
    coefficients: FloatArray
    stops: np.typing.NDArray[np.int64]
    start: FloatArray

    @property
    def length(self) -> float:
        """Return the largest value of the path parameter."""
        return float(self.knots[-1])

    def derivative(self, order: int, spans: np.typing.NDArray[np.int64], offsets: FloatArray) -> FloatArray:
        """Return the ``order``-th derivative by s at ``offsets`` behind the beginnings of ``spans``, (points, axes)."""
        if not len(self.knots) > 1:
            return np.repeat(self.start[None] if order == 0 else np.zeros((1, len(self.start))), len(offsets), axis=0)
        c3, c2, c1, c0 = (self.coefficients[power, spans] for power in range(4))
        h = offsets[:, None]
        if order == 0:
            return np.asarray(((c3 * h + c2) * h + c1) * h + c0)
        if order == 1:
            return np.asarray((3.0 * c3 * h + 2.0 * c2) * h + c1)
        return np.asarray(6.0 * c3 * h + 2.0 * c2 if order == 2 else 6.0 * c3)

    def at(self, s: FloatArray, order: int = 0) -> FloatArray:
        """Return the ``order``-th derivative by s at the values ``s``, (points, axes)."""
        spans = np.clip(np.searchsorted(self.knots, s, side="right") - 1, 0, max(0, len(self.knots) - 2))
        return self.derivative(order, spans, s - self.knots[spans])


def fit_curve(positions: FloatArray, scale: FloatArray, retraction: float = RETRACTION) -> Curve:
    """Return the curve through ``positions`` (samples, axes), with s the length in units of ``scale`` (axes,).

    With the largest velocities as ``scale`` s is about the time at full speed, so that metres and radians can be added. Repeated samples
    are one sample. ``retraction`` is the turn [rad] from which on the axes stop.
    """
    from scipy.interpolate import CubicSpline

    if len(scale) != positions.shape[1]:
        raise MotionError(f"{positions.shape[1]} axes have {len(scale)} limits.")
    points = _without_repeats(positions, scale)
    steps = np.diff(points / scale, axis=0)
    lengths = np.sqrt(np.sum(steps * steps, axis=1))
    knots = np.concatenate([[0.0], np.cumsum(lengths)])
    stops = _stops(steps, lengths, retraction)
    coefficients = np.empty((4, len(lengths), points.shape[1]))
    for begin, end in itertools.pairwise(stops):
        here = slice(begin, end + 1)
        if end - begin == 1:
            coefficients[:, begin] = 0.0
            coefficients[2, begin] = (points[end] - points[begin]) / lengths[begin]
            coefficients[3, begin] = points[begin]
        else:
            coefficients[:, begin:end] = CubicSpline(knots[here], points[here], bc_type="not-a-knot").c
    return Curve(knots, coefficients, stops, points[0])


def _without_repeats(positions: FloatArray, scale: FloatArray) -> FloatArray:
    steps = np.sqrt(np.sum((np.diff(positions, axis=0) / scale) ** 2, axis=1))
    least = _SAME * max(float(steps.sum()), float(np.abs(positions / scale).max(initial=0.0)) * 1e-2)
    keep = np.concatenate([[True], steps > least])
    return np.asarray(positions[keep])


def _stops(steps: FloatArray, lengths: FloatArray, retraction: float) -> np.typing.NDArray[np.int64]:
    """Return the numbers of the samples where the path turns back, with the first and the last."""
    if not len(lengths):
        return np.array([0])
    directions = steps / lengths[:, None]
    cosines = np.sum(directions[1:] * directions[:-1], axis=1)
    turns = np.flatnonzero(cosines < np.cos(retraction)) + 1
    return np.concatenate([[0], turns, [len(lengths)]]).astype(np.int64)
