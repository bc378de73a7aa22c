"""The one descent by least squares: free values that make a whitened residual least, within bounds, with uncertainties as penalties.

    minimise  |W r(p)|^2  +  sum_i ((p_i - given_i) / uncertainty_i)^2

``residual`` takes many rows of values at once. The start and all changed values of a Jacobian are one call, and so are steps of several
dampings: what computes runs side by side computes them in one pass. So are the rows of several descents, see :func:`side_by_side`. A
Jacobian is kept as long as steps gain as much as it predicts: most machines are nearly linear in most of their values, and a step costs one
run then. On request it is corrected by what a step changed that gained half of that. Where no step gets better along slopes of small
changes, as in a cost of many small valleys, larger ones are made. Within bounds the step is the best one that keeps them.
Source: Ljung, System Identification, 2nd ed., section 10.2 (damped Gauss-Newton); Nocedal, Wright, Numerical Optimization, 2nd ed.,
section 10.3 (Levenberg-Marquardt); Broyden, A class of methods for solving nonlinear simultaneous equations, Mathematics of Computation 19
(1965), eq. (4.5) (corrected slopes); Kelley, Implicit Filtering, 2011, chapter 3 (slopes of larger changes). Left out: second derivatives
of the residual.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from lathesim.engine.assembly import FloatArray
from lathesim.identification.records import Free
from lathesim.identification.signal import LARGER_PART, ROUNDING

STEP = 3e-3
"""Change by which a slope is taken, as a share of the scale of a value."""
_DAMPINGS = np.array([0.03, 3.0, 30.0, 1e3, 3e4, 1e6])
"""Factors on the last damping: the first two are tried before the stronger ones."""
_LEAST_GAIN = 0.05
"""Gain in cost, where the residual is in standard deviations, under which a step is not worth its run."""

_AS_PREDICTED = 0.1
"""Slopes are kept after a step whose gain differs by less than this share from the predicted one."""

Residual = Callable[[FloatArray], Sequence[FloatArray]]
"""From rows of values, shape (rows, values) [SI], to the residual of each, all of one shape."""
Steps = Callable[[FloatArray, int], FloatArray]
"""From values (values,) and how many Jacobians were taken before to the changes (values,) by which slopes are taken."""

Result = TypeVar("Result")
Asking = Generator[FloatArray, Sequence[FloatArray], Result]
"""What gives rows of values, shape (rows, values) [SI], and goes on with the residual of each until it has its result."""


def side_by_side(some: Sequence[Asking[Result]], residuals: Callable[[list[int], list[FloatArray]], Sequence[FloatArray]]) -> list[Result]:
    """Return the result of each; ``residuals`` answers the rows that those at some places (one list) give at one time (the other)."""
    found: dict[int, Result] = {}
    answers: dict[int, Sequence[FloatArray] | None] = dict.fromkeys(range(len(some)))
    while answers:
        rows: dict[int, FloatArray] = {}
        for place, answer in answers.items():
            try:
                rows[place] = some[place].send(answer) if answer is not None else next(some[place])
            except StopIteration as end:
                found[place] = end.value
        together = iter(residuals(list(rows), list(rows.values())) if rows else ())
        answers = {place: [next(together) for _ in asked] for place, asked in rows.items()}
    return [found[place] for place in range(len(some))]


class Weighting:
    """How a residual counts: this one takes every number as it is; others whiten it."""

    def power(self, residual: FloatArray) -> float:
        """Return the sum of squares of a whitened residual, not a number where the run was lost."""
        return float(np.sum(np.square(residual)))

    def white(self, residual: FloatArray) -> FloatArray:
        """Return a residual whitened, shape (numbers,)."""
        return residual.ravel()

    def white_slopes(self, slopes: FloatArray, residual: FloatArray) -> FloatArray:
        """Return slopes (values, ...) whitened as they are at a residual, shape (numbers, values)."""
        return slopes.reshape(len(slopes), -1).T


@dataclass(frozen=True, eq=False)
class Fit:
    """The end of a fit: values [SI], the residual there, and the cost; the slopes d (-residual) / d value while they still hold."""

    values: FloatArray
    residual: FloatArray
    cost: float = np.nan
    slopes: FloatArray | None = None
    fresh: bool = False
    """Whether the slopes were taken at these values."""
    rough: bool = False
    """Whether slopes of small changes led nowhere on the way, and those of larger ones led on."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A residual and its free values; ``known`` slopes, by the place of a value, are taken as they are, and ``steps`` makes the others."""

    residual: Residual
    free: Sequence[Free]
    known: Mapping[int, FloatArray] | None = None
    steps: Steps | None = None

    @cached_property
    def low(self) -> FloatArray:
        """Return the lower bounds, (values,)."""
        return np.array([item.low for item in self.free])

    @cached_property
    def high(self) -> FloatArray:
        """Return the upper bounds, (values,)."""
        return np.array([item.high for item in self.free])

    @cached_property
    def scale(self) -> FloatArray:
        """Return the scales, (values,)."""
        return np.array([item.scale for item in self.free])

    @cached_property
    def given(self) -> FloatArray:
        """Return the given values, (values,)."""
        return np.array([item.given for item in self.free])

    @cached_property
    def precision(self) -> FloatArray:
        """Return one over the squares of the uncertainties, (values,)."""
        uncertainty = np.array([item.uncertainty for item in self.free])
        return np.where(np.isfinite(uncertainty), 1.0 / np.maximum(uncertainty, 1e-300) ** 2, 0.0)

    def penalty(self, values: FloatArray) -> float:
        """Return the squares of how far values are from the given ones, in uncertainties."""
        return float(np.sum(self.precision * (values - self.given) ** 2))

    def answered(self, asking: Asking[Result]) -> Result:
        """Return the result of one that asks for residuals of this problem."""
        return side_by_side([asking], lambda _, rows: self.residual(rows[0]))[0]

    def begin(self, start: FloatArray) -> Fit:
        """Return the start, inside the bounds, with its residual and slopes: one batch."""
        return self.answered(self.beginning(start))

    def beginning(self, start: FloatArray) -> Asking[Fit]:
        """Ask for what :meth:`begin` returns."""
        values = np.clip(start, self.low, self.high)
        steps, asked = self._steps(values, 0), self._asked
        found = yield np.vstack([values, (values + np.diag(steps))[asked]])
        return Fit(values, found[0], slopes=self._slopes(found[0], found[1:], steps), fresh=True)

    def sloping(self, values: FloatArray, residual: FloatArray, before: int = 0, *, wide: bool = False) -> Asking[FloatArray]:
        """Ask for d (-residual) / d value, shape (values, ...), by one-sided differences that stay inside the bounds; with ``wide``
        over the larger part of a scale, as a friction that holds or slides makes many small valleys."""
        steps, asked = self._steps(values, before, wide=wide), self._asked
        found = (yield (values + np.diag(steps))[asked]) if asked else []
        return self._slopes(residual, found, steps)

    def central(self, values: FloatArray, residual: FloatArray, *, wide: bool = False) -> Asking[FloatArray]:
        """Ask for d (-residual) / d value, shape (values, ...), by central differences, one-sided at a bound and beside a run that
        grows beyond bounds, ``wide`` or not."""
        if not len(values):
            return np.zeros((0, *residual.shape))
        steps = np.diag((LARGER_PART if wide else STEP) * self.scale)
        ahead, behind = np.minimum(values + steps, self.high), np.maximum(values - steps, self.low)
        found = np.array((yield np.vstack([ahead, behind])))
        # such a run says nothing of a slope: what the other side says is all there is
        grown = _has_grown(found, residual).reshape(2, -1)
        for moved, runs, lost in zip((ahead, behind), np.split(found, 2), grown & ~grown[::-1], strict=True):
            places = np.flatnonzero(lost)
            moved[places, places], runs[places] = values[places], residual
        # a value between bounds that are one has no slope
        width = np.diag(ahead - behind)
        width = np.where(width > 0.0, width, np.inf)
        return np.array([(found[len(values) + place] - found[place]) / width[place] for place in range(len(values))])

    @property
    def _asked(self) -> list[int]:
        return [place for place in range(len(self.free)) if place not in (self.known or {})]

    def _steps(self, values: FloatArray, before: int, *, wide: bool = False) -> FloatArray:
        steps = (LARGER_PART if wide else STEP) * self.scale if self.steps is None else self.steps(values, before)
        return np.where(values + steps > self.high, -steps, steps)

    def _slopes(self, residual: FloatArray, moved: Sequence[FloatArray], steps: FloatArray) -> FloatArray:
        known, found = self.known or {}, iter(moved)
        if not len(self.free):
            return np.zeros((0, *residual.shape))
        with np.errstate(invalid="ignore"):  # a lost run has no slopes, and no step is taken along them
            slopes = [known[place] if place in known else (residual - next(found)) / steps[place] for place in range(len(steps))]
        return np.array(slopes)


