"""A lesson as a question of training: one plan, the table to be found, and the situations it is scored in."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lathesim.compensation.training.network import Shape
from lathesim.compensation.training.score import AsScored, Score, total
from lathesim.component import Table
from lathesim.engine.assembly import FloatArray
from lathesim.engine.running.batch import Batch, Reduce
from lathesim.engine.wiring import wire
from lathesim.errors import LessonError, WiringError
from lathesim.identification.estimation.fit import Problem
from lathesim.identification.records.fit import Free
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry

WEIGHTS = "weights"
"""Name of the table that holds the weights of a regulator."""
_DIFFERENCE = 1e-6
"""Change of a weight by which the traces' slopes are taken; weights are about one."""


@dataclass(frozen=True)
class Question:
    """What is trained: ``part.weights`` of one plan, in several ``situations`` (names, and their values of ``names``).

    ``steps`` integration steps a sample are taken while searching, fewer than the lesson's; the answer is judged with the lesson's own.
    """

    table: str
    shape: Shape
    score: Score
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


def question_of(
    lesson: Lesson, registry: Registry, variants: Sequence[str], score: Score, shape: Shape, *, seed: int | None = None
) -> Question:
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
    default = _values_of_plan(first)
    rows = np.array([[item.get(name, default[name]) for name in names] for item in values]).reshape(len(cases), len(names))
    if first.duration is None:
        raise LessonError("a regulator is trained on runs of one length, and the lesson has none.", place=str(lesson.path),
                          remedy="Write 'duration: 10 s'.")  # fmt: skip
    samples = round(first.duration / first.machinery.sample_period) + 1
    places = tuple(_channel(first, ending, lesson) for ending, _ in score.channels)
    batch = Batch(first.plan, samples, seed=first.case.seed if seed is None else seed)
    steps = _fewest_steps(first)
    return Question(table, shape, score, batch, names, tuple(variants) or (lesson.name,), rows, places, steps)


def _table_of(prepared: Prepared, lesson: Lesson) -> str:
    found = [part.name for part in prepared.machinery.parts if WEIGHTS in part.component.declared(Table)]
    if len(found) != 1:
        told = f"parts with a table of weights: {', '.join(found)}" if found else "no part has a table of weights"
        raise LessonError(f"{told}, and one is trained.", place=str(lesson.path), remedy="Put one NeuralRegulator into the machine.")
    return f"{found[0]}.{WEIGHTS}"


def _channel(prepared: Prepared, ending: str, lesson: Lesson) -> int:
    for place, name in enumerate(prepared.plan.channels):
        if name.endswith(ending):
            return place
    raise LessonError(f"the machine records no channel '*{ending}', which the score needs.", place=str(lesson.path),
                      remedy="Choose another --score.")  # fmt: skip


def _values(case: Prepared) -> dict[str, float]:
    """Return the values and starts of a case by name."""
    found = {f"{part.name}.{name}": value for part in case.machinery.parts for name, value in {**part.parameters, **part.start}.items()}
    return {name: value for name, value in found.items() if name not in case.plan.feeds}


def _values_of_plan(case: Prepared) -> dict[str, float]:
    plan = case.plan
    known = dict(zip(plan.parameters, plan.parameter_values, strict=True))
    known |= dict(zip(plan.states, plan.start_states, strict=True))
    known |= dict(zip(plan.discrete, plan.start_discrete, strict=True))
    return known


def _fewest_steps(prepared: Prepared) -> int:
    """Return the fewest integration steps a sample with which the machine is still stable, with one to spare."""
    most = prepared.plan.steps_per_sample
    for steps in range(1, most):
        coarser = wire(replace(prepared.machinery, step=prepared.machinery.sample_period / steps))
        try:
            Batch(coarser, 1).check_step()
        except WiringError:
            continue
        return steps
    return most
