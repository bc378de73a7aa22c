"""The student's book: what counts as met, as ``lathesim grade`` has it, and several apps that write in it."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from textual.widgets import OptionList

from lathesim.analysis.metric import Measured, Measurements
from lathesim.lessons.grading import MISSED, REACHED, UNFINISHED, Judgement, grade_file, judge_run
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
from lathesim.tui.model.student_book import StudentBook
from lathesim.tui.model.workbench import Workbench
from tests.tui.driving import content, opened, until

LESSON = "13_process_control"
GOALS = ("cycle_time at most 10 s", "max_surface_roughness at most 1.6 um")


def judged(cycle_time: float, roughness: float, status: str = "complete") -> Judgement:
    """Return what became of a run of lesson 13."""
    measured = (Measured("cycle_time", cycle_time, "s"), Measured("max_surface_roughness", roughness, "m"))
    return judge_run(load_lesson(LESSON).settings.goals, Measurements({item.name: item for item in measured}), status)


def test_a_lesson_is_met_by_one_run_that_meets_all_goals() -> None:
    book = StudentBook()
    for judgement, result, met in (
        (judged(8.8, 9.6e-6), MISSED, False),
        (judged(13.2, 0.54e-6), MISSED, False),
        (judged(9.5, 1.2e-6, "stopped"), UNFINISHED, False),
        (judged(9.5, 1.2e-6), REACHED, True),
        (judged(13.2, 0.54e-6), MISSED, True),
    ):
        assert judgement.result == result
        book.note(LESSON, judgement)
        assert StudentBook().entry(LESSON).has_met(GOALS) is met
    assert not StudentBook().entry(LESSON).has_met([*GOALS, "cycle_time at most 9 s"])


async def test_the_app_ticks_a_lesson_as_grade_does() -> None:
    """Variant ``adaptive`` is quick and rough, ``none`` slow and smooth: each meets one goal of two."""
    bench = Workbench(lambda: load_registry([]))
    for variant in ("adaptive", "none"):
        bench.open_lesson(LESSON, variant)
        run = bench.new_run()
        run.run(bench.registry)
        graded = grade_file(run.path, bench.registry)
        assert run.kept is not None
        assert run.kept.judgement == Judgement(graded.result, graded.goals)
        assert (graded.result, graded.met) == (MISSED, 1)
        StudentBook().note(LESSON, run.kept.judgement)
    async with opened(LESSON) as (app, pilot):
        await pilot.press("f6")
        await until(pilot, lambda: app.screen.query_one("#lessons", OptionList).option_count > 1, "the lessons")
        listed = app.screen.query_one("#lessons", OptionList)
        assert str(listed.get_option_at_index(listed.highlighted or 0).prompt).startswith("• Process control of the cutt")
        assert "runs so far: 2; no run met all of them together" in content(app, "#goals")


def test_a_damaged_book_is_kept_aside() -> None:
    Path("lathesim_progress.json").write_text("{ not json", encoding="utf-8")
    book = StudentBook()
    assert "kept as lathesim_progress.json.bak" in book.fault
    assert Path("lathesim_progress.json.bak").read_text(encoding="utf-8") == "{ not json"
    assert book.entries == {}


def test_apps_that_share_a_book_lose_no_entry_of_each_other() -> None:
    judgement, books = judged(8.8, 9.6e-6), [StudentBook() for _ in range(4)]

    def noted(place: int) -> None:
        for _ in range(5):
            books[place].note(LESSON, judgement)
            books[place].note(f"own_{place}", judgement)

    with ThreadPoolExecutor(len(books)) as pool:
        list(pool.map(noted, range(len(books))))
    found = StudentBook()
    assert {name: found.entry(name).tries for name in found.entries} == {LESSON: 20, **{f"own_{place}": 5 for place in range(4)}}


def test_a_bench_without_a_lesson_says_so_in_a_sentence() -> None:
    assert Workbench(lambda: load_registry([])).fault() == "There is no lesson on the bench. Choose one."
