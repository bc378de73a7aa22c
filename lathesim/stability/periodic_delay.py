"""Multipliers of linear delay equations with periodic coefficients, by collocation on Chebyshev points.

x'(t) = A(t) x(t) + B(t) x(t - tau) with the period tau. One period is cut into elements where A or B jump and such that none holds more
than a few vibrations; in each the solution is a polynomial through Chebyshev points that fulfils the equation there. The equation is
stable where all eigenvalues of the map from one period to the next lie inside the unit circle.

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

from lathesim.errors import LessonError
from lathesim.record import FloatArray
from lathesim.stability.stability_thresholds import MAP
from lathesim.stability.tool_point import Complex, Mode, ToolPoint

POINTS = 40
"""Points of an element. Spectral accuracy: 40 for four vibrations leave about 1e-10."""
_LOOK_POINTS = 22
"""Points with which a limit is looked for before it is found with all."""
VIBRATIONS = 4.0
"""Vibrations of an element at most."""
_NONE, _EXACT, _ZERO = 1e-12, 1e-10, 1e-11
"""Shares of a width: so narrow is no cut, and so near the limit is on it; a rate of growth so small is none."""
_DENSE = 300
"""Columns up to which all eigenvalues are found."""
_LARGEST, _BASIS = 8, 80
"""Eigenvalues to find of a large map, and vectors of the Arnoldi basis (assumed: several multipliers are nearly as large as the
largest)."""


@dataclass(frozen=True)
class DelayEquation:
    """A(t) and B(t) as functions of time [s] to matrices, the period [s], its breaks [s], and the highest frequency in it [Hz]."""

    now: Callable[[float], FloatArray]
    before: Callable[[float], FloatArray]
    period: float
    breaks: tuple[float, ...] = ()
    frequency: float = 0.0


def multipliers(equation: DelayEquation, points: int = POINTS) -> Complex:
    """Return the multipliers of an equation, largest first; for a large equation only the largest few."""
    values = _PeriodMap(equation, points).values()
    return np.asarray(values[np.argsort(-np.abs(values))])


def chatter_frequency(equation: DelayEquation, multiplier: complex) -> float:
    """Return the frequency [Hz] of the strongest vibration that goes with a multiplier.

    x(t) exp(-lambda t) repeats each period, so the vibration has the frequencies (arg(multiplier) + 2 pi k)/(2 pi tau); the strongest is
    found by the Fourier integrals of the vibration over one period, with the weights of Clenshaw and Curtis.
    """
    way = _PeriodMap(equation, POINTS)
    values, vectors = way.eigen()
    times = way.times
    place = int(np.argmin(np.abs(values - multiplier) + 1e3 * (np.abs(values) < 0.5 * abs(multiplier))))
    positions = vectors[:, place].reshape(-1, equation.now(0.0).shape[0])[:, 0::2]
    period = equation.period
    rate = np.log(values[place]) / period
    weights = _weights(equation, POINTS)
    highest = max(4, math.ceil(3.0 * max(equation.frequency, 1.0 / period) * period))
    best, found = -1.0, 0.0
    for k in range(-highest, highest + 1):
        wave = np.exp(-(rate + 2j * np.pi * k / period) * times) * weights
        strength = float((np.abs(wave @ positions) ** 2).sum())
        if strength > best:
            best, found = strength, abs(rate.imag / (2.0 * np.pi) + k / period)
    return float(found)


def _weights(equation: DelayEquation, points: int) -> FloatArray:
    """Return the weights of the integral over a period at the points of all elements; the point at the left end of each is left out."""
    nodes = np.cos(np.pi * np.arange(points + 1) / points)
    order = np.argsort(nodes)
    degrees = np.arange(points + 1)
    integrals = np.where(degrees % 2 == 0, 2.0 / (1.0 - np.minimum(degrees, 10**9).astype(float) ** 2 + (degrees == 1)), 0.0)
    weights = np.linalg.solve(np.polynomial.chebyshev.chebvander(nodes[order], points).T, integrals)[1:]
    return np.concatenate([0.5 * (end - begin) * weights for begin, end in _elements(equation)])


class _PeriodMap:
    """The map of the values at the points of one period to those of the next, element by element.

    An element has the values v at its points, the value u at its left end, and the values w of the previous period:  P v = B w - d u.  Its
    part of the map is v = T w + S u, and u is the last value of the previous element. No matrix of the whole period is built.
    """

    def __init__(self, equation: DelayEquation, points: int) -> None:
        elements = _elements(equation)
        nodes, differentiation = _chebyshev(points)
        self.size = size = equation.now(0.0).shape[0]
        self.block = block = points * size
        inner = np.kron(differentiation[:, :points], np.eye(size))
        start = np.kron(differentiation[:, points:], np.eye(size))
        self.through, self.onward = np.empty((len(elements), block, block)), np.empty((len(elements), block, size))
        times = []
        for number, (begin, end) in enumerate(elements):
            half = 0.5 * (end - begin)
            present, former = inner / half, np.zeros((block, block))
            for row in range(points):
                time = begin + half * (nodes[row] + 1.0)
                at = slice(row * size, (row + 1) * size)
                inside = time - 1e-13 * equation.period if row == points - 1 else time
                present[at, at] -= equation.now(inside)
                former[at, at] = equation.before(inside)
                times.append(time)
            solved = scipy.linalg.solve(present, np.concatenate([former, -start / half], axis=1))
            self.through[number], self.onward[number] = solved[:, :block], solved[:, block:]
        self.times = np.array(times)
        # the values of the previous period that count: the columns that T reads, and the last value, with which the first element begins
        counts = np.asarray(self.through.any(axis=1))
        counts[-1, -size:] = True
        self.counts = np.flatnonzero(counts.ravel())

    def __call__(self, before: Any) -> Any:
        """Return the values of a period from those of the previous period, (values,) or (values, columns)."""
        columns = before.reshape(len(before), -1)
        after = self.through @ columns.reshape(len(self.through), self.block, -1)
        end = columns[-self.size :]
        for number in range(len(after)):
            after[number] += self.onward[number] @ end
            end = after[number, -self.size :]
        return after.reshape(before.shape)

    def values(self) -> Complex:
        """Return the eigenvalues: all of a small map, the largest few of a large one."""
        found = self._largest()
        return np.asarray(scipy.linalg.eigvals(self._dense()) if found is None else found[0])

    def eigen(self) -> tuple[Complex, Complex]:
        """Return the same eigenvalues with their eigenvectors (values of a period, eigenvalues)."""
        values, some = self._largest() or scipy.linalg.eig(self._dense())
        vectors = np.zeros((len(self.through) * self.block, len(values)), dtype=np.complex128)
        vectors[self.counts] = some
        return np.asarray(values), self(vectors)

    def _dense(self) -> FloatArray:
        """Return the map of the values that count. All other columns are zero, so leaving them out changes no eigenvalue other than 0."""
        columns = np.zeros((len(self.through) * self.block, len(self.counts)))
        columns[self.counts, np.arange(len(self.counts))] = 1.0
        return np.asarray(self(columns)[self.counts])

    def _largest(self) -> tuple[Complex, Complex] | None:
        """Return the largest eigenvalues of a large map by the Arnoldi method, or none for a small map or without convergence."""
        from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs

        count = len(self.counts)
        if count <= _DENSE:
            return None
        whole = np.zeros(len(self.through) * self.block)

        def apply(values: Any) -> Any:
            whole[self.counts] = values.reshape(-1)
            return self(whole)[self.counts]

        begin = np.cos(np.arange(count))
        try:
            found = eigs(LinearOperator((count, count), apply, dtype=np.float64), k=_LARGEST, ncv=_BASIS, v0=begin, tol=1e-13, maxiter=2000)
        except ArpackNoConvergence:
            return None
        return np.asarray(found[0]), np.asarray(found[1])


def _elements(equation: DelayEquation) -> list[tuple[float, float]]:
    """Return the ends of the elements: breaks, and between them parts of at most so many vibrations."""
    edges = [0.0, *sorted(time for time in equation.breaks if 0.0 < time < equation.period), equation.period]
    found = []
    for begin, end in itertools.pairwise(edges):
        steps = np.linspace(begin, end, max(1, math.ceil((end - begin) * equation.frequency / VIBRATIONS)) + 1)
        found += list(zip(steps[:-1].tolist(), steps[1:].tolist(), strict=True))
    return found


def _chebyshev(points: int) -> tuple[FloatArray, FloatArray]:
    """Return the rising Chebyshev points behind -1, (points,), and the differentiation matrix (points, points + 1), -1 last."""
    x = np.cos(np.pi * np.arange(points + 1) / points)
    weight = np.ones(points + 1)
    weight[[0, -1]] = 2.0
    weight *= (-1.0) ** np.arange(points + 1)
    difference = x[:, None] - x[None, :]
    matrix = np.outer(weight, 1.0 / weight) / (difference + np.eye(points + 1))
    matrix -= np.diag(matrix.sum(axis=1))
    order = np.argsort(x)[1:]
    return x[order], matrix[np.ix_(order, np.append(order, points))]


_GROWTH = 1.15
"""Ratio of one parameter looked at to the one before, assumed: a limit is soon between two of them."""


def smallest_unstable(equation_of: Callable[[float], DelayEquation], guess: float, *, largest: float = math.inf) -> tuple[float, complex]:
    """Return the smallest parameter at which a multiplier leaves the unit circle, and that multiplier; infinity where none does so.

    ``guess`` is a parameter that is stable; it is raised by ``_GROWTH`` until it is not, at most to ``largest``, and the limit is bisected.
    """

    def rate(value: float, points: int = POINTS) -> tuple[float, complex]:
        first = complex(multipliers(equation_of(value), points)[0])
        return math.log(max(abs(first), 1e-300)), first

    low = guess
    while rate(low)[0] > 0.0:
        low *= 0.5
        if low < _NONE * guess:
            return 0.0, rate(low)[1]
    high = low * _GROWTH
    while rate(high, _LOOK_POINTS)[0] <= 0.0:
        low, high = high, high * _GROWTH
        if high > largest:
            return math.inf, 0j
    return _between(rate, low, high)


def _between(rate: Callable[[float], tuple[float, complex]], low: float, high: float) -> tuple[float, complex]:
    """Return where the rate changes its sign between two values that were seen with fewer points, by false position (Illinois)."""
    (below, at_low), (above, at_high) = rate(low), rate(high)
    while below > 0.0:
        high, above, at_high = low, below, at_low
        low /= _GROWTH
        below, at_low = rate(low)
    while above <= 0.0:
        low, below, at_low = high, above, at_high
        high *= _GROWTH
        above, at_high = rate(high)
    side = 0
    left, right = below, above
    for _ in range(60):
        if high - low < _EXACT * high:
            break
        part = min(max(-left / (right - left), 1e-6), 1.0 - 1e-6) if right > left else 0.5
        middle = low + part * (high - low)
        found, multiplier = rate(middle)
        if found > 0.0:
            high, right, at_high = middle, found, multiplier
            left *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            low, left = middle, found
            right *= 0.5 if side == -1 else 1.0
            side = -1
        if abs(found) < _ZERO:
            return middle, multiplier
    return 0.5 * (low + high), at_high


def kind_of(multiplier: complex) -> str:
    """Return how stability is lost: "flip" where the multiplier is near -1, else "Hopf"."""
    return "flip" if abs(multiplier.imag) < MAP.flip * abs(multiplier) and multiplier.real < 0.0 else "Hopf"


def turning(
    tool: ToolPoint,
    stiffness: float,
    width: float,
    speed: float,
    *,
    process_damping: float = 0.0,
    diameter: float = 0.0,
    share: float = 1.0,
) -> DelayEquation:
    """Return the equation of a turning cut of chip width b [m] at a speed [rpm], Ks [N/m^2].

    With q_i the modes and x = sum q_i the motion along the normal:

        m_i q_i'' + c_i q_i' + k_i q_i = b (mu_i Ks (x(t - tau) - x) - cos^2(alpha_i) C x'/V)

    ``share`` is the part of each turn in which a slotted bar is in the cut; ``process_damping`` C [N/m] acts at ``diameter`` [m].
    """
    if not 0.0 < share <= 1.0:
        raise LessonError(f"the share of a turn in the cut is {share:g}.", remedy="Give one above 0 and at most 1.")
    if not speed > 0.0:
        raise LessonError(f"the speed is {speed:g} rpm.", remedy="Give one above 0.")
    delay, count = 60.0 / speed, len(tool.modes)
    drag = width * process_damping / (math.pi * diameter * speed / 60.0) if process_damping > 0.0 else 0.0
    free = np.zeros((2 * count, 2 * count))
    push, rub = np.zeros((2 * count, 2 * count)), np.zeros((2 * count, 2 * count))
    for place, (mode, factor, along) in enumerate(zip(tool.modes, tool.factors, tool.normal_factors, strict=True)):
        free[2 * place, 2 * place + 1] = 1.0
        free[2 * place + 1, 2 * place] = -mode.stiffness / mode.mass
        free[2 * place + 1, 2 * place + 1] = -mode.viscous / mode.mass
        push[2 * place + 1, 0::2] = factor * stiffness * width / mode.mass
        rub[2 * place + 1, 1::2] = along * drag / mode.mass
    inside = share * delay
    return DelayEquation(
        now=lambda time: free - push - rub if time < inside or share == 1.0 else free,
        before=lambda time: push if time < inside or share == 1.0 else np.zeros_like(push),
        period=delay,
        breaks=(inside,) if share < 1.0 else (),
        frequency=max(mode.frequency for mode in tool.modes),
    )


def milling(
    mode: Mode, tangential: float, normal: float, width: float, speed: float, *, teeth: int, entry: float, leave: float
) -> DelayEquation:
    """Return the equation of milling with straight teeth, one mode along the feed: in the cut from ``entry`` to ``leave`` [rad].

    m x'' + c x' + k x = -w h(t) (x - x(t - tau)),  h = sum over teeth in the cut of sin(phi) (Kt cos(phi) + Kn sin(phi)),  tau the time
    of a tooth.
    Source: T. Insperger, G. Stepan, Semi-Discretization for Time-Delay Systems (2011), milling with one degree of freedom.
    """
    delay = 60.0 / (speed * teeth)
    turn = 2.0 * math.pi * speed / 60.0
    pitch = 2.0 * math.pi / teeth

    def directional(time: float) -> float:
        total = 0.0
        for tooth in range(teeth):
            angle = (turn * time + tooth * pitch) % (2.0 * math.pi)
            if entry <= angle < leave:
                total += math.sin(angle) * (tangential * math.cos(angle) + normal * math.sin(angle))
        return total

    def matrix(value: float) -> FloatArray:
        return np.array([[0.0, 0.0], [value / mode.mass, 0.0]])

    free = np.array([[0.0, 1.0], [-mode.stiffness / mode.mass, -mode.viscous / mode.mass]])
    breaks = tuple(sorted({round((angle % pitch) / turn, 15) for angle in (entry, leave)}))
    now: Callable[[float], FloatArray] = lambda time: free - matrix(width * directional(time))  # noqa: E731
    return DelayEquation(now, lambda time: matrix(width * directional(time)), delay, breaks, mode.frequency)
