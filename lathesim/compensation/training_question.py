"""The weights of a small network: the table of a NeuralRegulator, and the vector a search moves."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lathesim.component import Table
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.batch import Batch, Reduce
from lathesim.engine.wiring import wire
from lathesim.errors import LessonError, WiringError, nearest
from lathesim.identification.estimation.fit import Problem, Weighting
from lathesim.identification.records import Free
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry

INPUTS, OUTPUTS, COLUMNS = 3, 2, 7
FIRST_RANGE = 0.1
"""Weights and biases begin evenly within this much of zero (as published)."""
MOST_HIDDEN = 64
"""Hidden neurons of a network that a control computes within a sample, and whose weights a search can find (assumed)."""


@dataclass(frozen=True)
class NetworkShape:
    """A network with no or one hidden layer: ``hidden`` neurons, 0 for none."""

    hidden: int

    def __post_init__(self) -> None:
        if not 0 <= self.hidden <= MOST_HIDDEN:
            weights = self.hidden * (INPUTS + 1 + OUTPUTS) + OUTPUTS
            fact = f"a network with {self.hidden} hidden neurons has {weights} weights, too many to be found or computed in a sample."
            raise LessonError(fact, remedy=f"Use 0 to {MOST_HIDDEN} hidden neurons.")

    @property
    def weights(self) -> int:
        """How many numbers a search moves."""
        return self.hidden * (INPUTS + 1 + OUTPUTS) + OUTPUTS if self.hidden else OUTPUTS * (INPUTS + 1)

    def table(self, vector: FloatArray) -> FloatArray:
        """Return the table of a NeuralRegulator for a vector of weights."""
        rows = np.zeros((self.hidden + OUTPUTS, COLUMNS))
        rows[self.hidden :, 0] = 1.0
        if self.hidden:
            rows[: self.hidden, 1:] = vector[:-OUTPUTS].reshape(self.hidden, -1)
            rows[self.hidden :, 1] = vector[-OUTPUTS:]
        else:
            rows[:, 1 : 2 + INPUTS] = vector.reshape(OUTPUTS, -1)
        return rows

    def start(self, rng: np.random.Generator) -> FloatArray:
        """Return weights to begin with."""
        return rng.uniform(-FIRST_RANGE, FIRST_RANGE, self.weights)


_TINY = 1e-15


@dataclass(frozen=True)
class TrainingScore:
    """A sum of sizes of channels:  score = sum of weight times size(channel).

    ``channels`` holds the port of a channel with its weight; ``size`` is "rms" or "largest".
    """

    name: str
    doc: str
    channels: tuple[tuple[str, float], ...]
    size: str = "rms"


SCORES = {
    score.name: score
    for score in (
        TrainingScore(
            "seed", "rms contour error [m] + 0.001 rms speed error [m^2/s^2], as published", (("contour_error", 1.0), ("speed_error", 1e-3))
        ),
        TrainingScore("contour", "rms contour error [m]", (("contour_error", 1.0),)),
        TrainingScore("largest", "largest contour error [m]", (("contour_error", 1.0),), "largest"),
        TrainingScore("even", "rms contour error [m] + 0.1 rms speed error [m^2/s^2]", (("contour_error", 1.0), ("speed_error", 0.1))),
    )
}
"""The scores, by name."""


def score_named(name: str) -> TrainingScore:
    """Return a score; :class:`LessonError` with the nearest name where there is none."""
    if name not in SCORES:
        raise LessonError(f"there is no score '{name}'.", remedy=nearest(name, SCORES) or f"Scores: {', '.join(SCORES)}.")
    return SCORES[name]


def size_of(values: FloatArray, how: str) -> float:
    """Return the size of a channel: root mean square, or the largest magnitude."""
    if not np.all(np.isfinite(values)):
        return float("inf")
    return float(np.max(np.abs(values))) if how == "largest" else float(np.sqrt(np.mean(values * values)))


def total(score: TrainingScore, traces: Sequence[FloatArray]) -> float:
    """Return the score of one run from the traces of its channels."""
    return sum(weight * size_of(trace, score.size) for (_, weight), trace in zip(score.channels, traces, strict=True))


@dataclass(frozen=True)
class AsScored(Weighting):
    """Traces, shape (situations, channels, samples), as they count: the squares add up to the mean score over the situations.

        rms = sum_k (x_k / sqrt(N rms))^2,    largest = (x_l / sqrt(|x_l|))^2 at its sample l

    Divided by the sizes at one place, their slopes are those of the score there; the second derivatives of the traces are left out.
    """

    score: TrainingScore

    def power(self, residual: FloatArray) -> float:
        """Return the mean score; infinity where a run diverged."""
        return float(np.mean([total(self.score, traces) for traces in residual]))

    def white(self, residual: FloatArray) -> FloatArray:
        """Return the traces divided by the roots of their sizes, shape (numbers,)."""
        return np.asarray(self.white_slopes(residual[None], residual)[:, 0])

    def white_slopes(self, slopes: FloatArray, residual: FloatArray) -> FloatArray:
        """Return slopes of traces divided by the roots of the sizes at ``residual``, shape (numbers, weights)."""
        rows = []
        for situation, traces in enumerate(residual):
            for channel, (_, weight) in enumerate(self.score.channels):
                trace, changes = traces[channel], slopes[:, situation, channel]
                size = max(size_of(trace, self.score.size), _TINY)
                if self.score.size == "largest":
                    place = int(np.argmax(np.abs(trace)))
                    trace, changes = trace[place : place + 1], changes[:, place : place + 1]
                rows.append(changes * math.sqrt(weight / (trace.size * size * len(residual))))
        return np.concatenate(rows, axis=1).T


WEIGHTS = "weights"
"""Name of the table that holds the weights of a regulator."""
_DIFFERENCE = 1e-6
"""Change of a weight by which the traces' slopes are taken; weights are about one."""