def _has_grown(runs: FloatArray, residual: FloatArray) -> npt.NDArray[np.bool_]:
    """Return for each of some runs (runs, ...) whether its residual is beyond all proportion to the one a step beside it: along a slope as
    steep as that, ``STEP`` of ``STEP`` of the step would change it by its own size."""
    most = np.max(np.abs(residual), initial=0.0) / STEP**2
    return np.asarray([most > 0.0 and not np.max(np.abs(run), initial=0.0) <= most for run in runs])


Report = Callable[[int, float], None]
"""What is called with the number of each iteration and the cost before it."""


def fit(how: Descent, start: FloatArray | Fit, iterations: int = 12, report: Report | None = None) -> Fit:
    """Return where a descent from ``start`` ends, values or an earlier fit to go on from with its slopes, after so many steps at most."""
    return how.problem.answered(descending(how, start, iterations, report))


def descending(how: Descent, start: FloatArray | Fit, iterations: int, report: Report | None = None) -> Asking[Fit]:
    """Ask for what :func:`fit` returns."""
    problem = how.problem
    here = start if isinstance(start, Fit) else (yield from problem.beginning(start))
    here = replace(here, cost=how.cost(here.values, here.residual))
    lines, damping, taken, lost = None, 1e-3, 1, False
    for turn in range(iterations if len(here.values) and np.isfinite(here.cost) else 0):
        if report is not None:
            report(turn + 1, here.cost)
        if here.slopes is None:
            slopes = yield from problem.sloping(here.values, here.residual, taken, wide=lost or here.rough)
            here, taken = replace(here, slopes=slopes, fresh=True), taken + 1
        lines = how.lines(here, lines)
        if not how.goes_on(here, lines):
            break  # no step within the bounds could gain as much
        found = yield from how.trying(here, lines, damping, anew=here.fresh)
        if found is None and (lost or how.is_stuck(here)):
            break
        if found is None:
            # from slopes of another place no step gets better: once more with those of this one, then with those of larger changes
            lost, here = here.fresh, replace(here, slopes=None, fresh=False)
            continue
        end, damping = found
        before, here, lost = here, replace(how.with_kept_slopes(here, end, lines), rough=here.rough or lost), False
        if before.cost - here.cost < how.enough(before.cost):
            break
    # slopes of larger changes that led nowhere either tell nothing
    return replace(here, slopes=None, fresh=False) if lost else here


