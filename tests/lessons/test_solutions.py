"""What a teacher keeps: for each shipped lesson the answers to its questions, which stand sealed there, and a run that meets its goals."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from lathesim.analysis.metric import measure
from lathesim.classroom.teacher_notes import teacher_notes, with_tables
from lathesim.lessons.grading import MISSED, REACHED, grade_file, judge_run, yardstick
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.questions import is_right
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import Registry
from lathesim.shipped import shipped_files
from lathesim.stability.lesson_settings import cut_of
from lathesim.stability.lobes import stability_map
from lathesim.units import quantity
from tests.cli.command import call, done


def _asked(name: str) -> list[str]:
    return [question.ask for question in load_lesson(name).settings.questions]


NOTES = {path.stem: teacher_notes(load_lesson(path)) for path in shipped_files("lesson_configs", "*.yaml")}
ANSWERS = {name: dict(zip(_asked(name), [note.answer for note in notes.answers], strict=True)) for name, notes in NOTES.items()}
SOLUTIONS = [name for name, notes in NOTES.items() if notes.solution is not None]
"""Lessons with a run that meets their goals. Lesson 14 has a test of its own; 9 and 30 need files that other commands write."""
PLAIN = (8, 13, 22, 23, 24, 29, 31)
"""Lessons whose machines no other test compiles, and of which two plain runs take less time than the compiler."""


def test_every_lesson_has_a_goal_with_a_hint_and_a_question() -> None:
    for path in shipped_files("lesson_configs", "*.yaml"):
        settings = load_lesson(path).settings
        assert settings.goals, path.name
        assert all(goal.hint for goal in settings.goals), path.name
        assert settings.questions, path.name


@pytest.mark.parametrize("name", ANSWERS)
def test_the_sealed_answers_are_those_that_a_teacher_keeps(name: str) -> None:
    for question in load_lesson(name).settings.questions:
        assert is_right(question, ANSWERS[name][question.ask])
        wrong = [choice for choice in question.choices or () if choice != ANSWERS[name][question.ask]]
        assert not any(is_right(question, choice) for choice in wrong)


def test_the_numbers_follow_from_the_lessons() -> None:
    gain = 0.2245e3 * 18.78e-3
    lowest = min(
        point.limit.width for point in stability_map(cut_of(load_lesson("18_stability_lobes")), range(1000, 7000, 50), "frequency").points
    )
    found = {
        "01_contour_error": (gain, "1/s"),
        "02_quantisation": (20.0 / 4095.0, "V"),
        "04_noise_and_derivative": (2e-6 * math.sqrt(2.0) / 5e-3 * 0.05e3, "V"),
        "06_interpolators_and_corners": (0.15e-3 * 1200.0 / 60.0 / gain, "m"),
        "10_feed_and_roughness": (math.sqrt(1.6e-6 * 32.0 * 0.8e-3), "m"),
        "11_constant_surface_speed": (150.0 / 2400.0 / (2.0 * math.pi), "m"),
        "12_tool_life": (200.0 / 60.0 / (3.0 * (1.0 + 2.0)) ** 0.25, "m/s"),
        "13_process_control": (math.sqrt(1.6e-6 * 32.0 * 0.832e-3), "m"),
        "15_g_code_by_hand": (math.pi * 15e-3 * ((18e-3**2 - 14e-3**2) + (18e-3**2 - 16e-3**2)), "m^3"),
        "18_stability_lobes": (lowest, "m"),
    }
    for name, (value, unit) in found.items():
        (kept,) = [answer for answer in ANSWERS[name].values() if answer[0].isdigit()]
        assert quantity(kept, unit) == pytest.approx(value, rel=2e-3), name


@pytest.mark.parametrize("name", SOLUTIONS)
def test_a_value_of_ones_own_meets_the_goals_and_no_case_does(name: str, registry: Registry, tmp_path: Path) -> None:
    lesson, solution = load_lesson(name), NOTES[name].solution
    assert solution is not None
    program = None
    if solution.program:
        program = tmp_path / "own.nc"
        program.write_text(solution.program, encoding="utf-8")
    engine = "plain" if int(name[:2]) in PLAIN else "compiled"
    results = []
    for own, values, file in ((lesson, {}, None), (with_tables(lesson, solution), dict(solution.set), program)):
        record = run_prepared(prepare(own, registry, solution.variant, values, program=file), engine=engine)
        results.append(judge_run(lesson.settings.goals, measure(record, registry.metrics), record.status).result)
    assert results == [MISSED, REACHED]


@pytest.fixture
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def graded(name: str, file: str, registry: Registry) -> str:
    return grade_file(Path(file), registry, yardstick(name, registry)).result


def test_a_buffer_that_is_full_enough_meets_the_goals_and_an_emptier_one_does_not(
    in_folder: Path, registry: Registry, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [f"{0.005 * step:.3f},{15.0 - 15.0 * math.cos(0.0025 * math.pi * step):.6f}" for step in range(1601)]
    (in_folder / "waves.csv").write_text("\n".join(["t [s],x [mm]", *rows, ""]), encoding="utf-8")
    (in_folder / "limits.yaml").write_text("axes: {x: {velocity: 60 mm/s, acceleration: 500 mm/s^2, jerk: 10 m/s^3}}\n", encoding="utf-8")
    done(capsys, "retime", "waves.csv", "--limits", "limits.yaml", "--jerk", "--out", "s.h5")
    found = []
    for fill in ("20", "100"):
        call(capsys, "stream", "s.h5", "sim:30_how_full_must_a_buffer_be", "--away", "15", "--fill", fill, "--out", f"{fill}.h5")
        found.append(graded("30_how_full_must_a_buffer_be", f"{fill}.h5", registry))
    assert found == [MISSED, REACHED]


@pytest.mark.slow
def test_five_laps_meet_the_goal(in_folder: Path, registry: Registry, capsys: pytest.CaptureFixture[str]) -> None:
    done(capsys, "learn", "09_learning", "--variant", "fine", "--laps", "5", "--out", "learned")
    done(capsys, "run", "learned/lesson.yaml", "--no-plots", "--out", "run.h5")
    assert graded("09_learning", "run.h5", registry) == REACHED
