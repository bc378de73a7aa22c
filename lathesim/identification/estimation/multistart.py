"""Any parameters of a machine fitted to one recording, with how sure each is and what the recording does not determine.

    minimise  sum_channels sum_k (W_channel (y - y_model(p)))_k^2  +  sum_i ((p_i - given_i) / given_i)^2

The second sum is next to nothing against what a recording tells; it keeps values that it does not tell where they were given.
W whitens what the model leaves: nothing but the floor at first, then an autoregressive model of it, taken anew between rounds, so that
forces nobody modelled, which a replay adds up to a drift, do not draw the values. Each Jacobian is one batch of runs. Standard errors
come from blocks of the recording, so that a misfit that persists is not counted as many independent ones. Source: Ljung, System
Identification, 2nd ed., sections 7.2 and 10.2; White, Econometrica 48 (1980), 817 (errors without a model of the noise); Nocedal and
Wright, Numerical Optimization, 2nd ed., section 4.1 (dog-leg steps inside a trust region, as scipy has them); Huber, Robust Statistics.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.component import Parameter
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.wiring import Plan
from lathesim.errors import LessonError, listed, nearest
from lathesim.identification.estimation.covariance import BLOCKS, SIGNIFICANT
from lathesim.identification.estimation.replay_misfit import Misfit
from lathesim.identification.noise import Whitening, no_whitening, whitening_of
from lathesim.identification.records import Free
from lathesim.identification.signal import LARGER_PART, SLOPE_ROUNDING

_STEP, _SHORTEST, _LONGEST = 2e-3, 1e-6, 0.05
"""First step of the differences, as a share of a parameter's scale, and the shares between which it is set anew."""
_MOVED_FLOORS = 10.0
"""Floors by which a start must move a channel to count."""
_SETTLED = 1e-3
"""Share of a scale below which a fit is settled."""
_SEEN = 3.0
"""A step moves the channel that shows it best by this many floors (root mean square): more than rounding, less than curvature."""
_SPREAD = 0.5
"""Starts lie within this share of the given value."""
_ROUNDS = 4
"""Fits one after the other, and how often derivatives are taken for their steps to settle."""
CORRELATED = 0.95
"""Two values whose errors correlate more than this are named."""
_PART = 0.01
"""A value that makes up this much of an undetermined direction (square of its share) is not determined by itself."""
_SAME = 3e-3
"""Starts agree whose values differ less than this, or less than three standard errors."""


@dataclass(frozen=True)
class FittedParameter:
    """A fitted value with its standard error [SI]; ``determined`` is false where the recording does not tell it."""

    name: str
    unit: str
    value: float
    error: float
    given: float
    determined: bool


@dataclass(frozen=True)
class ChannelMisfit:
    """Root mean square of a channel's misfit before and after [``unit``], and its floor."""

    channel: str
    unit: str
    floor: float
    before: float
    after: float


@dataclass(frozen=True)
class ParameterFit:
    """The outcome: values, pairs that go together, what is not determined, and how many starts came to the same end."""

    parameters: tuple[FittedParameter, ...]
    correlated: tuple[tuple[str, str, float], ...]
    undetermined: tuple[str, ...]
    channels: tuple[ChannelMisfit, ...]
    starts: int
    agreeing: int
    runs: int
    wall_time: float

    @property
    def values(self) -> dict[str, float]:
        """The fitted values by name [SI]."""
        return {item.name: item.value for item in self.parameters}


def free_parameters(plan: Plan, names: Sequence[str]) -> list[Free]:
    """Return what is to be fitted; :class:`LessonError` with the nearest name for what the machine does not have or nothing depends on."""
    found = []
    for name in dict.fromkeys(names):
        if name not in plan.parameters and name not in plan.states:
            raise LessonError(_why_not(plan, name), place="--free", remedy=nearest(name, [*plan.parameters, *plan.states]))
        given = plan.values[name]
        declared = plan.declaration(name)
        low, high = (declared.low, declared.high) if isinstance(declared, Parameter) else (-np.inf, np.inf)
        found.append(Free(name, given, abs(given), low, high, given=given))
    return found


