"""Any parameters of a machine fitted to one recording, with how sure each is and what the recording does not determine.

The fit is the one of a diagnosis, from several starts at the same time. Given values are uncertain by as much as they are: that is next to
nothing against what a recording tells, and keeps values that it does not tell where they were given. In units of the values themselves the
covariance has a principal axis for each mixture of values; one that is as uncertain as a value is large is not determined:

    C_ij / (p_i p_j) = sum_k s_k^2 v_ki v_kj

Standard errors are larger by the pulls of blocks of the recording, so that a misfit that persists is not counted as many independent ones.
Source: Ljung, System Identification, 2nd ed., sections 7.2 and 10.2; White, Econometrica 48 (1980), 817 (errors by pulls); Belsley, Kuh,
Welsch, Regression Diagnostics (1980), section 3.2 (variance decomposition).
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.component import Parameter
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.wiring import Plan
from lathesim.errors import LessonError, listed, nearest
from lathesim.identification.estimation.covariance import SIGNIFICANT, blocks_of
from lathesim.identification.estimation.fit import STEP
from lathesim.identification.estimation.least_squares import ROUGH, fit
from lathesim.identification.noise import whitened, whitened_power
from lathesim.identification.records import Fitted, Free, with_start
from lathesim.identification.replay.experiment import Experiment, build_experiments
from lathesim.identification.replay.loading import read_for, refuse_still
from lathesim.identification.replay.simulator import Simulator
from lathesim.identification.signal import LARGER_PART, root_mean_square
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import Registry
from lathesim.recordings.raw_table import Finding

_MOVED_FLOORS = 10.0
"""Floors by which a start must move a channel to count."""
_SPREAD = 0.5
"""Starts lie within this share of the given value."""
CORRELATED = 0.95
"""Two values whose errors correlate more than this are named."""
_ROUNDS = 4
"""Rounds of the fit that is reported, between which the noise model of what is left is taken anew."""
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


@dataclass(frozen=True, eq=False)
class FitQuestion:
    """What is to be fitted to what, and what was found in the recording on the way."""

    experiment: Experiment
    free: tuple[Free, ...]
    findings: tuple[Finding, ...] = ()


def ask_fit(
    lesson: Lesson,
    recording: Path,
    registry: Registry,
    names: Sequence[str],
    variant: str | None = None,
    overrides: Mapping[str, str | float] | None = None,
    *,
    closed: bool = False,
) -> FitQuestion:
    """Read the recording as the lesson maps it and put the machine beside it, sampled as the recording is.

    ``closed`` leaves the machine's own loops closed: only the inputs the lesson calls driven are recorded ones. Raises
    :class:`LessonError` for what the lesson does not say or the machine does not have, :class:`RecordingError` for the file.
    """
    machine, recorded = read_for(prepare(lesson, registry, variant, overrides), recording, registry)
    refuse_still(recording, recorded.record, machine.compare)
    (experiment,) = build_experiments(replace(machine, replay=not closed), [(recorded.name, recorded.record)], ())
    return FitQuestion(experiment, tuple(free_parameters(experiment, names)), recorded.findings)


def free_parameters(experiment: Experiment, names: Sequence[str]) -> list[Free]:
    """Return what is to be fitted; :class:`LessonError` with the nearest name for what the machine does not have or nothing depends on."""
    simulator, plan = experiment.sensed, experiment.sensed.plan
    starts = {item.name: item for item in _recorded_starts(experiment)}
    found = []
    for name in dict.fromkeys(names):
        if name not in plan.parameters and name not in plan.states:
            raise LessonError(_why_not(plan, name), place="--free", remedy=nearest(name, [*plan.parameters, *plan.states]))
        given, declared = plan.values[name], plan.declaration(name)
        low, high = (declared.low, declared.high) if isinstance(declared, Parameter) else (-np.inf, np.inf)
        scale = _scale(simulator, name, low, high)
        if not scale:
            raise LessonError(f"no compared channel depends on {name}.", place="--free", remedy="Compare more channels, or leave it out.")
        found.append(starts.get(name, Free(name, given, scale, low, high, abs(given) or np.inf, given)))
    return found


def _recorded_starts(experiment: Experiment) -> list[Free]:
    """Return the states whose value at the first sample the recording shows, as free ones."""
    return [item for item in experiment.start_states(experiment.sensed.plan) if np.isfinite(item.uncertainty)]


def _why_not(plan: Plan, name: str) -> str:
    part, item = Place.of(name)
    if part in plan.parts and item in plan.parts[part].component.declarations:
        kind = plan.parts[part].component.declarations[item].kind
        if kind == "parameter":
            return f"{name} is wired to another value, so it cannot be fitted by itself."
        return f"{name} is {'an' if kind[0] in 'aeiou' else 'a'} {kind}, and parameters and states are fitted."
    return f"no compared channel depends on a parameter '{name}'."


def _scale(simulator: Simulator, name: str, low: float, high: float) -> float:
    """Return the size of a value, where it is zero the change that moves a channel by about ten floors; 0 where none moves any."""
    given = simulator.given(name)
    sizes = np.array([0.1 * given]) if given else 10.0 ** np.arange(-12.0, 7.0, 1.0)
    runs = simulator.residuals([name], np.clip([[given], *([given + size] for size in sizes)], low, high))
    moved = np.array([np.max(np.std(run - runs[0], axis=1) / simulator.seen_floors) for run in runs[1:]])
    if not np.any(moved):
        return 0.0
    return abs(given) or float(sizes[np.argmax(moved > min(_MOVED_FLOORS, float(moved.max()) * LARGER_PART))])


@dataclass(frozen=True, eq=False)
class _Counting(Simulator):
    """A simulator that counts its runs."""

    runs: list[int] = field(default_factory=list)

    def _each(self, names: Sequence[str], values: FloatArray, *how: Any, **more: Any) -> list[Any]:
        self.runs.append(len(values))
        return super()._each(names, values, *how, **more)


def fit_parameters(
    question: FitQuestion, *, starts: int = 4, seed: int = 1, tell: Callable[[int, int], None] | None = None
) -> ParameterFit:
    """Fit from the given values and from further starts spread evenly within 50 % around them; ``tell`` is told of starts done.

    The start of the recording is fitted along where the recording shows it.
    """
    began, sensed, free = time.perf_counter(), question.experiment.sensed, question.free
    simulator = _Counting(**{item.name: getattr(sensed, item.name) for item in fields(sensed)})
    named = {item.name for item in free}
    along = [item for item in _recorded_starts(question.experiment) if item.name not in named]
    given = [*free, *along]
    # a friction that holds has to feel the simulated motion: of the recorded one the first micrometres are lost in its rounding
    felt = question.experiment.simulated_motion_of(())
    names, values = [*felt, *(item.name for item in given)], [*felt.values(), *(item.start for item in given)]
    before = simulator.residuals(names, np.array([values]))[0]
    ends = []
    for number, point in enumerate(_starting_points(free, starts, seed)):
        ends.append(fit(simulator, [*point, *along], felt, rounds=2, tolerance=ROUGH, slopes="kept"))
        if tell is not None:
            tell(number + 1, starts)
    # a likelihood is one of all fits only under the noise of one of them
    best = min(ends, key=lambda end: float(np.sum(np.square(end.residual / sensed.seen_floors[:, None]))))
    best = fit(simulator, with_start(best), felt, rounds=_ROUNDS, slopes="central")
    followed = [fit(simulator, with_start(end), felt, rounds=1, noise=best.noise, slopes="kept") for end in ends]
    certain = _certainty(best, len(free))
    agreeing = sum(_agree(best, end, certain, named) for end in followed)
    channels = tuple(
        ChannelMisfit(name, sensed.plan.unit(channel), float(floor), root_mean_square(old), root_mean_square(new))
        for name, channel, floor, old, new in zip(
            question.experiment.machine.compare, sensed.channels, sensed.replayed_floors, before, best.residual, strict=True
        )
    )
    parameters, pairs, sentences = _told(sensed.plan, best, certain, len(free))
    return ParameterFit(parameters, pairs, sentences, channels, starts, agreeing, sum(simulator.runs), time.perf_counter() - began)


def _starting_points(free: Sequence[Free], starts: int, seed: int) -> list[list[Free]]:
    """Return the given values, where only one start is wanted, else points of a Sobol sequence around them."""
    if starts == 1:
        return [list(free)]
    from scipy.stats import qmc

    spread = qmc.Sobol(len(free), seed=seed).random(1 << (starts - 1).bit_length())[:starts]
    starts_of = [[item.start + _SPREAD * share * item.scale for item, share in zip(free, row, strict=True)] for row in 2.0 * spread - 1.0]
    return [[replace(item, start=float(np.clip(at, item.low, item.high))) for item, at in zip(free, row, strict=True)] for row in starts_of]


@dataclass(frozen=True, eq=False)
class _Certainty:
    """Standard errors (values,) and covariance (values, values) [SI] of fitted values, and the groups of names of which none is determined
    by itself."""

    errors: FloatArray
    covariance: FloatArray
    blurred: list[list[str]]


def _certainty(best: Fitted, count: int) -> _Certainty:
    """Return how sure fitted values are; of the groups the first ``count`` values are named."""
    size = np.maximum(np.abs(best.values), [item.scale for item in best.free])
    spread, axes = np.linalg.eigh(best.covariance / np.outer(size, size))
    far = np.sqrt(np.maximum(spread, 0.0))
    # central differences leave a share of a slope that is the square of their step: what is uncertain by more than that tells is open
    loose = far >= min(LARGER_PART, float(far[far > 0.0].min(initial=np.inf)) / STEP**2)
    names = [[best.names[place] for place in places if place < count] for places in _moved_together(axes[:, loose])]
    covariance = (axes[:, ~loose] * spread[~loose]) @ axes[:, ~loose].T * np.outer(size, size)
    pulls = _pulls_of_blocks(best) @ covariance
    wider = np.sqrt(np.maximum(np.sum(pulls**2, axis=0) / np.maximum(np.diag(covariance), 1e-300), 1.0))
    covariance = covariance * np.outer(wider, wider)
    return _Certainty(np.sqrt(np.diag(covariance)), covariance, [some for some in names if some])


def _moved_together(loose: FloatArray) -> list[list[int]]:
    """Return which values each of some directions (values, directions) moves, turned within their space so that single ones and pairs stand
    by themselves: of two open combinations of the same values, axes show any mixture."""
    found, every = [], range(len(loose))
    for places in itertools.chain(itertools.combinations(every, 1), itertools.combinations(every, 2)):
        if loose.shape[1] < 2:
            break
        others = np.delete(loose, places, axis=0)
        moved, turned = np.linalg.eigh(others.T @ others)
        if moved[0] < _PART:
            found.append(list(places))
            loose = loose @ turned[:, 1:]
    return found + [np.flatnonzero(np.square(axis) > _PART).tolist() for axis in loose.T]


def _pulls_of_blocks(best: Fitted) -> FloatArray:
    """Return the sums of misfit times slope, both whitened, over blocks of frequencies (blocks, values)."""
    assert best.sensitivity is not None
    slopes, left = (whitened(best.noise, rows, full_band=False) for rows in (best.sensitivity, best.residual[None]))
    known = slopes / np.maximum(np.linalg.norm(slopes, axis=1), 1e-300)[:, None]
    labels = blocks_of(np.sum(np.square(known), axis=0), [2 * model.bins(full_band=False) for model in best.noise])
    return np.array([np.bincount(labels, row) for row in slopes * left]).T


def _agree(best: Fitted, end: Fitted, certain: _Certainty, named: Collection[str]) -> bool:
    """Return whether two ends are the same fit: in how likely they are, and in every ``named`` value that is determined."""
    near = np.abs(end.values - best.values) <= np.maximum(_SAME * np.abs(best.values), SIGNIFICANT * certain.errors)
    determined = [name in named and not any(name in names for names in certain.blurred) for name in best.names]
    costs = [whitened_power(one.residual, best.noise, full_band=False) + one.penalty for one in (end, best)]
    return costs[0] < costs[1] + SIGNIFICANT**2 and bool(np.all(near[determined]))


def _told(
    plan: Plan, best: Fitted, certain: _Certainty, count: int
) -> tuple[tuple[FittedParameter, ...], tuple[tuple[str, str, float], ...], tuple[str, ...]]:
    """Return the fitted values, the pairs of them that go together, and what is not determined in words."""
    loose = {name for names in certain.blurred for name in names}
    parameters = tuple(
        FittedParameter(name, plan.unit(name), float(value), float(error), plan.values[name], name not in loose)
        for name, value, error in zip(best.names[:count], best.values, certain.errors, strict=False)
    )
    size = np.outer(certain.errors, certain.errors)[:count, :count]
    rho = np.divide(certain.covariance[:count, :count], size, out=np.zeros_like(size), where=size > 0.0)
    pairs = [(best.names[second], best.names[first], float(rho[first, second])) for first in range(count) for second in range(first)]
    pairs = [pair for pair in pairs if abs(pair[2]) > CORRELATED and loose.isdisjoint(pair[:2])]
    return parameters, tuple(pairs), tuple(dict.fromkeys(_undetermined(names) for names in certain.blurred))


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
