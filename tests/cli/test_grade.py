"""``lathesim grade``: one record in full, a whole class as one table, and files at fault as rows."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from lathesim.record import Channel, Record
from lathesim.record_writer import save
from tests.cli.command import PUSHED, call, done, json_of

LESSON = """\
lesson: A table that is pushed
machine: pushed
duration: 1 s
goals:
  - {metric: max_contour_error, at_most: 0.4 mm, hint: Raise the gain.}
  - {metric: cycle_time, at_most: 2 s}
variants: {soft: {}, stiff: {}}
"""


def write_record(name: str, error: float, *, lesson: str = LESSON, **meta: str) -> Path:
    """Write a record of a second in contact with a contour error [m]."""
    time = np.arange(0.0, 1.005, 0.005)
    channels = {
        "cutting.in_contact": Channel("cutting.in_contact", "1", np.ones_like(time)),
        "contour.contour_error": Channel("contour.contour_error", "m", np.full_like(time, error)),
    }
    told = {"lesson": lesson, "lesson_name": "pushed_table", "variant": "soft", "status": "complete", "sample_period": 0.005}
    save(Record(time, channels, {**told, **meta}), name)
    return Path(name)


@pytest.fixture(autouse=True)
def in_a_folder_with_a_lesson() -> None:
    Path("pushed_table.yaml").write_text(LESSON, encoding="utf-8")
    Path("pushed.yaml").write_text(PUSHED, encoding="utf-8")


def test_one_record_is_told_in_full_with_hints(capsys: pytest.CaptureFixture[str]) -> None:
    write_record("run.h5", 0.5e-3)
    said = call(capsys, "grade", "pushed_table.yaml", "run.h5")
    assert (said.code, said.err) == (0, "")
    assert said.out == (
        "run.h5: pushed_table, case soft\n"
        "\n"
        "goal               limit           reached\n"
        "-----------------  --------------  -------  -----------------------\n"
        "max contour error  at most 0.4 mm  0.5 mm   missed by 0.1 mm (25 %)\n"
        "cycle time         at most 2 s     1 s      met\n"
        "Hint: Raise the gain.\n"
        "\n"
        "1 of 2 goals met: missed.\n"
    )


def test_the_lesson_of_the_record_is_found_by_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    write_record("run.h5", 0.3e-3)
    assert call(capsys, "grade", "run.h5").out.endswith("2 of 2 goals met: met.\n")


def test_a_lesson_that_is_nowhere_is_taken_from_the_record(capsys: pytest.CaptureFixture[str]) -> None:
    write_record("run.h5", 0.3e-3, lesson_name="lost")
    assert call(capsys, "grade", "run.h5").out.endswith("2 of 2 goals met: met.\n")


def test_json(capsys: pytest.CaptureFixture[str]) -> None:
    write_record("run.h5", 0.5e-3, overrides="table.mass=2 kg")
    result = json_of(capsys, "grade", "pushed_table.yaml", "run.h5", "--json")
    assert (result["schema"], result["lesson"]) == ("lathesim-grade/1", "pushed_table")
    (graded,) = result["records"]
    assert (graded["result"], graded["goals_met"], graded["variant"]) == ("missed", 1, "soft")
    assert graded["goals"][0] == {
        "metric": "max_contour_error",
        "sense": "at most",
        "limit": "0.4 mm",
        "value": pytest.approx(0.5),
        "unit": "mm",
        "missed_by": pytest.approx(0.1),
        "met": False,
        "hint": "Raise the gain.",
        "reason": "",
    }
    assert graded["notes"] == ["Set: table.mass=2 kg."]


def test_a_class_becomes_one_table_with_the_best_first_and_the_damaged_file_in_a_row(capsys: pytest.CaptureFixture[str]) -> None:
    write_record("anna.h5", 0.5e-3)
    write_record("bert.h5", 0.2e-3)
    write_record("cleo.h5", 0.1e-3, status="stopped")
    write_record("dora.h5", 0.3e-3)
    write_record("emil.h5", 0.1e-3, lesson=LESSON.replace("is pushed", "is pulled"), lesson_name="pulled")
    Path("finn.h5").write_bytes(b"torn")
    names = [f"{name}.h5" for name in ("anna", "bert", "cleo", "dora", "emil", "finn")]
    said = call(capsys, "grade", "pushed_table.yaml", *names, "--csv")
    assert (said.code, said.err) == (1, "")
    rows = list(csv.DictReader(io.StringIO(said.out)))
    assert [(row["record"], row["result"]) for row in rows] == [
        ("bert.h5", "met"),
        ("dora.h5", "met"),
        ("anna.h5", "missed"),
        ("cleo.h5", "not finished"),
        ("emil.h5", "another lesson"),
        ("finn.h5", "unreadable"),
    ]
    assert rows[0]["max_contour_error [mm] at most 0.4 mm"] == "0.2"
    assert rows[3]["notes"] == "The run was not finished: stopped."
    assert rows[4]["notes"] == "The record is of another lesson: 'A table that is pulled' (pulled)."
    assert rows[5]["notes"] == "the file is not HDF5, or it is damaged. Run the lesson again to make the record anew."
    table = call(capsys, "grade", "pushed_table.yaml", *names).out
    assert table.endswith("2 of 6 records meet all goals.\n")
    assert "0.5 mm !" in table


def test_a_run_that_was_stopped_meets_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    write_record("run.h5", 0.1e-3, status="stopped")
    said = call(capsys, "grade", "pushed_table.yaml", "run.h5")
    assert "cycle time         at most 2 s     1 s      not met: the run was not finished" in said.out
    assert said.out.endswith("0 of 2 goals met: not finished.\n")
    (graded,) = json_of(capsys, "grade", "pushed_table.yaml", "run.h5", "--json")["records"]
    assert (graded["goals_met"], [goal["met"] for goal in graded["goals"]]) == (0, [False, False])


def test_what_a_student_changed_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    own = LESSON.replace("0.4 mm", "4 mm").replace("duration: 1 s", "duration: 2 s")
    write_record("run.h5", 0.5e-3, lesson=own)
    said = call(capsys, "grade", "pushed_table.yaml", "run.h5")
    assert "Its copy of the lesson differs in duration, goals." in said.out
    assert "0 of 2" not in said.out and "1 of 2 goals met: missed." in said.out


def test_text_from_a_record_stays_text_in_a_spreadsheet_and_on_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    write_record("run.h5", 0.3e-3, variant="=1+1", overrides="a\x1b[2Jb")
    row = next(csv.DictReader(io.StringIO(call(capsys, "grade", "pushed_table.yaml", "run.h5", "--csv").out)))
    assert row["variant"] == "'=1+1"
    assert "\x1b" not in row["notes"]


def test_a_metric_that_the_record_lacks_misses_its_goal_with_the_reason(capsys: pytest.CaptureFixture[str]) -> None:
    time = np.arange(3.0)
    save(Record(time, {}, {"lesson": LESSON, "lesson_name": "pushed_table", "status": "complete"}), "bare.h5")
    said = call(capsys, "grade", "pushed_table.yaml", "bare.h5")
    assert "max contour error  at most 0.4 mm  -        not reached: not available: needs channel" in said.out


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (["pushed_table.yaml"], 2, "no record is named beside 'pushed_table.yaml'."),
        (["pushed_tabel", "run.h5"], 1, "there is no lesson 'pushed_tabel'."),
        (["wrong.yaml", "run.h5"], 1, "wrong.yaml:3:18: there is no metric 'max_contour_eror'. Did you mean 'max_contour_error'?"),
        (["wrong_unit.yaml", "run.h5"], 1, "wrong_unit.yaml:3:46: '0.4 s' is given in s, but m is wanted. Use a unit like m."),
    ],
)
def test_what_is_refused(arguments: list[str], code: int, sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    start = "lesson: L\nmachine: pushed\n"
    Path("wrong.yaml").write_text(f"{start}goals: [{{metric: max_contour_eror, at_most: 0.4 mm}}]\n", encoding="utf-8")
    Path("wrong_unit.yaml").write_text(f"{start}goals: [{{metric: max_contour_error, at_most: 0.4 s}}]\n", encoding="utf-8")
    said = call(capsys, "grade", *arguments)
    assert said.code == code
    assert sentence in said.err


def test_a_run_of_a_shipped_lesson_is_graded(capsys: pytest.CaptureFixture[str]) -> None:
    Path("short.nc").write_text("G90 G94 G71\nG00 X17 Z14\nM03 S1000 G01 Z20 F60\nM30\n", encoding="utf-8")
    call(capsys, "run", "01_contour_error", "--variant", "II", "--plain", "--no-plots", "--program", "short.nc", "--out", "run.h5")
    said = done(capsys, "grade", "01_contour_error", "run.h5")
    assert "Another part program: short.nc." in said.out
    assert "\n1 of 1 goals met: met.\n" in said.out