def _why_not(plan: Plan, name: str) -> str:
    part, item = Place.of(name)
    if part in plan.parts and item in plan.parts[part].component.declarations:
        kind = plan.parts[part].component.declarations[item].kind
        if kind == "parameter":
            return f"{name} is wired to another value, so it cannot be fitted by itself."
        return f"{name} is {'an' if kind[0] in 'aeiou' else 'a'} {kind}, and parameters and states are fitted."
    return f"no compared channel depends on a parameter '{name}'."


def fit_parameters(
    misfit: Misfit, free: Sequence[Free], *, starts: int = 4, seed: int = 1, tell: Callable[[int, int], None] | None = None
) -> ParameterFit:
    """Fit from the given values and from further starts spread evenly within 50 % around them; ``tell`` is told of starts done.

    The start of the recording is fitted along where the recording shows it.
    """
    began = time.perf_counter()
    problem = _Problem(misfit, free)
    before = problem.rms(problem.first)
    approached = []
    for number, point in enumerate(_starting_points(problem, starts, seed)):
        approached.append(problem.approach(point))
        if tell is not None:
            tell(number + 1, starts)
    first = min(approached, key=lambda values: float(np.square(problem.rms(values)).sum()))
    best = problem.polish(first)
    ends = [best if values is first else problem.follow(values, best) for values in approached]
    better = min(ends, key=lambda end: end.cost)
    if better.cost < best.cost * (1.0 - _SAME):
        best = problem.polish(better.values)
        ends = [problem.follow(end.values, best) for end in ends]
    return _outcome(problem, best, ends, before, starts, began)


def _starting_points(problem: _Problem, starts: int, seed: int) -> list[FloatArray]:
    """Return the given values, where only one start is wanted, else points of a Sobol sequence around them."""
    if starts == 1:
        return [problem.first]
    from scipy.stats import qmc

    spread = qmc.Sobol(problem.count, seed=seed).random(1 << (starts - 1).bit_length())[:starts]
    points = []
    for row in 2.0 * spread - 1.0:
        point = problem.first.copy()
        point[: problem.count] += _SPREAD * row * problem.scale[: problem.count]
        points.append(np.clip(point, problem.low, problem.high))
    return points


@dataclass(frozen=True, eq=False)
class _End:
    """Where a fit ended [SI], and the mean square of what is left there, whitened."""

    values: FloatArray
    white: tuple[Whitening, ...]
    cost: float


