"""The cycles hold what they promise: where they begin and end, how deep each pass is, what is left, and that nothing is gouged."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from lathesim.errors import ProgramError
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Move, Program
from lathesim.program.words import read_program

HEAD = "G21 G99 G97 S800 M03\n"
CONTOUR = "N10 G00 X20.\nG01 Z0 F0.1\nX24. Z-2.\nZ-20.\nG02 X30. Z-23. R3.\nG01 X36.\nZ-40.\nX48. Z-50.\nN20 X52.\n"


def run(text: str) -> Program:
    return interpret(read_program(f"{HEAD}{text}M30\n"), "fanuc")


def of_cycle(program: Program, code: str) -> list[Move]:
    found = [move for move in program.moves if move.mode.cycle == code]
    assert found
    ends = [(move.end_x, move.end_z) for move in found]
    assert ends[:-1] == [(move.start_x, move.start_z) for move in found[1:]]
    return found


def test_a_roughing_cycle_of_the_face_goes_down_along_z() -> None:
    text = "G00 X82. Z2.\nG72 W2. R0.5\nG72 P10 Q20 U0.4 W0.2 F0.2\nN10 G00 Z-30.\nG01 X60. F0.1\nX40. Z-20.\nX20.\nZ-10.\nN20 X10. Z2.\n"
    moves = of_cycle(run(text), "G72")
    assert (moves[-1].end_x, moves[-1].end_z) == (0.041, 0.002)
    cuts = [move for move in moves if move.kind == "feed" and move.end_z == move.start_z and abs(move.end_x - move.start_x) > 1e-4]
    levels = sorted({round(move.end_z, 6) for move in cuts}, reverse=True)
    assert all(here - there <= 0.002 + 1e-9 for here, there in zip([0.0022, *levels], levels, strict=False))
    assert min(move.end_z for move in moves) >= -0.030 + 0.0002 - 1e-9


def test_a_pattern_is_repeated_from_far_to_near() -> None:
    moves = of_cycle(run(f"G00 X60. Z5.\nG73 U6. W2. R4\nG73 P10 Q20 U0.4 W0.1 F0.3\n{CONTOUR}"), "G73")
    lowest = [move.end_x for move in moves if move.kind == "rapid" and move.end_x < 0.017]
    assert lowest == pytest.approx([0.010 + 0.0002 + 0.006 * share for share in (1.0, 2.0 / 3.0, 1.0 / 3.0, 0.0)], abs=1e-9)
    assert (moves[-1].end_x, moves[-1].end_z) == (0.030, 0.005)


def test_pecking_goes_in_by_steps_and_out_at_the_start() -> None:
    moves = of_cycle(run("G00 X0. Z2.\nG74 R0.5\nG74 Z-10. Q3000 F0.08\n"), "G74")
    depths = [move.end_z for move in moves if move.kind == "feed"]
    assert depths == pytest.approx([-0.001, -0.004, -0.007, -0.010])
    assert [move.end_z for move in moves if move.kind == "rapid"] == pytest.approx([-0.0005, -0.0035, -0.0065, 0.002])
    assert all(move.feed == pytest.approx(8e-5) for move in moves if move.kind == "feed")


@pytest.mark.parametrize(
    ("text", "code", "longest"),
    [
        ("G00 X20. Z-10.\nG75 X24. Z-14. I0.2 K2. F0.05\n", "G75", 0.2),
        ("G00 X20. Z-10.\nG75 R0.5\nG75 X24. Z-14. I0.2 K2. F0.05\n", "G75", 0.5),
        ("G00 X0. Z0.\nG74 Z-2. K0.3 F0.05\n", "G74", 0.3),
        ("G00 X0. Z0.\nG74 R1.\nG74 Z-2. K0.3 F0.05\n", "G74", 1.0),
    ],
)
def test_no_peck_is_withdrawn_behind_the_start_or_by_more_than_an_assumed_peck(text: str, code: str, longest: float) -> None:
    program = run(text)
    moves = of_cycle(program, code)
    first, deep = moves[0], (lambda move: move.end_x) if code == "G75" else (lambda move: -move.end_z)
    start = first.start_x if code == "G75" else -first.start_z
    assert min(deep(move) for move in moves) >= start - 1e-12
    backs = [deep(before) - deep(move) for before, move in pairwise(moves) if move.kind == "rapid" and deep(move) > start + 1e-12]
    assert max(backs) == pytest.approx(1e-3 * longest)
    assert ("cycle_retract" in program.assumed) == ("R" not in text)


def test_grooving_covers_the_width_by_steps() -> None:
    moves = of_cycle(run("G00 X42. Z-10.\nG75 R0.3\nG75 X30. Z-16. P2000 Q2500 F0.1\n"), "G75")
    places = sorted({round(move.end_z, 6) for move in moves if move.kind == "feed"}, reverse=True)
    assert places == [-0.010, -0.0125, -0.015, -0.016]
    assert min(move.end_x for move in moves) == pytest.approx(0.015)
    assert max(abs(move.end_x - move.start_x) for move in moves if move.kind == "feed") <= 0.0023 + 1e-9
    assert (moves[-1].end_x, moves[-1].end_z) == (0.021, -0.010)


def test_a_thread_is_cut_in_passes_of_equal_area_to_its_root() -> None:
    moves = of_cycle(run("G00 X22. Z5.\nG76 P020060 Q50 R0.05\nG76 X18.16 Z-17. P920 Q300 F1.5\n"), "G76")
    passes = [move for move in moves if move.kind == "thread"]
    depths = np.array([0.00908 + 0.00092 - move.end_x for move in passes])
    assert depths[0] == pytest.approx(0.0003)
    assert depths[1] == pytest.approx(0.0003 * math.sqrt(2.0))
    assert depths[-2:] == pytest.approx([0.00092, 0.00092])
    assert (np.diff(depths)[:-3] >= 0.00005 - 1e-9).all()
    assert all(move.feed == pytest.approx(0.0015) for move in passes)
    starts = np.array([0.005 - move.start_z for move in passes])
    assert starts == pytest.approx(depths * math.tan(math.radians(30.0)))
    assert (moves[-1].end_x, moves[-1].end_z) == (0.011, 0.005)


@pytest.mark.parametrize(
    ("mode", "words"),
    [("G7\nG0 X25 Z5\n", "I-1 J0.2 K1.84"), ("G8\nG0 X12.5 Z5\n", "I-0.5 J0.1 K0.92"), ("G0 X12.5 Z5\nG7 ", "I-1 J0.2 K1.84")],
)
def test_a_thread_of_linuxcnc_counts_its_depths_as_x_does(mode: str, words: str) -> None:
    text = f"G21 G18 G90 G95\nS400 M3\n{mode}G76 P1.5 Z-20 {words} R1 Q0 H0 E0 L0\nM2\n"
    threads = [move.end_x for move in interpret(read_program(text), "linuxcnc").moves if move.kind == "thread"]
    assert (threads[0], threads[-1], len(threads)) == pytest.approx((11.9e-3, 11.08e-3, 10))


def test_words_of_cycles_are_radii_where_positions_are_diameters() -> None:
    taper = of_cycle(run("G00 X42. Z2.\nG90 X40. Z-20. R-1. F0.2\n"), "G90")
    assert taper[0].end_x == pytest.approx(0.019)
    pecks = [move.end_x for move in of_cycle(run("G00 X40. Z2.\nG75 R0.1\nG75 X36. P1000 F0.1\n"), "G75") if move.kind == "feed"]
    assert pecks == pytest.approx([0.019, 0.018])
    pattern = of_cycle(run(f"G00 X60. Z5.\nG73 P10 Q20 U0.4 W0 I3. K0 D2 F0.3\n{CONTOUR}"), "G73")
    assert max(move.end_x for move in pattern[:1]) == pytest.approx(0.010 + 0.0002 + 0.003)


def test_finishing_runs_the_contour_with_its_own_feeds_and_returns() -> None:
    program = run(f"G00 X52. Z2.\nG71 U2. R0.5\nG71 P10 Q20 U0.4 W0.1 F0.3\n{CONTOUR}G70 P10 Q20\n")
    moves = of_cycle(program, "G70")
    assert {round(move.feed or 0.0, 9) for move in moves if move.kind in ("feed", "arc")} == {1e-4}
    assert (moves[-1].end_x, moves[-1].end_z) == (0.026, 0.002)
    assert sum(move.kind == "arc" for move in moves) == 1


def test_a_roughing_cycle_inside_goes_outwards() -> None:
    contour = "N10 G00 X40.\nG01 Z-10. F0.1\nX30. Z-20.\nN20 Z-30.\n"
    moves = of_cycle(run(f"G00 X18. Z2.\nG71 U1.5 R0.5\nG71 P10 Q20 U-0.4 W0.1 F0.2\n{contour}"), "G71")
    cuts = [move for move in moves if move.kind == "feed" and move.start_x == move.end_x]
    assert max(move.end_x for move in cuts) == pytest.approx(0.020 - 0.0002)
    assert max(move.end_x for move in moves) <= 0.020 - 0.0002 + 1e-9


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("G71 P10 Q20 U0.4\n", "names a block N10 that is not there"),
        ("G00 X52. Z2.\nG71 U2. R0.5\nG71 Q20\n", "needs P and Q"),
        (f"G00 X52. Z2.\nG71 P10 Q20 F0.2\n{CONTOUR}", "needs a depth of cut above 0"),
        ("G00 X22. Z5.\nN6 G70 P6 Q6\n", "names the block it stands in"),
        ("G00 X22. Z5.\nG76 X18. Z-17. F1.5\n", "needs the height of the thread"),
        ("G00 X22. Z5.\nG92 X18. Z-17.\n", "needs a lead"),
        ("G00 X0. Z2.\nG74 Z-10000. Q1 F0.1\n", "more than 200000 passes"),
        ("G00 X22. Z5.\nG76 P010060 Q50 R1.\nG76 X18.16 Z-17. P920 Q300 F1.5\n", "finishing allowance of G76 must be below"),
        ("G00 X52. Z2.\nG71 U2. R0.5\nG71 P10 Q20 F0.2\nN10 G00 X20.\nG71 P10 Q20\nN20 X52.\n", "in the contour of a cycle"),
    ],
)
def test_a_cycle_that_says_too_little_is_refused(text: str, sentence: str) -> None:
    with pytest.raises(ProgramError, match=sentence) as refused:
        run(text)
    assert refused.value.place.startswith("program:")
    assert refused.value.remedy


@pytest.mark.parametrize(
    ("text", "key", "said"),
    [
        ("G00 X22. Z5.\nG76 X18.16 Z-17. P920 Q300 F1.5\n", "thread_passes", "one finishing pass, no run-out"),
        ("G00 X22. Z5.\nG76 X18.16 Z-17. K0.92 D0.3 F1.5\n", "thread_run_out", "none at the end of G76"),
        ("G00 X0. Z2.\nG83 Z-2. R1. Q300 F0.1\nG80\n", "peck_clearance", "never more than one peck"),
        ("G00 X40. Z2.\nG75 X30. I2. F0.1\n", "cycle_retract", "never more than one peck"),
    ],
)
def test_what_a_cycle_assumes_is_said(text: str, key: str, said: str) -> None:
    assert said in run(text).assumed[key]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("G00 X0. Z2.\nG83 Z-2. R1. F0.1\nG80\n", "drills in one stroke"),
        ("G00 X42. Z-10.\nG75 X30. Z-16. P2000 F0.1\n", "cuts at both ends only"),
        ("G00 X42. Z-10.\nG75 R0.3\nG75 X30. R1. P2000 F0.1\n", "R1. of G75 changes nothing"),
        (f"G00 X60. Z5.\nG73 P10 Q20 U0.4 W0.1 F0.3\n{CONTOUR}", "cuts all in one pass"),
    ],
)
def test_what_a_cycle_lacks_or_leaves_out_is_named(text: str, said: str) -> None:
    assert any(said in warned.sentence for warned in run(text).warnings)


def test_pecks_of_a_drill_begin_in_the_hole() -> None:
    moves = of_cycle(run("G00 X0. Z5.\nG83 Z-1. R1. Q300 F0.1\nG80\n"), "G83")
    assert [round(1e3 * move.end_z, 6) for move in moves if move.kind == "rapid"][:4] == [1.0, 1.0, 1.0, 0.7]


def test_a_thread_of_linuxcnc_refuses_what_that_control_refuses() -> None:
    for words, said in (("X10", "names another X"), ("E11 L2", "longer than half of the thread")):
        with pytest.raises(ProgramError, match=said):
            interpret(read_program(f"G21 G8 S400 M3\nG0 X12 Z0\nG76 P1.5 Z-20 I-1 J0.2 K0.9 {words}\nM2\n"), "linuxcnc")
