"""Words of cycles that shops write otherwise than the manual shows: each is carried out as the control does, or a sentence names it."""

from __future__ import annotations

import pytest

from lathesim.errors import ProgramError
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Move, Program, Tool
from lathesim.program.program_file import detect_dialect
from lathesim.program.words import read_program

HEAD = "G21 G99 G97 S500 M3\nT0101\n"
HEAD_B = "G21 G90 G95 G97 S500 M3\nT0101\n"
HEAD_L = "G21 G18 G8 G90 G97 S500 M3\nG95 F0.1\n"
STEP = "N1 G0 X40.\nG1 Z-10.\nN2 X52.\nM30"
INCH_STEP = "N1 G0 X1.\nG1 Z-1.\nN2 X2.1\nM30"
BORE = "o100 sub\nG0 X8\nG1 Z-10\nG1 X5 Z-14\nG1 Z-20\no100 endsub\n"


def run(text: str, dialect: str = "fanuc", tools: dict[int, Tool] | None = None) -> Program:
    return interpret(read_program(text), dialect, tools=tools)


def ends(program: Program, *kinds: str) -> list[tuple[float, float]]:
    """Return the ends (x, z) [mm] of the moves of these kinds."""
    return [(round(1e3 * move.end_x, 4), round(1e3 * move.end_z, 4)) for move in program.moves if move.kind in kinds]


def first_level(text: str) -> float:
    """Return the X [mm] of the first roughing cut."""
    return next(1e3 * move.end_x for move in run(text).moves if move.kind == "feed")


@pytest.mark.parametrize(
    ("text", "level"),
    [
        (f"{HEAD}G0 X52. Z2.\nG71 P1 Q2 D2 F0.2\n{STEP}", 24.0),
        (f"{HEAD}G0 X52. Z2.\nG71 P1 Q2 D2000 F0.2\n{STEP}", 24.0),
        (f"{HEAD}G0 X52. Z2.\nG71 U2 R1\nG71 P1 Q2 F0.2\n{STEP}", 24.0),
        (f"G20 G99 G97 S500 M3\nG0 X2.1 Z.1\nG71 U50 R10\nG71 P1 Q2 F.01\n{INCH_STEP}", 25.4 * (1.05 - 0.005)),
        (f"G20 G99 G97 S500 M3\nG0 X2.1 Z.1\nG71 P1 Q2 D500 F.01\n{INCH_STEP}", 25.4 * (1.05 - 0.05)),
    ],
    ids=["D in mm", "D in um", "U in mm", "U in 0.0001 inch", "D in 0.0001 inch"],
)
def test_a_depth_without_a_point_is_one_that_can_be_cut(text: str, level: float) -> None:
    assert first_level(text) == pytest.approx(level)


def test_words_in_the_smallest_unit_are_all_named() -> None:
    program = run(f"{HEAD}G0 X52. Z2.\nG71 U2000 R500\nG71 P1 Q2 F0.2\n{STEP}")
    assert program.assumed["numbers_without_point"] == "U2000, R500 of a cycle, in the smallest unit of the control"


@pytest.mark.parametrize(
    "cycle", ["G92 X29. Z-20. R-500 F2.", "G92 X29. Z-20. R-.5 F2.", "G76 X29. Z-20. R-500 P500 Q500 F2."], ids=["G92", "point", "G76"]
)
def test_a_taper_without_a_point_counts_in_the_smallest_unit(cycle: str) -> None:
    thread = next(move for move in run(f"{HEAD}G0 X34. Z5.\n{cycle}\nM30").moves if move.kind == "thread")
    assert 1e3 * thread.start_x == pytest.approx(14.0)


def test_incremental_words_of_a_single_pass_count_from_where_it_begins_in_both_systems() -> None:
    expected = ends(run(f"{HEAD}G0 X32. Z5.\nG90 U-3. W-25. R-1. F.2\nU-5.\nM30"), "feed")
    assert expected == [(14.5, -20.0), (16.0, -20.0), (13.5, -20.0), (16.0, -20.0)]
    assert ends(run(f"{HEAD_B}G0 X32. Z5.\nG91 G77 X-3. Z-25. R-1. F.2\nX-5.\nM30", "fanuc-b"), "feed") == expected


@pytest.mark.parametrize(
    ("text", "dialect"),
    [(f"{HEAD}G0 X0 Z5.\nG81 W-20. R2. F.1\nM30", "fanuc"), (f"{HEAD_B}G0 X0 Z5.\nG91 G81 Z-20. R-3. F.1\nM30", "fanuc-b")],
)
def test_an_incremental_depth_of_a_hole_counts_from_the_r_plane(text: str, dialect: str) -> None:
    program = run(text, dialect)
    assert ends(program, "feed") == [(0.0, -18.0)]
    assert {"drilling_depth", "drilling_plane"} <= program.assumed.keys()


