"""Cycles of many shapes keep their invariants: outside, inside, on the face, with pockets, in inches, in one block and in two."""

from __future__ import annotations

import math

import pytest

from lathesim.program.interpreter import interpret
from lathesim.program.moves import Move, Program
from lathesim.program.words import read_program
from tests.program import cycle_invariants as keeps

HEAD = "G21 G99 G97 S800 M03\nT0101\n"
OUTSIDE = "N10 G00 X20.\nG01 Z0 F0.1\nX24. Z-2.\nZ-20.\nG02 X30. Z-23. R3.\nG01 X36.\nG03 X40. Z-25. R2.\nG01 Z-40.\nX48. Z-50.\nN20 X52.\n"
INSIDE = "N10 G00 X40.\nG01 Z0 F0.1\nX36. Z-2.\nZ-15.\nG03 X30. Z-18. R3.\nG01 X24.\nZ-40.\nN20 X16.\n"
POCKET = "N10 G00 X20. Z2.\nG01 Z-5. F0.1\nX16. Z-10.\nZ-15.\nX24. Z-20.\nX20. Z-25.\nZ-30.\nX40.\nN20 X52.\n"
BACKWARDS = "N10 G00 X20.\nG01 Z-20. F0.1\nX30. Z-10.\nN20 X52.\n"
INCREMENTS = "N10 G00 X20.\nG01 W-12. F0.1\nU4. W-2.\nW-10.\nU10.\nN20 X52.\n"
FED_IN = "N10 G01 X20. F0.1\nZ-20.\nX30.\nZ-30.\nN20 X52.\n"
BEHIND_A_COLLAR = "N10 G00 X16.\nG01 Z1. F0.1\nG03 X18. Z0 R1.\nG01 X22.\nX18. Z-3.\nZ-11.\nX14. Z-14.\nX12. Z-17.\nZ-20.\nN20 X48.\n"
BALL = "N10 G00 X0\nG01 Z0 F0.1\nG03 X30. Z-15. R15.\nG01 Z-25.\nN20 X52.\n"


def run(text: str, head: str = HEAD, dialect: str = "fanuc") -> Program:
    return interpret(read_program(f"{head}{text}M30\n"), dialect)


def of_cycle(program: Program, code: str) -> list[Move]:
    return [move for move in program.moves if move.mode.cycle == code]


@pytest.mark.parametrize(
    ("start", "cycle", "contour", "depth", "allow_x", "allow_z"),
    [
        ("X52. Z2.", "G71 U2. R0.5\nG71 P10 Q20 U0.4 W0.1 F0.3", OUTSIDE, 2.0, 0.2, 0.1),
        ("X52. Z2.", "G71 P10 Q20 U0.4 W0.1 D2000 F0.3", OUTSIDE, 2.0, 0.2, 0.1),
        ("X52. Z2.", "G71 P10 Q20 U0.4 W0.1 D1.5 R1 F0.3", OUTSIDE, 1.5, 0.2, 0.1),
        ("X16. Z2.", "G71 U1.5 R0.5\nG71 P10 Q20 U-0.4 W0.1 F0.3", INSIDE, 1.5, -0.2, 0.1),
        ("X52. Z2.", "G71 U2. R0.5\nG71 P10 Q20 U0.4 W0 F0.3", POCKET, 2.0, 0.2, 0.0),
        ("X52. Z-45.", "G71 U2. R0.5\nG71 P10 Q20 U0.4 W-0.1 F0.3", BACKWARDS, 2.0, 0.2, -0.1),
        ("X52. Z2.", "G71 U2. R0.5\nG71 P0010 Q0020 U0.4 W0.1 F0.3", INCREMENTS, 2.0, 0.2, 0.1),
        ("X52. Z2.", "G71 U3. R0.5\nG71 P10 Q20 U0.4 W0.1 F0.3", FED_IN, 3.0, 0.2, 0.1),
        ("X52. Z2.", "G71 U1. R0.2\nG71 P10 Q20 U0.6 W0 F0.3", BALL, 1.0, 0.3, 0.0),
        ("X52. Z3.", "G71 U1. R0.5\nG71 P10 Q20 U0.2 W0.2 F0.3", BEHIND_A_COLLAR, 1.0, 0.1, 0.2),
    ],
)
def test_roughing_along_z(start: str, cycle: str, contour: str, depth: float, allow_x: float, allow_z: float) -> None:
    program = run(f"G00 {start}\n{cycle}\n{contour}G70 P10 Q20\n")
    finishing = [move for move in of_cycle(program, "G70") if move.kind != "rapid"]
    problems = keeps.roughing(
        of_cycle(program, "G71"), finishing, allow_x=1e-3 * allow_x, allow_z=1e-3 * allow_z, depth=1e-3 * depth
    )  # fmt: skip
    assert problems == []


