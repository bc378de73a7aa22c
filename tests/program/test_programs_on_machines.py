"""A program on the machine of a lesson: its tools' noses, and what may go wrong when it is cut."""

from __future__ import annotations

from pathlib import Path

import pytest

from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.program_path import program_of, program_warnings, raw_stock, run_warnings
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry
from tests.cli.command import done

PROGRAM = (
    "T0101\nG99 G97 S500 M03\nG00 X60. Z5.\nG42 X30. Z2.\nG01 X36. Z-10. F0.1\nX60.\nG40 G00 X80. Z10.\nX30.\nZ-20.\nG01 X28.\nX60.\nM30\n"
)
LESSON = """lesson: A nose
machine: two_axis_lathe
dialect: fanuc
program: turn.nc
start_point: {{x: 40 mm, z: 10 mm}}
{more}set: {{stock.stock_radius: 20 mm, stock.stock_length: 60 mm, stock.face: -60 mm, stock.free_end: 1}}
"""


def lesson(folder: Path, more: str = "", program: str = PROGRAM) -> Path:
    (folder / "turn.nc").write_text(program, encoding="utf-8")
    path = folder / "turn.yaml"
    path.write_text(LESSON.format(more=more), encoding="utf-8")
    return path


def test_the_tools_of_a_lesson_give_compensation_their_noses(tmp_path: Path) -> None:
    prepared = prepare(load_lesson(lesson(tmp_path, "tools: {1: {nose_radius: 0.8 mm, orientation: 3}}\n")), load_registry())
    program = program_of(prepared.case)
    assert program is not None
    taper = next(move for move in program.moves if move.line == 5)
    assert (taper.start_x, taper.start_z) == (pytest.approx(14.976e-3, abs=1e-6), pytest.approx(1.394e-3, abs=1e-6))
    assert program.warnings == ()


def test_what_may_go_wrong_on_the_machine_is_told_before_it_cuts(tmp_path: Path) -> None:
    prepared = prepare(load_lesson(lesson(tmp_path)), load_registry())
    told = program_warnings(prepared.case, raw_stock(prepared.plan))
    assert [sentence.partition("turn.nc")[2] for sentence in told] == [
        ":3: No G20 or G21 stands before the first move, so millimetres are assumed. Write the units.",
        ":9: The rapid goes into the stock at X 15 mm (radius), Z -0.025 mm. Feed there, or come from outside.",
        ": nose compensation is read with a nose radius of 0: the tool point runs along the programmed path. "
        "Give the tools of the lesson their noses.",
    ]


def test_a_run_tells_it_and_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    short = "G98 G97 S500 M03\nG00 X38. Z5.\nZ-2.\nG01 X36. F900.\nX60.\nM30\n"
    said = done(capsys, "run", str(lesson(tmp_path, program=short)), "--no-plots", "--plain")
    assert "turn.nc:3: The rapid goes into the stock" in said.err


def test_an_axis_that_does_not_stand_where_the_program_starts_is_told(tmp_path: Path) -> None:
    prepared = prepare(load_lesson(lesson(tmp_path)), load_registry(), None, {"z_axis.travel": "10 mm"})
    assert [sentence.partition("turn.nc")[2] for sentence in run_warnings(prepared.case, prepared.plan) if "starts at" in sentence] == [
        ": the program starts at X40 mm (radius), and the axis stands at 0 mm. "
        "Set x_axis.travel: 40 mm in the lesson, or give start_point.",
    ]


def test_axes_that_stand_where_the_program_starts_are_not_told(tmp_path: Path) -> None:
    there = {"x_axis.travel": "40 mm", "z_axis.travel": "10 mm"}
    prepared = prepare(load_lesson(lesson(tmp_path)), load_registry(), None, there)
    assert not [sentence for sentence in run_warnings(prepared.case, prepared.plan) if "starts at" in sentence]