class _Problem:
    """The misfit as scipy's least squares wants it: a vector of numbers near one for a vector of numbers near one."""

    def __init__(self, misfit: Misfit, free: Sequence[Free]) -> None:
        self.misfit = misfit
        self.free = tuple(free)
        self.count = len(self.free)
        named = {item.name for item in self.free}
        starts = {name: value for name, value in misfit.starts.items() if name not in named}
        self.names = [*(item.name for item in self.free), *starts]
        self.first = np.array([*(item.given for item in self.free), *starts.values()])
        self.low = np.array([*(item.low for item in self.free), *(-np.inf for _ in starts)])
        self.high = np.array([*(item.high for item in self.free), *(np.inf for _ in starts)])
        self.white: list[Whitening] = no_whitening(len(misfit.compare))
        self.runs = 0
        self._last: tuple[bytes, FloatArray] | None = None
        self.scale = np.array([*(item.scale for item in self.free), *(abs(value) for value in starts.values())])
        self.scale = self._scales()
        self.steps = np.full(len(self.first), _STEP)
        self.moving = len(self.first)
        """How many of the values a descent moves: all, or the free ones without the start of the recording."""
        self.held = np.array([float(item.given != 0.0) for item in self.free] + [0.0] * len(starts))

    def _scales(self) -> FloatArray:
        """Return a scale for values that are zero: the change that moves the misfit of a channel by about ten floors."""
        scale = self.scale.copy()
        sizes = 10.0 ** np.arange(-12.0, 7.0, 1.0)
        for position in np.flatnonzero(scale == 0.0):
            rows = np.tile(self.first, (len(sizes) + 1, 1))
            rows[1:, position] = np.clip(sizes, self.low[position], self.high[position])
            found = self.evaluate(rows)
            moved = np.sqrt(np.mean(np.square(found[1:] - found[0]), axis=2)).max(axis=1)
            seen = np.flatnonzero(moved > _MOVED_FLOORS)
            scale[position] = sizes[seen[0]] if len(seen) else 1.0
        return scale

    def evaluate(self, rows: FloatArray) -> FloatArray:
        """Return the misfit in floors, (rows, channels, samples)."""
        self.runs += len(rows)
        return self.misfit.misfits(self.names, rows)

    def vector(self, moved: FloatArray) -> FloatArray:
        """Return the weighted misfit of the scaled values that move, and how far all are from the given ones, as one vector."""
        scaled = self._all(moved)
        found = self.evaluate((scaled * self.scale)[None])[0]
        self._last = (scaled.tobytes(), found)
        return np.concatenate([self._weighted(found), self.held * (scaled - self.first / self.scale)])

    def slopes(self, moved: FloatArray) -> FloatArray:
        """Return the derivatives of :meth:`vector`."""
        return np.vstack([self.jacobian(moved), np.diag(self.held)[:, : self.moving]])

    def _all(self, moved: FloatArray) -> FloatArray:
        """Return all scaled values, those that do not move as they were given."""
        return np.concatenate([moved, self.first[self.moving :] / self.scale[self.moving :]])

    def _weighted(self, found: FloatArray) -> FloatArray:
        """Return misfits (..., channels, samples) whitened, as one vector (..., misfits)."""
        rows = [model.whiten(found[..., row, :]) for row, model in enumerate(self.white)]
        return np.concatenate(rows, axis=-1)

    def jacobian(self, moved: FloatArray, *, central: bool = False) -> FloatArray:
        """Return the derivatives of the weighted misfit, (misfits, values that move); all runs are one batch."""
        scaled, many = self._all(moved), self.moving
        values = scaled * self.scale
        steps = self.steps * self.scale
        steps = np.where(values + steps > self.high, -steps, steps)
        rows = [values + np.diag(steps)[:many]]
        if central:
            rows.append(np.clip(values - np.diag(steps)[:many], self.low, self.high))
        elif self._last is None or self._last[0] != scaled.tobytes():
            self.vector(moved)
        found = self.evaluate(np.vstack(rows))
        base = found[many:] if central else np.broadcast_to(self._last[1] if self._last else 0.0, found.shape)
        begun = np.diagonal(rows[1]) if central else values[:many]
        width = np.abs(np.diagonal(rows[0]) - begun) * np.sign(steps[:many]) / self.scale[:many]
        slopes = (found[:many] - base) / width[:, None, None]
        shown = np.sqrt(np.mean(np.square(slopes), axis=2)).max(axis=1)
        self.steps[:many] = np.clip(_SEEN / np.maximum(shown, 1e-300), np.maximum(0.1 * self.steps[:many], _SHORTEST), _LONGEST)
        return self._weighted(slopes).T

    def _settled_jacobian(self, scaled: FloatArray) -> FloatArray:
        """Return central derivatives with steps that are taken no shorter any more: too long ones make a mixture of values that nothing
        shows look as if something did."""
        for _ in range(_ROUNDS):
            taken = self.steps.copy()
            jacobian = self.jacobian(scaled, central=True)
            if np.all(self.steps > 0.5 * taken):
                break
        return jacobian

    def approach(self, point: FloatArray) -> FloatArray:
        """Return the values at which a fit ends that begins at ``point`` and weighs every channel by its floor; the start of the recording
        stays as the recording shows it."""
        self.steps = np.full(len(self.first), _STEP)
        self.moving = self.count
        end = self._descend(point, no_whitening(len(self.misfit.compare)), 1e-3, 30)
        self.moving = len(self.first)
        return end

    def polish(self, values: FloatArray) -> _End:
        """Return the end of a fit in rounds, between which the whitening of what is left is taken anew."""
        white = self._whitening_at(values)
        for _ in range(_ROUNDS):
            before, values = values, self._descend(values, white, 1e-6, 10)
            white = self._whitening_at(values)
            if np.all(np.abs(values - before) < _SETTLED * self.scale):
                break
        return _End(values, white, self._cost(values, white))

    def follow(self, values: FloatArray, best: _End) -> _End:
        """Return the end of a fit from ``values`` with the whitening of another one, so that the two can be compared."""
        values = self._descend(values, best.white, 1e-5, 10)
        return _End(values, best.white, self._cost(values, best.white))

    def _descend(self, values: FloatArray, white: Sequence[Whitening], tolerance: float, most: int) -> FloatArray:
        from scipy.optimize import least_squares

        self.white, self._last = list(white), None
        low, high = (bound[: self.moving] / self.scale[: self.moving] for bound in (self.low, self.high))
        begin = np.clip(values[: self.moving] / self.scale[: self.moving], low, high)
        limits = {"ftol": tolerance, "xtol": 1e-7, "gtol": 1e-12, "max_nfev": most}
        end = least_squares(self.vector, begin, self.slopes, bounds=(low, high), method="dogbox", x_scale="jac", **limits)
        self._last = None
        return np.asarray(self._all(end.x) * self.scale)

    def _whitening_at(self, values: FloatArray) -> tuple[Whitening, ...]:
        return tuple(whitening_of(row) for row in self.evaluate(values[None])[0])

    def _cost(self, values: FloatArray, white: Sequence[Whitening]) -> float:
        self.white = list(white)
        return float(np.mean(np.square(self._weighted(self.evaluate(values[None])[0]))))

    def rms(self, values: FloatArray) -> FloatArray:
        """Return the root mean square of the misfit of every channel, in floors."""
        return np.asarray(np.sqrt(np.mean(np.square(self.evaluate(values[None])[0]), axis=1)))

    def certainty(self, end: _End) -> tuple[FloatArray, FloatArray, list[list[str]]]:
        """Return standard errors and covariance of the values [SI], and the groups of parameters that are not determined by themselves."""
        values = end.values
        found = self.evaluate(values[None])[0]
        self.white = list(end.white)
        jacobian = self._settled_jacobian(values / self.scale)
        misfit = self._weighted(found)
        size = np.where(values != 0.0, np.abs(values), self.scale) / self.scale
        left, singular, right = np.linalg.svd(jacobian * size, full_matrices=False)
        del left
        noise = max(float(np.sqrt(misfit @ misfit / max(len(misfit) - len(values), 1))), 1e-12)
        loose = singular <= max(noise / LARGER_PART, SLOPE_ROUNDING * float(singular.max(initial=0.0)))
        blurred = [[self.free[position].name for position in np.flatnonzero(np.square(row[: self.count]) > _PART)] for row in right[loose]]
        firm = right[~loose].T
        inverse = firm / singular[~loose] ** 2 @ firm.T
        scores = self._block_scores(jacobian * size, misfit)
        covariance = inverse @ (scores.T @ scores) @ inverse
        floor = inverse * noise**2
        widened = np.maximum(np.diag(covariance), np.diag(floor))
        stretch = np.sqrt(widened / np.maximum(np.diag(covariance), 1e-300))
        covariance = covariance * np.outer(stretch, stretch) * np.outer(size * self.scale, size * self.scale)
        return np.sqrt(np.diag(covariance)), covariance, [names for names in blurred if names]

    def _block_scores(self, jacobian: FloatArray, misfit: FloatArray) -> FloatArray:
        """Return the sums of misfit times slope over blocks of time, (blocks, values)."""
        channels, samples = self.misfit.recorded.shape
        product = (jacobian * misfit[:, None]).reshape(channels, samples, -1).sum(axis=0)
        edges = np.linspace(0, samples, min(BLOCKS, samples) + 1).astype(int)[:-1]
        return np.asarray(np.add.reduceat(product, edges, axis=0))

    def agree(self, best: _End, end: _End, errors: FloatArray) -> bool:
        """Return whether two ends are the same fit: in what they leave, and in every value that is determined."""
        if end.cost > best.cost * (1.0 + _SAME):
            return False
        firm = (errors > 0.0) & (errors < LARGER_PART * np.maximum(np.abs(best.values), np.finfo(float).tiny))
        firm[self.count :] = False
        near = np.abs(end.values - best.values) <= np.maximum(_SAME * np.abs(best.values), SIGNIFICANT * errors)
        return bool(np.all(near[firm]))


