"""What the laps before a change have shown: values that are known need not be found again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lathesim.identification.replay.loading import uncertainties
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.live.watching.usual import expected_values
from lathesim.live.watching.watch_verdict import Verdict, known_before, told_verdict
from lathesim.plugins import load_registry
from tests.live.servo import prepared as lesson_machine

TIMES = np.arange(60.0, 360.0, 5.0)


def test_a_value_that_stayed_is_expected_to_stay() -> None:
    values = 0.4 + np.random.default_rng(0).normal(size=(len(TIMES), 1)) * 0.02
    found = expected_values(TIMES, values, TIMES[-1] + 15.0)
    assert found.values[0] == pytest.approx(0.4, abs=0.1)
    assert found.deviations[0] < 0.2
    assert expected_values(TIMES, values, TIMES[-1] + 300.0).deviations[0] > 2.0 * found.deviations[0]


def test_a_value_that_wanders_is_expected_as_far_off_as_it_gets() -> None:
    rng, inside = np.random.default_rng(1), 0
    for _ in range(300):
        walk = np.cumsum(rng.normal(size=(len(TIMES) + 8, 1)) * 0.05, axis=0)
        found = expected_values(TIMES, walk[: len(TIMES)], TIMES[-1] + 40.0)
        inside += abs(walk[-1, 0] - found.values[0]) < 1.96 * found.deviations[0]
    assert 0.90 <= inside / 300 <= 1.0


def test_of_one_note_a_value_is_as_unsure_as_a_drift_may_make_it_and_never_more_than_the_lesson_says() -> None:
    one = np.array([[0.5]])
    assert 0.2 < expected_values(TIMES[:1], one, TIMES[0] + 15.0).deviations[0] < 0.6
    assert expected_values(TIMES[:1], one, TIMES[0] + 1000.0).deviations[0] == 1.0


def test_the_lesson_of_a_window_begins_from_the_values_before(tmp_path: Path) -> None:
    ready = lesson_machine()
    before = known_before(ready, {}, {"x_axis.mass": 2.0})
    text = changed_lesson(ready.case.lesson, [], before.values, tmp_path, variant=ready.case.variant)
    place = tmp_path / "window.yaml"
    place.write_text(text, encoding="utf-8")
    again = prepare(load_lesson(str(place)), load_registry([]))
    declared, kept = (uncertainties(item.case.lesson, item.plan) for item in (ready, again))
    mass = [item.plan.values["x_axis.mass"] for item in (ready, again)]
    assert mass[1] - mass[0] == pytest.approx(2.0 * declared["x_axis.mass"], rel=1e-6)
    assert kept["x_axis.viscous"] == pytest.approx(declared["x_axis.viscous"])


def test_a_value_that_moved_is_told_with_what_it_was() -> None:
    value = {"unit": "kg", "given": 95.0, "refit_without": 99.0, "refit_with": 99.0, "low": 98.0, "high": 100.0}
    answer = {"verdict": "parameters_only", "effects": [], "baseline": {"x_axis.mass": value}}
    event = told_verdict(Verdict(answer), 10.0, [], Path("answer.json"), {"x_axis.mass"})
    assert event.sentence == "From t = 10.0 s: x_axis.mass has moved from 95 to 99 kg."
    assert event.data["moved"] == {"x_axis.mass": {"from": 95.0, "to": 99.0, "unit": "kg"}}
    unknown_before = told_verdict(Verdict(answer), 10.0, [], Path("answer.json"))
    assert unknown_before.sentence == "From t = 10.0 s: values of the lesson are off."
