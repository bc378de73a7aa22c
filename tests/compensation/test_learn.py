"""Learning from lap to lap: the published numbers, the floor, and what happens without the filter."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lathesim.compensation.lap_response import learning_filter, path_frame
from lathesim.compensation.laps import course_of
from lathesim.compensation.learn import Learning, learn
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, simulate
from lathesim.plugins import load_registry
from lathesim.record import Record
from tests.cli.command import done, json_of, refused

RMS_MM = (0.578, 0.173, 0.052, 0.016)
"""Tracking errors of the first laps, from a prototype."""


def learned(variant: str, laps: int, *, model: str | None = None, filtered: bool = True) -> Learning:
    lesson, registry = load_lesson("09_learning"), load_registry()
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


def test_axes_that_a_coupling_ties_learn_along_the_path_and_across_it() -> None:
    """Delay, friction and steps besides: the response of both axes together is inverted, and the steps are the floor."""
    lesson, registry = load_lesson("28_neural_regulator"), load_registry()
    course = course_of(prepare(lesson, registry, "hard_coupled"), "voltage")
    chosen = learning_filter(course)
    learning = learn(course, chosen, 10)
    assert chosen.frame is not None
    assert chosen.bound < 0.35
    assert all(lap.rms <= 1.1 * most for lap, most in zip(learning.laps[1:7], learning.predicted, strict=False))
    assert learning.laps[learning.best].largest < 0.2 * learning.laps[0].largest
    assert "one level of the converter is 4.88 mV" in learning.why


def test_the_directions_of_a_path_are_those_of_a_circle_and_hold_where_it_stands() -> None:
    angle = np.linspace(0.0, 2.0, 200)
    frame = path_frame(np.stack([np.cos(angle), np.sin(angle)]))
    assert np.allclose(frame[100], [[-np.sin(angle[100]), -np.cos(angle[100])], [np.cos(angle[100]), -np.sin(angle[100])]], atol=1e-3)
    standing = path_frame(np.array([[0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0], [0.0] * 7]))
    assert np.allclose(standing, np.eye(2))


@pytest.mark.slow
def test_friction_and_12_bits_leave_a_fifteenth_in_five_laps() -> None:
    learning = learned("friction_12_bits", 5)
    assert learning.laps[0].largest > 15.0 * learning.laps[5].largest
    assert all(after.rms < before.rms + learning.floor for before, after in zip(learning.laps, learning.laps[1:], strict=False))


def test_what_was_learned_is_a_lesson(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    told = json_of(capsys, "learn", "09_learning", "--variant", "12_bits", "--laps", "2", "--what", "reference", "--json", "--out", out)
    assert told["schema"] == "lathesim-learning/1"
    assert len(told["laps"]) == 3
    assert (out / "x_controller_learned.csv").read_text(encoding="utf-8").startswith("# all columns in ")
    metrics = json_of(capsys, "run", out / "lesson.yaml", "--json", "--out", tmp_path / "r.h5")["metrics"]
    assert metrics["max_path_error"]["value"] == pytest.approx(told["laps"][told["kept"]]["largest_m"], rel=1e-6)


def test_a_machine_without_a_position_loop_has_nothing_to_learn(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        "no part of the machine controls the position of an axis." in refused(capsys, "learn", "28_neural_regulator", "--variant", "R9").err
    )


RECORDED = """
recordings:
  time: {column: time, unit: s}
  drive:
    x_controller.reference: {column: x_asked, unit: m}
    z_controller.reference: {column: z_asked, unit: m}
  compare:
    x_encoder.position: {column: x_read, unit: m}
    z_encoder.position: {column: z_read, unit: m}
"""


def recorded(tmp_path: Path, keep: int | None = None) -> tuple[Path, Path]:
    """Write the lesson with a mapping, and a lap of it as a logger would."""
    source = load_lesson("09_learning")
    (tmp_path / "lesson.yaml").write_text(source.text + RECORDED, encoding="utf-8")
    return tmp_path / "lesson.yaml", logged(simulate(source, load_registry(), "12_bits"), tmp_path / "lap.csv", keep)


def logged(record: Record, place: Path, keep: int | None = None) -> Path:
    """Write a lap as a logger would."""
    names = ("interpolator.x_reference", "interpolator.z_reference", "x_encoder.position", "z_encoder.position")
    rows = [",".join(f"{value:.9f}" for value in row) for row in zip(record.time, *(record[name] for name in names), strict=True)]
    place.write_text("\n".join(["time [s],x_asked [m],z_asked [m],x_read [m],z_read [m]", *rows[:keep]]) + "\n", encoding="utf-8")
    return place


def test_the_next_lap_of_a_recorded_one_is_a_program_that_is_better(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lesson, lap = recorded(tmp_path)
    out = tmp_path / "next"
    asked = ("learn", lesson, "--variant", "12_bits", "--recording", lap, "--out", out)
    assert "0.5799 mm rms; the next one's is predicted to be 0.1712 mm, 0.30 of it." in done(capsys, *asked).out
    second = simulate(load_lesson(out / "lesson.yaml"), load_registry())
    logged(second, lap)
    told = "0.1712 mm rms; the next one's is predicted to be 0.05389 mm, 0.31 of it. No lap is predicted to come below 0.004"
    assert told in done(capsys, *asked).out
    first = simulate(load_lesson("09_learning"), load_registry(), "12_bits")
    errors = [first["interpolator.z_reference"][:3000] - run["z_axis.position"][:3000] for run in (first, second)]
    assert np.sqrt(np.mean(errors[1] ** 2)) < 0.4 * np.sqrt(np.mean(errors[0] ** 2))


def test_a_lap_of_another_length_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lesson, lap = recorded(tmp_path, keep=1000)
    said = refused(capsys, "learn", lesson, "--variant", "12_bits", "--recording", lap, "--out", tmp_path / "next")
    assert "the lap has 1000 samples, and the lesson's has 3548." in said.err


def test_a_lesson_that_has_learned_goes_on_learning(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    before = json_of(capsys, "learn", "09_learning", "--variant", "fine", "--laps", "2", "--out", first, "--json")["laps"]
    after = json_of(capsys, "learn", first / "lesson.yaml", "--laps", "2", "--out", second, "--json")["laps"]
    assert after[0]["largest_m"] == pytest.approx(before[-1]["largest_m"], rel=1e-3)
    assert after[-1]["largest_m"] < 0.3 * after[0]["largest_m"]
    assert (second / "x_controller_learned_2.csv").is_file()


@pytest.mark.parametrize("variant", ["12_bits", "8_bits"])
@pytest.mark.parametrize("what", ["voltage", "reference"])
def test_what_is_predicted_holds_down_to_the_floor(variant: str, what: str, capsys: pytest.CaptureFixture[str]) -> None:
    told = json_of(capsys, "learn", "09_learning", "--variant", variant, "--what", what, "--json")
    reached = [lap["rms_m"] for lap in told["laps"][1:]]
    assert all(found <= most for found, most in zip(reached, told["predicted_at_most_m"], strict=True))
    assert told["predicted_at_most_m"][-1] < 3.0 * min(reached)