def _outcome(problem: _Problem, best: _End, ends: Sequence[_End], before: FloatArray, starts: int, began: float) -> ParameterFit:
    """Return the values of the best end, how sure they are, and how far off each channel is before and after."""
    errors, covariance, blurred = problem.certainty(best)
    agreeing = sum(problem.agree(best, end, errors) for end in ends)
    named, misfit = {name for names in blurred for name in names}, problem.misfit
    parameters = tuple(
        FittedParameter(
            item.name, misfit.plan.unit(item.name), float(best.values[place]), float(errors[place]), item.given, item.name not in named
        )
        for place, item in enumerate(problem.free)
    )
    pairs = []
    for first in range(problem.count):
        for second in range(first):
            size = errors[first] * errors[second]
            rho = float(covariance[first, second] / size) if size > 0.0 else 0.0
            names = (problem.free[second].name, problem.free[first].name)
            if abs(rho) > CORRELATED and named.isdisjoint(names):
                pairs.append((*names, rho))
    after = problem.rms(best.values)
    channels = tuple(
        ChannelMisfit(name, misfit.plan.unit(channel), float(floor), float(old * floor), float(new * floor))
        for name, channel, floor, old, new in zip(misfit.compare, misfit.channels, misfit.floors, before, after, strict=True)
    )
    sentences = tuple(dict.fromkeys(_undetermined(names) for names in blurred))
    return ParameterFit(parameters, tuple(pairs), sentences, channels, starts, agreeing, problem.runs, time.perf_counter() - began)


def _undetermined(names: list[str]) -> str:
    if len(names) == 1:
        return f"The recording does not determine {names[0]}."
    return f"The recording determines only a combination of {listed(names)}."


def as_json(lesson: str, recording: str, found: ParameterFit, findings: Sequence[str]) -> Mapping[str, object]:
    """Return the result of a fit as JSON (schema ``lathesim-fit/1``)."""
    return {
        "schema": "lathesim-fit/1",
        "lesson": lesson,
        "recording": recording,
        "parameters": {
            item.name: {
                "value": item.value, "unit": item.unit, "standard_error": item.error if item.determined else None, "given": item.given,
                "determined": item.determined,
            }
            for item in found.parameters
        },
        "correlated": [{"names": [first, second], "correlation": rho} for first, second, rho in found.correlated],
        "undetermined": list(found.undetermined),
        "fit": {
            item.channel: {"unit": item.unit, "floor": item.floor, "before": item.before, "after": item.after} for item in found.channels
        },
        "starts": found.starts,
        "agreeing": found.agreeing,
        "runs": found.runs,
        "findings": list(findings),
        "wall_time_s": found.wall_time,
    }  # fmt: skip
