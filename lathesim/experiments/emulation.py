"""``emulate``: a lesson and way-points of its programs to a machine that follows them, and what they could not tell."""

from __future__ import annotations

import math
import threading
import time as clock
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lathesim.cluster import Cluster
from lathesim.engine.assembly import FloatArray
from lathesim.experiments.free_values import FreeValue, Telling, bounds, free_values, telling, values_of
from lathesim.experiments.left_out import Importance, Unseen, gained, importances, is_noise, judge_unseen, left_out, own_band
from lathesim.experiments.objective import METHODS, Effort, Objective, Tell
from lathesim.experiments.replica import Replica, Say, Search, Setting
from lathesim.experiments.structure_search import SURE, Change, Chosen, StructureSearch, changed, possible_changes
from lathesim.experiments.waypoints import Waypoints, clocks_apart, read_waypoints
from lathesim.lessons.lesson import Lesson
from lathesim.plugins import Registry
from lathesim.units import in_unit

_RISEN = 1.2
"""Factor by which a floor rises less where it is known well enough."""
_LEAST_FLOOR = 1e-6
"""Noise [m] below which way-points of machines are not; assumed."""
_FIRST, _LATER = 12, 8
"""Runs of the machine that a descent may make before and after its floor is set to what is left, besides those for derivatives."""
_FAR_OFF, _HORIZONS = 3e-3, (0.06, 0.12, 0.25, 0.5)
"""Deviation (rms) [m] from which on a machine is fitted to the beginning of its programs first, and to which shares of them; assumed."""
_SETTLED = 2.0
"""Time [s] from which on the cross-design tables count, as published."""


@dataclass(frozen=True)
class EmulationQuestion:
    """What is asked of an emulation: the search, the weight of speeds (lambda), the factor of the bounds, and how much it may do."""

    method: str = "replay"
    weight: float = 0.0
    factor: float = 4.0
    free: tuple[str, ...] = ()
    structure: bool = True
    effort: Effort = field(default_factory=Effort)
    seed: int = 1
    importance: bool = True


@dataclass(frozen=True, eq=False)
class Followed:
    """A recording that was fitted, with the deviation (rms) [m] of the machine as given and as emulated."""

    recorded: Waypoints
    given: float
    fitted: float


@dataclass(frozen=True)
class ErrorBand:
    """What an emulated machine may be off by: ``noise`` [m], the ``share`` b of what its values might do by which the structure errs, and
    q [s^2/s], by how much the control's clock is ``wandering`` against the program."""

    noise: float
    share: float
    wandering: float


@dataclass(frozen=True, eq=False)
class Emulation:
    """The outcome: the changed lesson with its values [SI], how well it follows each recording, and what was learnt.

    ``clocks`` has a sentence for each recording whose clock seems to run apart from the program. ``cross`` holds sqrt(MSE(x) + MSE(y)) [m]
    after 2 s: row recording, column the machine fitted to that recording alone. ``unseen`` are recordings that were not fitted.
    """

    lesson: Lesson
    changes: tuple[Change, ...]
    values: tuple[tuple[FreeValue, float], ...]
    followed: tuple[Followed, ...]
    clocks: tuple[str, ...]
    cross: tuple[tuple[float, ...], ...]
    band: ErrorBand
    telling: Telling
    importance: tuple[Importance, ...]
    unseen: tuple[tuple[Waypoints, Unseen], ...]
    search: Search
    question: EmulationQuestion