@dataclass(frozen=True)
class TrainingQuestion:
    """What is trained: ``part.weights`` of one plan, in several ``situations`` (names, and their values of ``names``).

    ``steps`` integration steps a sample are taken while searching, fewer than the lesson's; the answer is judged with the lesson's own.
    """

    table: str
    shape: NetworkShape
    score: TrainingScore
    batch: Batch
    names: tuple[str, ...]
    situations: tuple[str, ...]
    values: FloatArray
    places: tuple[int, ...]
    steps: int

    def scores(self, vectors: Sequence[FloatArray], *, exact: bool = False) -> FloatArray:
        """Return the score of each vector in each situation, shape (vectors, situations); one that diverges scores infinity."""
        scores = self._runs(vectors, exact, lambda record: total(self.score, [record[place] for place in self.places]))
        return np.array(scores).reshape(len(vectors), len(self.situations))

    def slopes(self, vector: FloatArray) -> tuple[float, FloatArray]:
        """Return the mean score over the situations and its gradient, from one batch of runs."""
        here, scored = self.problem.begin(vector), AsScored(self.score)
        assert here.slopes is not None
        value = scored.power(here.residual)
        if not (math.isfinite(value) and np.all(np.isfinite(here.slopes))):
            return math.inf, np.zeros_like(vector)
        return value, -scored.white(here.residual) @ scored.white_slopes(here.slopes, here.residual)

    @functools.cached_property
    def problem(self) -> Problem:
        """The traces of the score by the weights, for a fit."""
        count = self.shape.weights
        free = [Free(f"{self.table}.{place}", 0.0, 1.0) for place in range(count)]
        return Problem(lambda rows: self._traces(rows, False), free, steps=lambda values, before: np.full(count, _DIFFERENCE))

    def _traces(self, vectors: Sequence[FloatArray] | FloatArray, exact: bool) -> list[FloatArray]:
        """Return the traces of each vector of weights, shape (situations, channels, samples)."""
        runs, count = self._runs(vectors, exact, lambda record: record[list(self.places)]), len(self.situations)
        return [np.array(runs[first : first + count]) for first in range(0, len(runs), count)]

    def _runs(self, vectors: Sequence[FloatArray] | FloatArray, exact: bool, reduce: Reduce) -> list[Any]:
        """Return what is made of each run, the situations of one vector of weights after the other's."""
        tables = [self.shape.table(vector) for vector in vectors for _ in self.situations]
        rows = np.tile(self.values, (len(vectors), 1))
        batch = self.batch if exact else replace(self.batch, steps_per_sample=self.steps)
        return batch.run(self.names, rows, reduce, {self.table: tables})


