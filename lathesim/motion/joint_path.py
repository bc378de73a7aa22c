"""A path of the axes as samples without times, and the smooth curve through them.

A smooth curve through the samples of a path: cubic splines with not-a-knot ends, a new one after each retraction.

A spline clamped to zero slope at its ends would make the slope q'(s) vanish there, and a timing of it degenerate. That the axes stand at
the ends is said by the speed along the path, not by the shape.
"""

from __future__ import annotations

import csv
import itertools
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from lathesim.errors import LatheSimError
from lathesim.units import si_factor

FloatArray = npt.NDArray[np.float64]

_HEADER = re.compile(r"^\s*([^\[\]]+?)\s*\[([^\[\]]*)\]\s*$")
_DIRECTIONS = ("i", "j", "k")
"""Columns of a tool's direction, which need no unit."""
MOST_SAMPLES = 5_000_000
"""Rows of a file at most; 1.5 h of samples at 1 kHz."""


class MotionError(LatheSimError):
    """A path, its limits or its kinematics cannot be used."""


@dataclass(frozen=True, eq=False)
class JointPath:
    """Samples along a path: ``positions`` (samples, axes) in SI, ``names`` and ``units`` of the axes; no times yet.

    Raises :class:`MotionError` where shapes differ or a number is not finite.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    positions: FloatArray

    def __post_init__(self) -> None:
        positions = np.ascontiguousarray(self.positions, dtype=np.float64)
        object.__setattr__(self, "positions", positions)
        if positions.ndim != 2 or positions.shape[1] != len(self.names) or len(self.names) != len(self.units):
            raise MotionError(f"{len(self.names)} axes have positions of shape {positions.shape}.", remedy="Give one column an axis.")
        if not len(positions) or not len(self.names):
            raise MotionError("the path has no samples.", remedy="Give at least one row.")
        if not np.isfinite(positions).all():
            row, column = (int(place[0]) for place in np.nonzero(~np.isfinite(positions)))
            raise MotionError(f"sample {row + 1} of {self.names[column]} is not a finite number.", remedy="Take the row away.")


def read_joint_path(path: str | Path) -> JointPath:
    """Return the path of a CSV file with the header ``x [mm],y [mm],a [deg]`` and a row for each sample, in SI.

    A column of times, as exported records have one, is left out: the path gets new ones.

    Raises :class:`MotionError` with ``file:line`` where the header has no units or a cell is no number.
    """
    place = Path(path)
    try:
        with place.open(encoding="utf-8-sig", newline="") as file:
            rows = csv.reader(file)
            header = next(rows, [])
            timed = [at for at, cell in enumerate(header) if _is_time(cell)]
            names, units, factors = _columns([cell for at, cell in enumerate(header) if at not in timed], f"{place}:1")
            values = np.delete(np.array(_numbers(rows, len(header), place)).reshape(-1, len(header)), timed, axis=1)
    except FileNotFoundError:
        raise MotionError("there is no such file.", place=str(place)) from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise MotionError(f"the file cannot be read: {getattr(error, 'strerror', None) or error}.", place=str(place)) from None
    if not len(values):
        raise MotionError("the file has a header and no samples.", place=str(place), remedy="Write one row a sample.")
    return JointPath(names, units, values * factors)


def _is_time(cell: str) -> bool:
    found = _HEADER.match(cell)
    return found is not None and found[2] in ("s", "ms")


def _columns(header: list[str], place: str) -> tuple[tuple[str, ...], tuple[str, ...], FloatArray]:
    found = [_HEADER.match(cell if cell.strip() not in _DIRECTIONS else f"{cell} [1]") for cell in header]
    if not header or not all(found):
        told = next((cell for cell, match in zip(header, found, strict=True) if not match), "")
        raise MotionError(f"the column '{told}' has no unit.", place=place, remedy="Write the header as x [mm],y [mm],a [deg].")
    names = tuple(match[1] for match in found if match)
    if len(set(names)) != len(names):
        raise MotionError("two columns have the same name.", place=place, remedy="Name each axis once.")
    factors = [si_factor(match[2]) for match in found if match]
    return names, tuple(_si_name(dimension, place) for _, dimension in factors), np.array([factor for factor, _ in factors])


def _si_name(dimension: str, place: str) -> str:
    if dimension in ("[length]", "dimensionless"):
        return "m" if dimension == "[length]" else "rad"
    raise MotionError(f"an axis is given in a unit of {dimension}.", place=place, remedy="Give lengths (mm) and angles (deg).")


def _numbers(rows: Iterable[list[str]], width: int, place: Path) -> list[list[float]]:
    values: list[list[float]] = []
    for number, row in enumerate(rows, start=2):
        if not row:
            continue
        if len(row) != width:
            raise MotionError(f"the row has {len(row)} cells and the header {width}.", place=f"{place}:{number}")
        try:
            values.append([float(cell) for cell in row])
        except ValueError:
            raise MotionError("a cell is not a number.", place=f"{place}:{number}", remedy="Write numbers with a point.") from None
        if not all(map(math.isfinite, values[-1])):
            raise MotionError("a cell is not a finite number.", place=f"{place}:{number}", remedy="Take the row away.")
        if len(values) > MOST_SAMPLES:
            raise MotionError(f"the file has more than {MOST_SAMPLES} samples.", place=str(place), remedy="Split it.")
    return values


RETRACTION = np.deg2rad(150.0)
"""A turn of the path by more than this is a retraction: the axes stop there. A path sampled for cutting turns by a few degrees."""
_SAME = 1e-13
"""Samples nearer than this share of the whole path are one: their direction is rounding."""


@dataclass(frozen=True, eq=False)
class PathCurve:
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


def fit_curve(positions: FloatArray, scale: FloatArray, retraction: float = RETRACTION) -> PathCurve:
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
    return PathCurve(knots, coefficients, stops, points[0])


def _without_repeats(positions: FloatArray, scale: FloatArray) -> FloatArray:
    steps = np.sqrt(np.sum((np.diff(positions, axis=0) / scale) ** 2, axis=1))
    least = _SAME * max(float(steps.sum()), float(np.abs(positions / scale).max(initial=0.0)) * 1e-2)
    return np.asarray(positions[np.concatenate([[True], steps > least])])


def _stops(steps: FloatArray, lengths: FloatArray, retraction: float) -> np.typing.NDArray[np.int64]:
    """Return the numbers of the samples where the path turns back, with the first and the last."""
    if not len(lengths):
        return np.array([0])
    directions = steps / lengths[:, None]
    turns = np.flatnonzero(np.sum(directions[1:] * directions[:-1], axis=1) < np.cos(retraction)) + 1
    return np.concatenate([[0], turns, [len(lengths)]]).astype(np.int64)