def emulate(
    lesson: Lesson, recordings: Sequence[str], validate: Sequence[str], registry: Registry, question: EmulationQuestion,
    say: Say = lambda sentence: None, stop: threading.Event | None = None, cluster: Cluster | None = None,
) -> Emulation:  # fmt: skip
    """Learn the values, and where they do not suffice the structure, of a machine from way-points.

    Raises what :func:`read_waypoints` raises, and :class:`LatheSimError` where nothing can be learnt.
    """
    began = clock.perf_counter()
    fitted = _Fitting(lesson, recordings, validate, registry, question, stop, cluster)
    as_given = fitted.objective(())
    start = np.zeros(len(as_given.free))
    readings = [rows[0] for rows in as_given.replica.readings(values_of(as_given.free, start)[None, :])]
    clocks = tuple(clocks_apart(fitted.recorded, readings))
    for sentence in (*(f"{item.name}: {finding}" for item in fitted.recorded for finding in item.findings), *clocks):
        say(sentence)
    given = as_given.position_rms(start)
    say(f"As given, the machine is off by {_listed_mm(given)} (rms).")
    best = fitted.best((), say, rounds=0 if question.structure else 2)
    try:
        if question.structure and not best.stopped:
            best = _with_structure(fitted, best, say)
            if question.method == "replay" and not best.stopped:
                best = _with_clock(fitted, fitted.best(best.changes, say, best.point, rounds=1), say)
    except KeyboardInterrupt:
        fitted.heard()
        best = replace(best, stopped=True)
    return replace(_outcome(fitted, best, given, clock.perf_counter() - began, say), clocks=clocks)


@dataclass(frozen=True, eq=False)
class _Found:
    """A structure with its best point."""

    changes: tuple[Change, ...]
    objective: Objective
    point: FloatArray
    stopped: bool = False


class _Fitting:
    """The recordings, read once for each structure, and the searches on them."""

    def __init__(
        self, lesson: Lesson, recordings: Sequence[str], validate: Sequence[str], registry: Registry, question: EmulationQuestion,
        stop: threading.Event | None, cluster: Cluster | None,
    ) -> None:  # fmt: skip
        self.cluster = cluster
        self.lesson, self.registry, self.question, self.stop = lesson, registry, question, stop
        self.given, self.unseen_given = tuple(recordings), tuple(validate)
        self.recorded = self.read(lesson, self.given)
        self.runs = 0
        self.factor = question.factor

    def heard(self) -> None:
        """Take the wish to stop as heard, so that what is known can still be judged."""
        if self.stop is not None:
            self.stop.clear()

    def wished(self) -> bool:
        """Return whether Ctrl-C was pressed and not yet heard."""
        return self.stop is not None and self.stop.is_set()

    def read(self, lesson: Lesson, given: Sequence[str]) -> tuple[Waypoints, ...]:
        return tuple(read_waypoints(lesson, text, self.registry) for text in given)

    def free(self, changes: Sequence[Change]) -> list[FreeValue]:
        own = free_values(self.lesson, self.recorded[0].prepared.plan, self.question.free, self.factor)
        return own + [value for change in changes for value in change.brings]

    def objective(self, changes: Sequence[Change], recordings: Sequence[str] | None = None, weight: float | None = None) -> Objective:
        lesson = changed(self.lesson, changes) if changes else self.lesson
        read = self.recorded if not changes and recordings is None else self.read(lesson, self.given if recordings is None else recordings)
        free = self.free(changes)
        replica = self._replica(read, [item.name for item in free])
        floor = max([_LEAST_FLOOR, *(size / np.sqrt(12.0) for item in read for size in item.resolution.values())])
        return Objective(replica, free, read, self.question.weight if weight is None else weight, floor)

    def holding(self, changes: Sequence[Change]) -> Replica:
        """Return the machine that holds all changes, with the base values, what they bring and what they hold as its names."""
        read = self.read(changed(self.lesson, changes), self.given)
        names = list(dict.fromkeys([*(item.name for item in self.free(changes)), *(name for change in changes for name in change.held)]))
        return self._replica(read, names)

    def _replica(self, read: Sequence[Waypoints], names: Sequence[str]) -> Replica:
        return Replica([Setting(item.prepared.machinery, item.channels, item.time) for item in read], names, self.stop, self.cluster)

    def best(self, changes: Sequence[Change], say: Say, start: FloatArray | None = None, rounds: int = 2) -> _Found:
        """Return the best point of a structure, with the search that was asked for."""
        objective = self.objective(changes)
        low, high = bounds(objective.free)
        search = METHODS[self.question.method]
        told = [clock.monotonic()]

        def tell(runs: int, cost: float) -> None:
            if clock.monotonic() - told[0] > 2.0:
                told[0] = clock.monotonic()
                say(f"  {runs} runs, off by {in_unit(np.sqrt(max(cost, 0.0)), 'mm')}")

        stopped = False
        try:
            if search is METHODS["replay"]:
                point = _descend(objective, low, high, self.question, start, tell, rounds)
            else:
                point = search(objective, low, high, self.question.effort, self.question.seed, tell)
        except KeyboardInterrupt:
            if not objective.history.points:
                raise
            self.heard()
            point, stopped = objective.history.best(), True
        self.runs += objective.replica.runs
        return _Found(tuple(changes), objective, point, stopped)