FACE = "N10 G00 Z-10.\nG01 X40. F0.1\nX36. Z-8.\nZ-4.\nX20.\nN20 Z2.\n"
ROUND_FACE = "N10 G00 Z-12.\nG01 X50. F0.1\nG02 X40. Z-7. R5.\nG01 Z-4.\nX20.\nN20 Z2.\n"
FACE_FROM_INSIDE = "N10 G00 Z-10.\nG01 X30. F0.1\nZ-6.\nX40. Z-4.\nN20 Z2.\n"


@pytest.mark.parametrize(
    ("start", "cycle", "contour", "depth", "allow_x", "allow_z"),
    [
        ("X62. Z2.", "G72 W2. R0.5\nG72 P10 Q20 U0.4 W0.2 F0.2", FACE, 2.0, 0.2, 0.2),
        ("X62. Z2.", "G72 P10 Q20 U0.4 W0.2 D1. F0.2", ROUND_FACE, 1.0, 0.2, 0.2),
        ("X16. Z2.", "G72 W1.5 R0.5\nG72 P10 Q20 U-0.4 W0.2 F0.2", FACE_FROM_INSIDE, 1.5, -0.2, 0.2),
    ],
)
def test_roughing_on_the_face(start: str, cycle: str, contour: str, depth: float, allow_x: float, allow_z: float) -> None:
    program = run(f"G00 {start}\n{cycle}\n{contour}G70 P10 Q20\n")
    finishing = [move for move in of_cycle(program, "G70") if move.kind != "rapid"]
    moves = of_cycle(program, "G72")
    lengths = {"allow_x": 1e-3 * allow_x, "allow_z": 1e-3 * allow_z, "depth": 1e-3 * depth}
    assert keeps.roughing(moves, finishing, across=True, **lengths) == []


def test_linuxcnc_roughs_down_to_a_contour_at_a_distance_and_finishes_it() -> None:
    contour = "O100 SUB\nG0 X5\nG1 Z0\nG1 X6 Z-1\nG1 Z-10\nG2 X9 Z-13 I3\nG1 X12\nG3 X14 Z-15 K-2\nG1 Z-25\nO100 ENDSUB\n"
    program = run(f"{contour}G0 X20 Z2\nG71 Q100 D0.2 I2 R0.5\nG70 Q100 X20 Z2\n", "G21 G18 G90 G94 G8 F100 S500 M3\n", "linuxcnc")
    end = of_cycle(program, "G71")[-1]
    assert (end.end_x, end.end_z) == pytest.approx((0.020, -0.025))
    finishing = of_cycle(program, "G70")
    assert [round(1e3 * move.end_x, 6) for move in finishing if move.kind != "rapid"] == [5.0, 6.0, 6.0, 9.0, 12.0, 14.0, 14.0]
    wall = [point for move in finishing if move.kind != "rapid" for point in keeps.points(move)]
    rough = [point for move in of_cycle(program, "G71") if move.kind != "rapid" for point in keeps.points(move)]
    nearest = [min(math.hypot(x - there[0], z - there[1]) for there in wall[::8]) for x, z in rough[::8]]
    assert min(nearest) == pytest.approx(0.2e-3, abs=5e-5)


def test_a_thread_runs_out_at_45_degrees_where_the_program_says_so() -> None:
    moves = of_cycle(run("G00 X22. Z5.\nG76 P011060 Q50 R0.05\nG76 X18.16 Z-17. P920 Q300 F1.5\n"), "G76")
    out = [move for move in moves if move.kind == "thread"][1::2]
    assert all(move.end_x - move.start_x == pytest.approx(0.0015) for move in out)
    assert all(move.end_z - move.start_z == pytest.approx(-0.0015) for move in out)


def test_drilling_pecks_and_comes_back_to_where_it_began() -> None:
    program = run("G00 X0 Z5.\nG83 Z-20. R2. Q8000 F0.1\nG80\nG00 X50.\n")
    ends = [(move.kind, round(1e3 * move.end_z, 6)) for move in of_cycle(program, "G83")]
    assert ends == [
        ("rapid", 2.0), ("feed", -6.0), ("rapid", 2.0), ("rapid", -5.5), ("feed", -14.0), ("rapid", 2.0), ("rapid", -13.5), ("feed", -20.0),
        ("rapid", 5.0),
    ]  # fmt: skip


def test_linuxcnc_tapers_the_ends_of_a_thread_as_another_interpreter_does() -> None:
    text = "G0 X8 Z4\nG76 P1.25 Z-15 I1 J0.8 K0.9 Q30 E1.5 L1\n"
    moves = run(text, "G21 G18 G90 G8 S500 M3\n", "linuxcnc").moves[1:6]
    ends = [(move.kind, round(1e3 * move.end_x, 4), round(1e3 * move.end_z, 4)) for move in moves]
    assert ends == [
        ("rapid", 7.9, 3.5381), ("thread", 8.9, 3.5381), ("thread", 9.8, 2.0381), ("thread", 9.8, -14.9423), ("rapid", 7.9, -14.9423),
    ]  # fmt: skip
    assert moves[1].feed == pytest.approx(1.457738e-3, abs=1e-9)
