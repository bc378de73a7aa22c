"""Subprograms of Fanuc: called, repeated, nested, with their own lines, and refused where they are missing or endless."""

from __future__ import annotations

import pytest

from lathesim.errors import ProgramError
from lathesim.program import flow
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Program
from lathesim.program.words import read_program

GROOVE = "O0012\nG01 U-4. F0.1\nG00 U4.\nW-5.\nM99\n"


def run(main: str, further: str = GROOVE) -> Program:
    return interpret(read_program(f"O0001\nG21 G99 G97 S800 M03\nG00 X42. Z0.\n{main}M30\n{further}%\n"), "fanuc")


@pytest.mark.parametrize("call", ["M98 P12 L3\n", "M98 P30012\n", "M98 P0012\nM98 P12\nM98 P12\n"])
def test_a_subprogram_is_repeated_from_where_the_tool_stands(call: str) -> None:
    program = run(call)
    assert [round(move.end_z, 6) for move in program.moves if move.kind == "feed"] == [0.0, -0.005, -0.010]
    assert program.moves[-1].end_z == pytest.approx(-0.015)
    assert program.moves[1].line == 7 + call.count("\n") - 1
    assert program.warnings == ()


def test_a_subprogram_calls_another() -> None:
    program = run("M98 P20\n", f"O0020\nM98 P12\nM98 P12\nM99\n{GROOVE}")
    assert sum(move.kind == "feed" for move in program.moves) == 2


def test_a_cycle_in_a_subprogram_finds_its_own_contour() -> None:
    roughing = "O0030\nG71 U2. R0.5\nG71 P10 Q20 U0.4 W0.1 F0.2\nN10 G00 X20.\nG01 Z-20.\nN20 X42.\nM99\n"
    program = run("G00 Z2.\nM98 P30\n", roughing)
    assert {move.mode.cycle for move in program.moves} == {"", "G71"}


@pytest.mark.parametrize(
    ("main", "further", "sentence"),
    [
        ("M98 P13\n", GROOVE, "O0013, which the file does not have. It has O0012."),
        ("M98\n", GROOVE, "needs the number of a program"),
        ("M98 P12\n", "O0012\nM98 P12\nM99\n", "programs deep"),
        ("M98 P12 L10000\n", GROOVE, "repeats 10000 times"),
        ("M98 P20 L9999\n", "O0020\nM98 P21 L9999\nM99\nO0021\nG04 P1\nM99\n", "run more than 2000 blocks"),
    ],
)
def test_a_call_that_cannot_be_made_is_refused(main: str, further: str, sentence: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flow, "MOST_RUNS", 2000)
    with pytest.raises(ProgramError) as refused:
        run(main, further)
    assert sentence in str(refused.value)


def test_m99_ends_the_main_program_once_and_says_so() -> None:
    program = interpret(read_program("G21 G99 G97 S500 M03\nG00 X40. Z2.\nM99\n", "turn.nc"), "fanuc")
    assert len(program.moves) == 1
    assert [warned.sentence for warned in program.warnings] == [
        "M99 in the main program begins it again on a machine; here it ends the program."
    ]


def test_m99_with_p_in_the_main_program_goes_to_that_block() -> None:
    program = interpret(read_program("G21 G99 G97 S500 M03\nM99 P90\nG00 X40. Z2.\nN90 G00 X50. Z5.\nM30\n", "turn.nc"), "fanuc")
    assert [(move.end_x, move.end_z) for move in program.moves] == [(pytest.approx(0.025), pytest.approx(0.005))]
    assert program.warnings == ()