def _descend(
    objective: Objective, low: FloatArray, high: FloatArray, question: EmulationQuestion, start: FloatArray | None, tell: Tell, rounds: int
) -> FloatArray:
    """Return the end of the descent, with the noise set to what is left and the descent gone on with, so that the pull has its weight.

    Times of blocks that are a little wrong add up. Where the machine is far off, its beginning is fitted first, then ever more of it: so a
    block is never held against another one. Source: H. G. Bock, Recent advances in parameter identification techniques for ODE (1983).
    """
    from lathesim.experiments.objective import descend

    point = np.zeros(len(low)) if start is None else start
    if max(objective.position_rms(point)) > _FAR_OFF:
        longest = max(item.duration for item in objective.recorded)
        for share in _HORIZONS:
            objective.until = share * longest
            point = descend(objective, low, high, point, tell, _LATER, 1e-2)
        objective.until = math.inf
    point = descend(objective, low, high, point, tell, _FIRST, 1e-2)
    for _ in range(rounds):
        before = objective.floor
        objective.take_floor(point)
        if objective.floor < _RISEN * before:
            break
        point = descend(objective, low, high, point, tell, _LATER)
    return point


def _with_structure(fitted: _Fitting, best: _Found, say: Say) -> _Found:
    """Return the machine with the changes of its structure that better what was not fitted; Ctrl-C keeps the best so far."""
    if is_noise(best.objective, best.point):
        return best
    changes = possible_changes(fitted.recorded[0].prepared, fitted.registry)
    if not changes:
        return best
    say(f"What is left is no noise. Looking at {len(changes)} changes of the structure ...")
    search = StructureSearch(fitted.holding(changes), fitted.objective(()).free, changes, best.objective, say)
    chosen = search.run(Chosen(best.changes, best.point))
    fitted.runs += search.replica.runs
    found = fitted.objective(chosen.changes) if chosen.changes else best.objective
    found.floor, found.wandering = search.floor, search.wandering
    if chosen.stopped:
        fitted.heard()
    return _Found(chosen.changes, found, chosen.point, chosen.stopped)


def _with_clock(fitted: _Fitting, best: _Found, say: Say) -> _Found:
    """Return the machine fitted with a clock that wanders, if that betters what was not fitted, and with what shows beside it.

    It is asked last: an error of the structure that grows with speed looks like a clock too, but is the same in another program.
    """
    from lathesim.experiments.objective import descend

    with_clock, plain = fitted.objective(best.changes), best.objective
    with_clock.take_clock(best.point)
    if with_clock.wandering is None:
        return best
    point = descend(with_clock, *bounds(with_clock.free), best.point, lambda runs, cost: None, _LATER)
    worth = gained(left_out(plain, best.point)[0], left_out(with_clock, point, judge=plain)[0])
    fitted.runs += with_clock.replica.runs
    if worth < SURE:
        return best
    say(f"The control's clock wanders by {in_unit(with_clock.wandering.spread**0.5, 'ms', '.2g')} in the first second.")
    return _with_structure(fitted, _Found(best.changes, with_clock, point), say)


