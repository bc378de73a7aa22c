"""Learning from lap to lap: the published numbers, the floor, and what happens without the filter."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from lathesim.cli.main import run_command_line
from lathesim.compensation.learning.laps import course_of
from lathesim.compensation.learning.learn import Learning, learn
from lathesim.compensation.learning.response import learning_filter
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry

RMS_MM = (0.578, 0.173, 0.052, 0.016)
"""Tracking errors of the first laps, from a prototype."""


def learned(variant: str, laps: int, *, model: str | None = None, filtered: bool = True) -> Learning:
    lesson, registry = load_lesson("20_learning"), load_registry()
    course = course_of(prepare(lesson, registry, variant), "voltage")
    own = course if model is None else course_of(prepare(lesson, registry, model), "voltage")
    return learn(course, learning_filter(own, filtered=filtered), laps)


def test_each_lap_is_better_as_predicted_and_the_fifth_is_twenty_times_nearer_to_the_path() -> None:
    learning = learned("fine", 5)
    assert [1e3 * lap.rms for lap in learning.laps[:4]] == pytest.approx(RMS_MM, rel=0.03)
    assert learning.filter.bound == pytest.approx(0.3, abs=0.02)
    assert all(lap.rms <= most for lap, most in zip(learning.laps[1:], learning.predicted, strict=True))
    assert learning.laps[0].largest > 20.0 * learning.laps[5].largest
    assert 1e3 * learning.laps[0].largest == pytest.approx(0.227, rel=0.01)


def test_no_lap_is_worse_by_more_than_the_floor_and_at_8_bits_it_stops_and_says_why() -> None:
    learning = learned("8_bits", 12)
    assert len(learning.laps) < 13
    assert "one level of the converter is 78.4 mV" in learning.why
    assert all(after.rms < before.rms + learning.floor for before, after in zip(learning.laps, learning.laps[1:], strict=False))


def test_without_the_filter_a_machine_that_is_not_its_model_diverges_and_is_stopped() -> None:
    learning = learned("late", 20, model="fine", filtered=False)
    assert len(learning.laps) < 21
    assert learning.laps[-1].rms > learning.laps[learning.best].rms
    assert learned("late", 5, model="fine").laps[-1].rms < 0.01 * learning.laps[0].rms


def test_what_was_learned_is_a_lesson(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [
        "learn",
        "20_learning",
        "--variant",
        "12_bits",
        "--laps",
        "4",
        "--what",
        "reference",
        "--json",
        "--out",
        str(tmp_path / "out"),
    ]
    assert run_command_line(arguments) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["schema"] == "lathesim-learning/1"
    assert len(told["laps"]) == 5
    assert run_command_line(["run", str(tmp_path / "out" / "lesson.yaml"), "--json", "--out", str(tmp_path / "r.h5")]) == 0
    metrics = json.loads(capsys.readouterr().out)["metrics"]
    assert metrics["max_path_error"]["value"] == pytest.approx(told["laps"][told["kept"]]["largest_m"], rel=1e-6)


def test_a_machine_without_a_position_loop_has_nothing_to_learn(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["learn", "19_neural_regulator", "--variant", "R9"]) == 1
    assert "no part of the machine controls the position of an axis." in capsys.readouterr().err
