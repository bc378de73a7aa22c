"""The course: every shipped lesson has its place in it, and the names that lessons had before lead to them."""

from __future__ import annotations

import typing
from pathlib import Path

import pytest

from lathesim.errors import LessonError
from lathesim.lessons.lesson import Lesson, by_unit, find_lesson, former_names, load_lesson
from lathesim.lessons.schema import CourseUnit
from lathesim.lessons.simulate import check_lesson
from lathesim.plugins import load_registry
from lathesim.shipped import shipped_files
from lathesim.tui.model.student_book import StudentBook


@pytest.fixture(scope="module")
def course() -> list[Lesson]:
    return [load_lesson(path) for path in shipped_files("lesson_configs", "*.yaml")]


def test_every_lesson_says_its_unit_minutes_level_and_what_is_learnt(course: list[Lesson]) -> None:
    for lesson in course:
        settings = lesson.settings
        assert settings.unit is not None, lesson.name
        assert settings.level is not None, lesson.name
        assert settings.minutes is not None, lesson.name
        assert 15 <= settings.minutes <= 120, lesson.name
        assert 1 <= settings.learn.count(".") <= 2, lesson.name


def test_the_numbers_follow_the_units(course: list[Lesson]) -> None:
    ordered = [lesson.name for members in by_unit(course).values() for lesson in members]
    assert ordered == [lesson.name for lesson in course]
    assert list(by_unit(course)) == list(typing.get_args(CourseUnit))


def test_what_comes_before_exists_and_has_a_smaller_number(course: list[Lesson]) -> None:
    names = [lesson.name for lesson in course]
    for place, lesson in enumerate(course):
        assert set(lesson.settings.after) <= set(names[:place]), lesson.name
        assert lesson.settings.after or lesson is course[0], lesson.name


def test_the_first_plot_of_a_lesson_shows_what_its_goals_are_about(course: list[Lesson]) -> None:
    """Without a plot of its own, a lesson shows its contour error."""
    for lesson in course:
        on_the_contour = any(word in goal.metric for goal in lesson.settings.goals for word in ("contour", "path", "deviation"))
        assert lesson.settings.plot or on_the_contour, lesson.name


def test_the_hints_of_a_lesson_come_in_steps(course: list[Lesson]) -> None:
    assert [lesson.name for lesson in course if not any(len(goal.hint) > 1 for goal in lesson.settings.goals)] == []


def test_a_former_name_leads_to_the_lesson(course: list[Lesson], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names = {lesson.name for lesson in course}
    assert set(former_names().values()) <= names
    assert not set(former_names()) & names
    assert {former: find_lesson(former).stem for former in former_names()} == former_names()


def test_progress_under_a_former_name_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "book.json"
    path.write_text('{"lessons": {"05_integral_windup": {"tries": 3, "last": "", "best": {}}}}', encoding="utf-8")
    assert StudentBook(path).entry("03_integral_windup").tries == 3


def test_a_lesson_that_comes_after_an_unknown_one_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("lesson: Mine\nafter: [01_contour_eror]\nmachine: two_axis_lathe\n", encoding="utf-8")
    with pytest.raises(LessonError, match=r"mine.yaml:2:9: there is no lesson '01_contour_eror'. Did you mean '01_contour_error'\?"):
        check_lesson(load_lesson(path), load_registry(installed=False))