def _outcome(fitted: _Fitting, best: _Found, given: Sequence[float], wall: float, say: Say) -> Emulation:
    objective, point, question = best.objective, best.point, fitted.question
    low, high = bounds(objective.free)
    residual = objective.vector(point)[0]
    freedom = max(1, residual.size - len(point))
    noise = max(objective.floor * float(np.sqrt(np.square(residual).sum() / freedom)), _LEAST_FLOOR)
    say("Stopped; the best machine so far is judged." if best.stopped else "What the recordings tell ...")
    # the judgement of what is known is no longer given up: a first Ctrl-C only leaves out the importance and the cross-design table
    objective.replica.stop = None
    told = _telling(objective, point, noise)
    stopped = best.stopped or fitted.wished()
    ranked = importances(objective, point, noise, low, high, question.seed) if question.importance and not stopped else []
    stopped = stopped or fitted.wished()
    unseen: tuple[tuple[Waypoints, Unseen], ...] = ()
    if fitted.unseen_given:
        unseen_objective = fitted.objective(best.changes, fitted.unseen_given)
        unseen_objective.replica.stop = None
        unseen_objective.floor = objective.floor
        unseen = tuple(zip(unseen_objective.recorded, judge_unseen(objective, unseen_objective, point), strict=True))
    cross = _cross(fitted, best, say) if len(fitted.recorded) > 1 and not stopped else ()
    lesson = changed(fitted.lesson, best.changes) if best.changes else fitted.lesson
    values = tuple(zip(objective.free, values_of(objective.free, point), strict=True))
    followed = tuple(Followed(*item) for item in zip(objective.recorded, given, objective.position_rms(point), strict=True))
    search = Search(fitted.runs + objective.replica.runs, wall, stopped or fitted.wished())
    band = ErrorBand(noise, own_band(objective, point).share, objective.wandering.spread if objective.wandering else 0.0)
    return Emulation(lesson, best.changes, values, followed, (), cross, band, told, tuple(ranked), unseen, search, question)


def _telling(objective: Objective, point: FloatArray, noise: float) -> Telling:
    slopes = objective.slopes(point) * (objective.floor / noise)
    here = objective.vector(point)[0]

    def moved(directions: FloatArray) -> FloatArray:
        return np.asarray(np.abs(objective.vector(point + directions) - here).max(axis=1) * (objective.floor / noise))

    return telling([item.name for item in objective.free], slopes, moved)


def _cross(fitted: _Fitting, best: _Found, say: Say) -> tuple[tuple[float, ...], ...]:
    """Return the cross-design table: each recording alone fitted, from where the joint fit ended, and held against all."""
    from lathesim.experiments.objective import descend

    columns = []
    for number, text in enumerate(fitted.given):
        alone = fitted.objective(best.changes, [text])
        alone.floor, alone.wandering = best.objective.floor, best.objective.wandering_of(number)
        low, high = bounds(alone.free)
        try:
            if fitted.question.method == "replay":
                point = descend(alone, low, high, best.point, lambda runs, cost: None, _LATER)
            else:
                point = METHODS[fitted.question.method](
                    alone, low, high, fitted.question.effort, fitted.question.seed, lambda runs, cost: None
                )
        except KeyboardInterrupt:
            return ()
        fitted.runs += alone.replica.runs
        columns.append(best.objective.position_rms(point, _SETTLED))
        say(f"  fitted to {alone.recorded[0].name} alone: off by {_listed_mm(columns[-1])}")
    return tuple(tuple(column[row] for column in columns) for row in range(len(columns)))


def _listed_mm(sizes: Sequence[float]) -> str:
    return ", ".join(f"{in_unit(size, 'mm')}" for size in sizes)
