"""The runs of a shipped lesson: each case simulated once, its metrics and goals, and golden channels held against it."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence

import pytest

from lathesim.analysis.metric import Measurements, measure
from lathesim.errors import SimulationError
from lathesim.lessons.grading import GoalResult, judge_run
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.lessons.simulate import simulate
from lathesim.plugins import Registry, load_registry
from lathesim.record import Record

Golden = Mapping[str, tuple[float, Sequence[float]]]
"""Channel -> tolerance and values [SI] at some times."""


class Runs:
    """The cases of a lesson; with ``""`` for the lesson as it stands. Each is run when it is first asked for."""

    def __init__(self, name: str) -> None:
        self.lesson: Lesson = load_lesson(name)
        self.registry: Registry = load_registry(installed=False)

    @functools.cache  # noqa: B019 - one object a test module
    def record(self, variant: str = "", overrides: tuple[tuple[str, str], ...] = ()) -> Record:
        """Return the record of a case; of one that breaks down what was simulated until then."""
        try:
            return simulate(self.lesson, self.registry, variant or None, dict(overrides), engine="compiled")
        except SimulationError as error:
            assert isinstance(error.record, Record)
            return error.record

    @functools.cache  # noqa: B019
    def measured(self, variant: str = "", overrides: tuple[tuple[str, str], ...] = ()) -> Measurements:
        """Return the metrics of a case."""
        return measure(self.record(variant, overrides), self.registry.metrics)

    def value(self, metric: str, variant: str = "", **settings: str) -> float:
        """Return a metric of a case [SI], with settings (``x_dac__bits="12"`` for x_dac.bits)."""
        overrides = tuple((name.replace("__", "."), text) for name, text in settings.items())
        return self.measured(variant, overrides).values[metric].value

    def goals(self, variant: str = "") -> tuple[GoalResult, ...]:
        """Return the goals of the lesson held against a case."""
        return judge_run(self.lesson.settings.goals, self.measured(variant), self.record(variant).status).goals

    def goals_met(self, variant: str = "") -> str:
        """Return for each goal ``+`` where it is met and ``-`` where it is missed."""
        return "".join("+" if goal.met else "-" for goal in self.goals(variant))

    def check_goals(self, stated: Mapping[str, str]) -> None:
        """Hold every case against which of its goals are stated to be met."""
        assert {variant: self.goals_met(variant) for variant in self.lesson.variants or ("",)} == stated

    def check_golden(self, golden: Golden, times: Sequence[float], variant: str = "") -> None:
        """Hold the channels of a case against their golden values."""
        record = self.record(variant)
        samples = [round(time / record.sample_period) for time in times]
        for channel, (tolerance, values) in golden.items():
            assert record[channel][samples] == pytest.approx(values, abs=tolerance), channel