def question_of(lesson: Lesson, registry: Registry, variants: Sequence[str], score: TrainingScore, shape: NetworkShape) -> TrainingQuestion:
    """Return the question of a lesson: its regulator, scored in some of its variants (without any: in the lesson as it stands).

    Raises :class:`LessonError` where no part has a table of weights, where a channel of the score is missing, where the run has no
    duration, or where the variants differ in more than values.
    """
    cases = [prepare(lesson, registry, variant) for variant in variants] or [prepare(lesson, registry)]
    first = cases[0]
    table = _table_of(first, lesson)
    names = tuple(sorted({name for case in cases for name in _values(case)}))
    values = [_values(case) for case in cases]
    for case, variant in zip(cases[1:], variants[1:], strict=False):
        if list(case.plan.parts) != list(first.plan.parts) or case.plan.feeds != first.plan.feeds:
            fact = f"the variants {variants[0]} and {variant} differ in parts or wires, and one batch trains them together."
            raise LessonError(fact, place=str(lesson.path), remedy="Train on variants that differ in values only.")
    default = first.plan.values
    rows = np.array([[item.get(name, default[name]) for name in names] for item in values]).reshape(len(cases), len(names))
    if first.duration is None:
        raise LessonError("a regulator is trained on runs of one length, and the lesson has none.", place=str(lesson.path),
                          remedy="Write 'duration: 10 s'.")  # fmt: skip
    samples = round(first.duration / first.machinery.sample_period) + 1
    places = tuple(_channel(first, port, lesson) for port, _ in score.channels)
    batch = Batch(first.plan, samples, seed=first.case.seed)
    return TrainingQuestion(table, shape, score, batch, names, tuple(variants) or (lesson.name,), rows, places, _fewest_steps(first))


def _table_of(prepared: Prepared, lesson: Lesson) -> str:
    found = [part.name for part in prepared.machinery.parts if WEIGHTS in part.component.declared(Table)]
    if len(found) != 1:
        told = f"parts with a table of weights: {', '.join(found)}" if found else "no part has a table of weights"
        raise LessonError(f"{told}, and one is trained.", place=str(lesson.path), remedy="Put one NeuralRegulator into the machine.")
    return f"{found[0]}.{WEIGHTS}"


def _channel(prepared: Prepared, port: str, lesson: Lesson) -> int:
    for place, name in enumerate(prepared.plan.channels):
        if Place.of(name).port == port:
            return place
    raise LessonError(f"the machine records no channel '*.{port}', which the score needs.", place=str(lesson.path),
                      remedy="Choose another --score.")  # fmt: skip


def _values(case: Prepared) -> dict[str, float]:
    """Return the values and starts of a case by name."""
    found = {f"{part.name}.{name}": value for part in case.machinery.parts for name, value in {**part.parameters, **part.start}.items()}
    return {name: value for name, value in found.items() if name not in case.plan.feeds}


def _fewest_steps(prepared: Prepared) -> int:
    """Return the fewest integration steps a sample with which the machine is still stable, with one to spare."""
    most = prepared.plan.assembly.steps_per_sample
    for steps in range(1, most):
        coarser = wire(replace(prepared.machinery, step=prepared.machinery.sample_period / steps))
        try:
            Batch(coarser, 1).check_step()
        except WiringError:
            continue
        return steps
    return most
