"""Multipliers of linear delay equations with periodic coefficients, by collocation on Chebyshev points.

x'(t) = A(t) x(t) + B(t) x(t - tau) with the period tau. One period is cut into elements where A or B jump and such that none holds more
than a few vibrations; in each the solution is a polynomial through Chebyshev points that fulfils the equation there. The map from one
period to the next is a matrix, and the equation is stable where all its eigenvalues lie inside the unit circle.

Source: E. A. Butcher et al., J. Comput. Nonlinear Dyn. 4 (2009), Chebyshev collocation of periodic delay equations; L. N. Trefethen,
Spectral Methods in MATLAB (2000), differentiation matrix.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from lathesim.record import FloatArray

POINTS = 40
"""Points of an element. Spectral accuracy: 40 for four vibrations leave about 1e-10."""
VIBRATIONS = 4.0
"""Vibrations of an element at most."""


@dataclass(frozen=True)
class DelayEquation:
    """A(t) and B(t) as functions of time [s] to matrices, the period [s], its breaks [s], and the highest frequency in it [Hz]."""

    now: Callable[[float], FloatArray]
    before: Callable[[float], FloatArray]
    period: float
    breaks: tuple[float, ...] = ()
    frequency: float = 0.0


def multipliers(equation: DelayEquation, points: int = POINTS) -> np.ndarray[Any, np.dtype[np.complex128]]:
    """Return the multipliers of an equation, the largest first."""
    elements = _elements(equation)
    nodes, differentiation = _chebyshev(points)
    size = equation.now(0.0).shape[0]
    count = len(elements) * points
    present, former = np.zeros((count * size, count * size)), np.zeros((count * size, count * size))
    identity = np.eye(size)
    for number, (begin, end) in enumerate(elements):
        half = 0.5 * (end - begin)
        for row in range(points):
            time = begin + half * (nodes[row] + 1.0)
            at = (number * points + row) * size
            where = slice(at, at + size)
            inside = time if row < points else end
            shifted = inside - 1e-13 * equation.period if row == points - 1 else inside
            for column in range(points):
                place = (number * points + column) * size
                present[where, place : place + size] += differentiation[row, column] / half * identity
            present[where, where] -= equation.now(shifted)
            former[where, where] += equation.before(shifted)
            start = differentiation[row, points] / half * identity
            if number:
                place = (number * points - 1) * size
                present[where, place : place + size] += start
            else:
                place = (count - 1) * size
                former[where, place : place + size] -= start
    values = scipy.linalg.eigvals(scipy.linalg.solve(present, former))
    return np.asarray(values[np.argsort(-np.abs(values))])


def _elements(equation: DelayEquation) -> list[tuple[float, float]]:
    """Return the ends of the elements: breaks, and between them parts of at most so many vibrations."""
    edges = [0.0, *sorted(time for time in equation.breaks if 0.0 < time < equation.period), equation.period]
    found = []
    for begin, end in itertools.pairwise(edges):
        parts = max(1, math.ceil((end - begin) * equation.frequency / VIBRATIONS))
        steps = np.linspace(begin, end, parts + 1)
        found += list(zip(steps[:-1].tolist(), steps[1:].tolist(), strict=True))
    return found


def _chebyshev(points: int) -> tuple[FloatArray, FloatArray]:
    """Return the Chebyshev points behind -1 in rising order, (points,), and the differentiation matrix (points, points + 1), -1 in the last
    column."""
    angles = np.pi * np.arange(points + 1) / points
    x = np.cos(angles)
    weight = np.ones(points + 1)
    weight[[0, -1]] = 2.0
    weight *= (-1.0) ** np.arange(points + 1)
    difference = x[:, None] - x[None, :]
    matrix = np.outer(weight, 1.0 / weight) / (difference + np.eye(points + 1))
    matrix -= np.diag(matrix.sum(axis=1))
    order = np.argsort(x)[1:]
    columns = np.append(order, points)
    return x[order], matrix[np.ix_(order, columns)]


def smallest_unstable(
    equation_of: Callable[[float], DelayEquation], guess: float, *, largest: float = math.inf, growth: float = 1.15
) -> tuple[float, complex]:
    """Return the smallest parameter at which a multiplier leaves the unit circle, and that multiplier; infinity where none does so.

    ``guess`` is a parameter that is stable; it is raised by ``growth`` until it is not, at most to ``largest``, and the limit is bisected.
    """

    def radius(value: float) -> tuple[float, complex]:
        first = complex(multipliers(equation_of(value))[0])
        return abs(first), first

    low = guess
    while radius(low)[0] > 1.0:
        low *= 0.5
        if low < 1e-12 * guess:
            return 0.0, radius(low)[1]
    high = low
    while radius(high)[0] <= 1.0:
        low, high = high, high * growth
        if high > largest:
            return math.inf, 0j
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if radius(middle)[0] <= 1.0 else (low, middle)
        if high - low < 1e-9 * high:
            break
    return 0.5 * (low + high), radius(high)[1]


def kind_of(multiplier: complex) -> str:
    """Return how stability is lost: "flip" where the multiplier is near -1, else "Hopf"."""
    return "flip" if abs(multiplier.imag) < 1e-3 * abs(multiplier) and multiplier.real < 0.0 else "Hopf"