@pytest.mark.parametrize(
    ("text", "dialect", "words"),
    [
        (f"{HEAD}G71 U2. R-.5\nM30", "fanuc", "R-.5 of G71 is a retract below 0"),
        (f"{HEAD}G75 R-.5\nM30", "fanuc", "R-.5 of G75 is a retract below 0"),
        (f"{BORE}{HEAD_L}G71 Q100 X4 Z1 R-0.3\nM2", "linuxcnc", "R-0.3 of G71 is a retract below 0"),
        (f"{BORE}{HEAD_L}G91\nG71 Q100\nM2", "linuxcnc", "G71 does not go with incremental positions"),
        (f"{HEAD_L}G0 X12 Z5\nG76 P1.5 Z-20 I0 J0.2 K0.9\nM2", "linuxcnc", "I of G76 is 0 and says no side"),
        (f"{HEAD}G0 X52. Z2.\nG71 U2. R.5\nG71 P2 Q1 F.2\n{STEP}", "fanuc", "Q1 of G71, stands before the first, P2. Swap P and Q."),
        (f"{HEAD}G76 P2.1060 Q50 R.05\nM30", "fanuc", "P2.1060 of G76 is no number of six digits"),
        (f"{HEAD}G0 X0 Z2.\nG81 Z-10. R-15. F.1\nM30", "fanuc", "The R plane of G81 lies beyond the bottom of its hole"),
        ("[BILLET X30 Z80\nO1\nG0 X1.\nM30", "fanuc", "[BILLET is the bar of a training simulator"),
    ],
)
def test_words_that_would_cut_into_the_part_are_refused(text: str, dialect: str, words: str) -> None:
    with pytest.raises(ProgramError) as refused:
        run(text, dialect)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("text", "dialect", "words"),
    [
        (f"{HEAD}G96 S100\nG0 X32. Z5.\nG92 X29. Z-20. F2.\nM30", "fanuc", "G92 threads at constant surface speed"),
        ("G21 G18 G96 D2000 S100 M3\nG0 X10 Z5\nG33 Z-20 K2\nM2", "linuxcnc", "G33 threads at constant surface speed"),
        (f"{HEAD}G0 X32. Z5.\nG92 X29. Z-20. F300\nM30", "fanuc", "F300 is a lead of 300 mm per revolution here"),
        (f"{HEAD_L}G0 X12 Z5\nG33 Z-20 K300\nM2", "linuxcnc", "K300 is a lead of 300 mm per revolution here"),
        (f"{HEAD}G0 X32. Z5.\nG92 X29. F2.\nM30", "fanuc", "G92 ends at the Z where it begins, and cuts nothing"),
        (f"{HEAD}G0 X32. Z5.\nG94 Z3. F.2\nM30", "fanuc", "G94 ends at the X where it begins, and cuts nothing"),
        (f"{HEAD}G0 X30. Z5.\nG76 X28. Z-20. P1300 Q300 F2.\nM30", "fanuc", "G76 begins below the crest of its thread"),
        (f"{HEAD}G0 X26. Z5.\nG76 X30. Z-20. R1.5 P1300 Q300 F2.\nM30", "fanuc", ""),
        (f"{HEAD}G0 X30. Z-10.\nG75 X28. P2 F0.05\nM30", "fanuc", "Write P2000 for 2 mm."),
        (f"{HEAD}G0 X60. Z5.\nG73 U-5. R3\nG73 P1 Q2 F.2\n{STEP}", "fanuc", "The relief of G73 goes into the part"),
        (f"{HEAD}M4\nG0 X0 Z5.\nG84 Z-20. R2. F1.25\nM30", "fanuc", "G84 cuts a left-hand thread, because M4 turns the spindle"),
        (f"{BORE}{HEAD_L}G0 X4 Z1\nG71 Q100 D-0.2 I1 R.5\nM2", "linuxcnc", "D of G71 is below 0 and cuts beyond the contour"),
        (f"{BORE}{HEAD_L}G0 X4 Z1\nG71 Q100 U0.2 I1 R.5\nM2", "linuxcnc", "U0.2 of G71 cuts into the contour"),
    ],
)  # fmt: skip
def test_words_that_are_odd_are_named(text: str, dialect: str, words: str) -> None:
    sentences = [warned.sentence for warned in run(text, dialect).warnings]
    assert any(words in sentence for sentence in sentences) if words else not sentences


def test_depth_and_retract_that_linuxcnc_assumes_are_named() -> None:
    assumed = run(f"{BORE}{HEAD_L}G0 X4 Z1\nG71 Q100\nM2", "linuxcnc").assumed
    assert (assumed["I of G71"], assumed["R of G71"]) == ("1 mm, as in LinuxCNC", "0.5 mm, as in LinuxCNC")


@pytest.mark.parametrize("cycle", ["G75 X40. Z-5. P1000 Q1000 F.1", "G83 Z-3. R1. Q1. F.1", "G84 Z-3. R1. F1."])
def test_grooves_and_holes_stay_where_they_are_beside_a_nose(cycle: str) -> None:
    def cut(side: str) -> list[Move]:
        program = run(f"{HEAD}G0 X52. Z2.\n{side}{cycle}\nM30", tools={1: Tool(radius=0.8e-3, orientation=3)})
        assert bool(side) == any(key.startswith("nose_") for key in program.assumed)
        return [move for move in program.moves if move.kind != "rapid"]

    assert [(move.end_x, move.end_z) for move in cut("G42\n")] == [(move.end_x, move.end_z) for move in cut("")]


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        ("G21 G90 G94\nT0101\nG97 S500 M3\nG0 X32. Z5.\nG33 Z-20. F1.5\nG0 X40.\nM30", "fanuc-b"),
        ("G90 G96 S200 M4\nG92 S3000\nG0 X50 Z2\nG1 Z-20 F0.2\nM30", "fanuc-b"),
        ("G21\nG38.2 Z-10 F50\nG92 Z0\nG0 Z5", "grbl"),
        ("G90 G21 G95 G97 S500 M3\nG0 X10 Z2\nG33 Z-20 K1.5\nG0 X12\nM2", "linuxcnc"),
    ],
)
def test_a_thread_a_limit_and_a_probe_tell_the_dialect(text: str, dialect: str) -> None:
    assert detect_dialect(read_program(text)).dialect.name == dialect


@pytest.mark.parametrize("word", ["G33 Z-20 K2 SF=180", "S1=500", "M1=3"])
def test_further_words_of_sinumerik_name_it(word: str) -> None:
    with pytest.raises(ProgramError, match="This is a program for Sinumerik"):
        read_program(f"G0 X20 Z2\n{word}\nM30")
