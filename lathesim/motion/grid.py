"""The grid along a curve on which a timing is computed, and what the limits of the axes mean there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lathesim.motion.axis_limits import AxisLimits
from lathesim.motion.joint_path import FloatArray, PathCurve

_LEAST_OF_A_PIECE = 8
"""Segments from one stop to the next at least: with one the axes would have no room to move."""
_PASSED = 1.0002
"""Share of a limit from which on a segment is halved; what is left is taken off by slowing the whole."""
_BETWEEN = np.array([0.2, 0.4, 0.6, 0.8])
_EVERYWHERE = np.linspace(0.0, 1.0, 21)
"""Shares of a segment at which the limits are held at last."""

_CLOSELY = np.linspace(0.0, 1.0, 201)
"""Shares of the segments that come nearest to their limits, at which they are looked at again."""
_MOST_NEAR = 16
"""How many segments those are."""

Segments = slice | np.typing.NDArray[np.int64]
"""Which segments are meant."""
_ALL = slice(None)

ToolSpeed = Callable[[FloatArray, FloatArray], FloatArray]
"""Positions and their derivative by s, (points, axes), to the distance of the tool tip per s, (points,)."""
Slower = Callable[[FloatArray], FloatArray]
"""Values of s to the share (0, 1] of the speed that is allowed there."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Nodes ``s`` along a curve; ``span`` is the span of the curve that holds each segment, ``rest`` the nodes where the axes stand."""

    curve: PathCurve
    s: FloatArray
    span: np.typing.NDArray[np.int64]
    rest: np.typing.NDArray[np.int64]

    def slopes(self, order: int, share: float | FloatArray, of: Segments = _ALL) -> FloatArray:
        """Return a derivative of q at a share of each segment, or of some, one share for each of these, (segments, axes)."""
        inside = (1.0 - share) * self.s[:-1][of] + share * self.s[1:][of] - self.curve.knots[self.span[of]]
        return self.curve.derivative(order, self.span[of], inside)

    def caps(self, limits: AxisLimits, tool_speed: ToolSpeed | None, slower: Slower | None) -> FloatArray:
        """Return the largest b = (ds/dt)^2 at each node that velocities and feed allow."""
        cap = np.full(len(self.s), np.inf)
        for share, nodes in ((0.0, slice(None, -1)), (1.0, slice(1, None))):
            slope = self.slopes(1, share)
            with np.errstate(divide="ignore"):
                bound = 1.0 / np.max(np.abs(slope) / limits.velocity, axis=1) ** 2
                if tool_speed is not None and np.isfinite(limits.feed):
                    bound = np.minimum(bound, (limits.feed / tool_speed(self.slopes(0, share), slope)) ** 2)
            cap[nodes] = np.minimum(cap[nodes], bound)
        if slower is not None:
            cap *= np.clip(slower(self.s), 1e-6, 1.0) ** 2
        # where no axis moves for a moment (a cusp) no velocity bounds the path speed; a thousand times its length in a second is enough
        cap = np.minimum(cap, 1e6 * max(1.0, self.curve.length**2))
        cap[self.rest] = 0.0
        return np.asarray(cap)

    def quickest(
        self, limits: AxisLimits, tool_speed: ToolSpeed | None, slower: Slower | None, also: FloatArray | None = None
    ) -> FloatArray:
        """Return b at the nodes; ``also`` (nodes,) bounds it further."""
        from lathesim.motion.passes import quickest

        cap = self.caps(limits, tool_speed, slower)
        if also is not None:
            cap = np.minimum(cap, also)
        parts = [np.ascontiguousarray(self.slopes(order, share) / limits.acceleration) for share in (0.0, 1.0) for order in (1, 2)]
        b: FloatArray = quickest(np.diff(self.s), *parts, cap)
        return b

    def ratios(self, b: FloatArray, limits: AxisLimits, share: float | FloatArray, of: Segments = _ALL) -> FloatArray:
        """Return by how much to slow down at a share of each segment, or of some, for both limits: max(|v|/v, sqrt(|a|/a))."""
        here = (1.0 - share) * b[:-1][of] + share * b[1:][of]
        acceleration = np.diff(b)[of] / (2.0 * np.diff(self.s)[of])
        q1, q2 = self.slopes(1, share, of), self.slopes(2, share, of)
        speed = np.max(np.abs(q1) / limits.velocity, axis=1) * np.sqrt(here)
        force = np.max(np.abs(q1 * acceleration[:, None] + q2 * here[:, None]) / limits.acceleration, axis=1)
        larger: FloatArray = np.maximum(speed, np.sqrt(force))
        return larger

    def passed(self, b: FloatArray, limits: AxisLimits) -> np.typing.NDArray[np.bool_]:
        """Return which segments pass a limit between their ends."""
        return np.asarray(np.max([self.ratios(b, limits, share) for share in _BETWEEN], axis=0) > np.sqrt(_PASSED))

    def largest_ratio(self, b: FloatArray, limits: AxisLimits) -> float:
        """Return by how much the whole has to be slowed so that the limits hold at and between the nodes.

        The segments with the largest ratios are looked at more closely: a bend of the spline may lie within one.
        """
        largest = np.max([self.ratios(b, limits, share) for share in _EVERYWHERE], axis=0)
        top = float(largest.max())
        near = np.argsort(largest)[-_MOST_NEAR:]
        return max(top, float(self.ratios(b, limits, np.tile(_CLOSELY, len(near)), np.repeat(near, len(_CLOSELY))).max()))

    def halved(self, which: np.typing.NDArray[np.bool_]) -> Grid:
        """Return the grid with some segments cut in two."""
        middles = 0.5 * (self.s[:-1] + self.s[1:])[which]
        at = np.flatnonzero(which) + 1
        shift = np.cumsum(np.concatenate([[0], which.astype(np.int64)]))
        return Grid(self.curve, np.insert(self.s, at, middles), np.repeat(self.span, 1 + which), self.rest + shift[self.rest])


def first_grid(curve: PathCurve, least: int) -> Grid:
    """Return a grid with every knot of the curve, at least ``least`` segments in all and a few from stop to stop."""
    spans = len(curve.knots) - 1
    in_piece = np.repeat(np.diff(curve.stops), np.diff(curve.stops))
    parts = np.maximum(-(-least // spans), -(-_LEAST_OF_A_PIECE // in_piece)).astype(np.int64)
    parts += parts % 2 * (parts > 1)
    span = np.repeat(np.arange(spans), parts)
    within = np.arange(len(span)) - np.repeat(np.concatenate([[0], np.cumsum(parts)[:-1]]), parts)
    s = np.append(curve.knots[span] + np.diff(curve.knots)[span] * within / parts[span], curve.knots[-1])
    return Grid(curve, s, span, np.concatenate([[0], np.cumsum(parts)])[curve.stops])


def pieces(grid: Grid) -> list[Grid]:
    """Return the grids from one stop to the next."""
    stops = list(zip(grid.rest[:-1], grid.rest[1:], strict=True))
    return [Grid(grid.curve, grid.s[i : j + 1], grid.span[i:j], np.array([0, j - i])) for i, j in stops]