def fit_linear(slopes: FloatArray, goal: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the values between two bounds with the least sum of squares of goal (numbers,) - slopes (numbers, values) times them."""
    found = np.linalg.lstsq(slopes, goal, rcond=None)[0]
    if np.any(found < low) or np.any(found > high):
        from scipy.optimize import lsq_linear

        orthogonal, triangle = np.linalg.qr(slopes)
        found = lsq_linear(triangle, orthogonal.T @ goal, (low, high), method="bvls").x
    return np.asarray(found)


@dataclass(frozen=True, eq=False)
class _Linearised:
    """A residual as straight lines of its values, in scales: its slopes as given and whitened (numbers, values), the normal matrix with
    the penalty's, and ``down`` (values,), by how much half the cost falls with each value."""

    slopes: FloatArray
    white: FloatArray
    gram: FloatArray
    down: FloatArray


@dataclass(frozen=True)
class Descent:
    """A problem, how its residual counts, and when its descent ends: at a step that gains less than ``least`` and a share ``tolerance``.

    ``worth`` gives, from the cost, the gain that slopes must predict for it to go on; the same by default. ``bent`` is for a residual that
    is far from linear: slopes are taken anew at each step, and more dampings tried at once. With ``corrects`` they are corrected by the
    steps along them: fewer runs, and a drift where the residual tells nothing.
    """

    problem: Problem
    weighting: Weighting = field(default_factory=Weighting)
    tolerance: float = 1e-6
    least: float = _LEAST_GAIN
    worth: Callable[[float], float] | None = None
    bent: bool = False
    corrects: bool = False

    def cost(self, values: FloatArray, residual: FloatArray) -> float:
        """Return the sum of squares of the residual as it counts, with the penalty."""
        return self.weighting.power(residual) + self.problem.penalty(values)

    def enough(self, cost: float) -> float:
        """Return the gain that is worth a further step."""
        return self.least + self.tolerance * cost

    def lines(self, here: Fit, before: _Linearised | None) -> _Linearised:
        """Return the straight lines at a place; those from before with another ``down`` where the slopes are the same."""
        problem, scale = self.problem, self.problem.scale
        assert here.slopes is not None
        with np.errstate(invalid="ignore", over="ignore"):  # a lost run among those of the slopes: no step follows
            if before is not None and before.slopes is here.slopes:
                white, gram = before.white, before.gram
            else:
                white = self.weighting.white_slopes(here.slopes, here.residual) * scale
                gram = white.T @ white + np.diag(problem.precision * scale**2)
            down = white.T @ self.weighting.white(here.residual) - problem.precision * scale * (here.values - problem.given)
        return _Linearised(here.slopes, white, gram, np.asarray(down))

    def goes_on(self, here: Fit, lines: _Linearised) -> bool:
        """Return whether the lines promise a gain that is worth a step."""
        promised = self.predicted(self.step(here.values, lines, 0.0), here.values, lines)
        return promised >= (self.enough if self.worth is None else self.worth)(here.cost)

    def is_stuck(self, here: Fit) -> bool:
        """Return whether there are no other slopes to be tried where those of a place lead nowhere."""
        return here.fresh and (here.rough or self.bent)

    def trying(self, here: Fit, lines: _Linearised, damping: float, *, anew: bool) -> Asking[tuple[Fit, float] | None]:
        """Ask for the first step that gets better and its damping, none where none does; slopes from before are tried one step at first."""
        for factors in np.split(_DAMPINGS, [4] if self.bent else [2] if anew else [1, 2]):
            trials = damping * factors
            candidates = np.array([self.step(here.values, lines, amount) for amount in trials])
            residuals = yield candidates
            costs = [self.cost(trial, other) for trial, other in zip(candidates, residuals, strict=True)]
            best = int(np.argmin(np.nan_to_num(costs, nan=np.inf)))
            if costs[best] < here.cost:
                return Fit(candidates[best], residuals[best], costs[best]), float(np.clip(trials[best], 1e-9, 1e6))
        return None

    def with_kept_slopes(self, here: Fit, end: Fit, lines: _Linearised) -> Fit:
        """Return the end of a step: with the slopes from before where it gained about as much as they predicted, with corrected ones where
        it gained much of that."""
        gain, predicted = here.cost - end.cost, self.predicted(end.values, here.values, lines)
        if self.bent:
            return end
        if abs(gain - predicted) <= _AS_PREDICTED * predicted + self.least:
            return replace(end, slopes=lines.slopes)
        if not self.corrects or gain < LARGER_PART * predicted:
            return end
        return replace(end, slopes=self._corrected(lines.slopes, here, end))

    def _corrected(self, slopes: FloatArray, here: Fit, end: Fit) -> FloatArray:
        """Return the slopes that give the change of the residual along a step, and are else as near to some as can be, in scales.

        S + D s (y - S's)' / (s'D s), y the change of -residual along the step s, D the squares of one over the scales.
        """
        step = end.values - here.values
        missed = here.residual - end.residual - np.tensordot(step, slopes, 1)
        along = step / self.problem.scale**2 / float(np.sum(np.square(step / self.problem.scale)))
        return np.asarray(slopes + along.reshape(-1, *(1,) * missed.ndim) * missed)

    def predicted(self, found: FloatArray, values: FloatArray, lines: _Linearised) -> float:
        """Return by how much the cost falls from ``values`` to ``found`` as far as the slopes show."""
        step = (found - values) / self.problem.scale
        return float(2.0 * step @ lines.down - step @ lines.gram @ step)

    def step(self, values: FloatArray, lines: _Linearised, amount: float) -> FloatArray:
        """Return the values after a damped step that is the best one within the bounds: one that ran into them and was cut short would take
        the other values where they belong only together with it."""
        problem, diagonal = self.problem, np.diag(lines.gram)
        matrix = lines.gram + amount * np.diag(diagonal + 1e-9 * max(float(diagonal.max()), 1e-300))
        step = _undamped(matrix, lines.down)
        low, high = (problem.low - values) / problem.scale, (problem.high - values) / problem.scale
        if np.any(step < low) or np.any(step > high):
            step = _bounded(matrix, lines.down, low, high)
        return np.asarray(np.clip(values + step * problem.scale, problem.low, problem.high))


def _undamped(matrix: FloatArray, slope: FloatArray) -> FloatArray:
    """Return the step, in scales, with which the slopes vanish; none where a run grew beyond all bounds: from there is no way on."""
    if not (np.isfinite(matrix).all() and np.isfinite(slope).all()):
        return np.zeros_like(slope)
    return np.asarray(np.linalg.lstsq(matrix, slope, rcond=None)[0])


def _bounded(matrix: FloatArray, slope: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the step s between two bounds with the least s'Ms/2 - s'g, by the active-set method of Stark and Parker."""
    from scipy.optimize import lsq_linear

    ridge = ROUNDING * max(float(np.diag(matrix).max()), 1e-300)
    root = np.linalg.cholesky(matrix + ridge * np.eye(len(matrix))).T
    goal = np.linalg.solve(root.T, slope)
    movable = high > low
    step = np.where(movable, 0.0, low)
    step[movable] = lsq_linear(root[:, movable], goal, bounds=(low[movable], high[movable]), method="bvls").x
    return step
