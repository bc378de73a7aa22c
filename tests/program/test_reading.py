"""What is read of a file, in which dialect, and what is said where a program leaves something open."""

from __future__ import annotations

from pathlib import Path

import pytest

from lathesim.errors import ProgramError
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Program
from lathesim.program.program_checks import checked
from lathesim.program.program_file import detect_dialect, load_program
from lathesim.program.words import read_program, read_program_file
from tests.cli.command import call, done
from tests.shared_data import SHARED, needs_shared

FOUND = SHARED / "found_3" / "programs"


def found(text: str) -> Program:
    blocks = read_program(text, "turn.nc")
    return interpret(blocks, detect_dialect(blocks).dialect)


def ends(program: Program) -> list[tuple[float, float]]:
    return [(round(1e3 * move.end_x, 6), round(1e3 * move.end_z, 6)) for move in program.moves]


def refused(text: str) -> str:
    with pytest.raises(ProgramError) as error:
        found(text)
    return str(error.value)


# ---- what is read --------------------------------------------------------------------------------------------------------------------


@needs_shared
def test_a_program_runs_from_the_first_percent_to_the_second() -> None:
    program = load_program(FOUND / "percent_second.nc", "auto")
    assert ends(program) == [(25.0, 2.0), (25.0, -10.0)]
    assert program.warnings[0].sentence.endswith("stands before the % of line 2: a leader, which is not read.")


@pytest.mark.parametrize(
    ("text", "moves"),
    [
        ("any text, 1 + 1 = 2\n%\nG0 X1\n%\nG0 X2\n", 1),
        ("G0 X9\n\n%\nG0 X1\nG0 X2\n%\n", 2),
        ("O1\r\n%\r\nG0 X1\r\nM30\r\n", 1),
        ("(no leader)\n\nG0 X1\nG0 X2\n%\n", 2),
        ("G0 X1\nM30\n%\n", 1),
        ("(ends with M30)\n%\nG0 X1\nG0 X2\n%\n", 2),
        ("G0 X1\n%\nG0 X2\nG0 X3\nM30\n", 1),
        ("G0 X1\nM2\n%\nG0 X2\nM2\n%\n", 1),
        ("\n \n%\nG0 X1\n%\n", 1),
    ],
)
def test_what_stands_before_the_opening_percent_is_not_read(text: str, moves: int) -> None:
    assert len(interpret(read_program(text), "paper").moves) == moves


@needs_shared
def test_a_branch_that_never_runs_is_never_refused() -> None:
    program = load_program(FOUND / "unused_branch.ngc", "auto")
    assert ends(program) == [(10.0, 5.0)]


@pytest.mark.parametrize("line", ["G5.1 X1", "G99999", "Y5", "X1.2.3", "G0 X--1", "no words at all", "(open", "G1 X5", "G2 X1 R0", "T77"])
@pytest.mark.parametrize(
    "around",
    [
        "o1 if [0 GT 1]\n{}\no1 endif\nG0 X1\nM2\n",
        "o1 sub\n{}\no1 endsub\nG0 X1\nM2\n",
        "o1 while [0 GT 1]\n{}\no1 endwhile\nG0 X1\nM2\n",
        "IF [1 GT 0] GOTO 10\n{}\nN10 G0 X1\nM30\n",
        "G0 X1\nM30\nO9\n{}\nM99\n",
    ],
)
def test_a_line_is_refused_only_where_it_runs(line: str, around: str) -> None:
    dialect = "linuxcnc" if "o1" in around else "fanuc"
    assert len(interpret(read_program(around.format(line), "turn.nc"), dialect).moves) == 1
    runs = around.format(line).replace("[0 GT 1]", "[1 GT 0]").replace("[1 GT 0] GOTO", "[0 GT 1] GOTO")
    runs = runs.replace("endsub\n", "endsub\no1 call\n").replace("G0 X1\nM30\nO9", "G0 X1\nM98 P9\nM30\nO9")
    with pytest.raises(ProgramError, match=r"turn.nc:\d"):
        interpret(read_program(runs, "turn.nc"), dialect)


def test_all_lines_at_fault_are_told_at_once_where_one_of_them_surely_runs() -> None:
    with pytest.raises(ProgramError) as error:
        read_program("G0 X--1\no1 if [1]\nX1.2.3\no1 endif\nM2\n", "turn.nc")
    assert str(error.value).count("turn.nc:") == 2


# ---- what is left open ---------------------------------------------------------------------------------------------------------------


@needs_shared
def test_a_program_without_units_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    said = call(capsys, "program", str(FOUND / "no_units.nc"), "--check")
    assert said.code == 1
    assert said.out.endswith("no_units.nc:7: No G20 or G21 stands before the first move, so millimetres are assumed. Write the units.\n")
    assert "units: millimetres" in said.err


@needs_shared
def test_check_says_the_dialect_and_what_is_taken_too(capsys: pytest.CaptureFixture[str]) -> None:
    said = done(capsys, "check", str(FOUND / "no_units.nc"))
    assert "a part program with 2 path segments, read in the dialect 'fanuc'." in said.out
    assert "no_units.nc:7: No G20 or G21 stands before the first move, so millimetres are assumed." in said.out


@pytest.mark.parametrize(("dialect", "codes"), [("paper", "G70 or G71"), ("linuxcnc", "G20 or G21"), ("grbl", "G20 or G21")])
def test_units_that_come_too_late_or_never_are_told_in_each_dialect(dialect: str, codes: str) -> None:
    late = codes.partition(" ")[0]
    for text in ("G0 X1\nM2\n", f"G0 X1\n{late}\nG0 X2\nM2\n"):
        sentence = f"No {codes} stands before the first move, so millimetres are assumed. Write the units."
        assert [warned.sentence for warned in checked(interpret(read_program(text), dialect))] == [sentence]
    assert checked(interpret(read_program(f"{late}\nG0 X1\nM2\n"), dialect)) == []


def test_all_that_a_program_leaves_open_is_said_beside_the_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("open.gcode").write_text("G21\nX1\nG1 X2 F100 M3 S500\nZ-1\n", encoding="utf-8")
    for option in ("--check", "--explain"):
        said = call(capsys, "program", "open.gcode", option)
        assert "dialect 'grbl': no other dialect has all its words." in said.err
        for what in (
            "start: X0 Z0 mm, X as a radius", "distance: absolute positions", "feed mode: feed per minute", "x mode: radius",
            "plane: the plane of X and Z", "spindle mode: constant spindle speed",
            "motion: rapid traverse until the program says otherwise",
            "tool: the one in use, because the program calls none",
        ):  # fmt: skip
            assert what in said.err, what


def test_lines_that_block_delete_leaves_out_are_counted() -> None:
    text = "G21 G18\n/G0 X1\nG0 X2\n /2 G0 X3\nM2\n"
    assert interpret(read_program(text), "linuxcnc").assumed["block_delete"] == "on; lines with / left out: 2"
    assert "block_delete" not in interpret(read_program(text, block_delete=False), "linuxcnc").assumed


# ---- dialects ------------------------------------------------------------------------------------------------------------------------


@needs_shared
def test_grbl_begins_with_rapid_moves_and_needs_no_end() -> None:
    blocks = read_program_file(FOUND / "grbl_no_motion_word.gcode")
    detected = detect_dialect(blocks)
    assert (detected.dialect.name, detected.reason) == ("grbl", "no other dialect has all its words")
    program = interpret(blocks, detected.dialect)
    assert {move.kind for move in program.moves} == {"rapid"}
    assert ends(program) == [(-11.22, 0.0), (-11.22, 0.0), (-10.52, 0.0), (-10.52, 15.45), (-11.22, 15.45)]
    assert program.warnings == ()


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        ("G21 G18 G90\nX1\nG1 X2 F100\n", "grbl"),
        ("G21 G18 G90 G94\nG0 X1 Z1\nG1 Z-5 F100\nG91\nG0 X1\n", "grbl"),
        ("G7 G21 G95 G97 S500 M3\nG0 X1\nG33 Z-5 K1\n", "grbl"),
        ("G21 G18 G90 G94\nG0 X1 Z1\nG1 Z-5 F100\nG91\nG0 X1\nM2\n", "linuxcnc"),
        ("T0101\nG21 G90 G95\nG0 X1\nG91 X2\nM30\n", "fanuc-b"),
        ("G21\nG90 G94 G97 S500 M3\nG90 G1 X10 F100\nV5\nM2\n", "linuxcnc"),
        ("G21 G90\nG0 X1\nG1 X1 Y1 U1 V1 F100\nM2\n", "linuxcnc"),
    ],
)
def test_the_dialect_is_that_of_the_words(text: str, dialect: str) -> None:
    assert detect_dialect(read_program(text)).dialect.name == dialect


@needs_shared
def test_system_b_goes_to_the_reference_point_by_u_and_w() -> None:
    program = load_program(FOUND / "b_g28_uw.nc", "auto")
    assert (program.dialect, ends(program)[:2]) == ("fanuc-b", [(100.0, 200.0), (100.0, 200.0)])
    text = "G21 G90 G95 T0101\nG0 X50. Z3.\nG28 {}\nM30\n"
    for words, stops in (
        ("U0", [(25.0, 3.0), (100.0, 3.0)]),
        ("U4. W-1.", [(27.0, 2.0), (100.0, 200.0)]),
        ("W0", [(25.0, 3.0), (25.0, 200.0)]),
    ):
        assert ends(interpret(read_program(text.format(words)), "fanuc-b"))[1:] == stops


def test_u_and_w_of_the_finishing_cycle_leave_nothing() -> None:
    text = "G21 G99 G97 S500 M3 T0101\nG0 X42. Z2.\nG70 P10 Q20 {}F0.1\nM30\nN10 G0 X20.\nG1 Z-10.\nN20 X42.\n"
    text = text.replace("M30\n", "", 1) + "M30\n"
    plain = interpret(read_program(text.format("")), "fanuc")
    allowed = interpret(read_program(text.format("U0.4 W0 ")), "fanuc")
    assert ends(plain) == ends(allowed)
    assert [warned.sentence for warned in allowed.warnings] == [
        "U0.4 of G70 leaves no allowance; the finishing cycle cuts the contour itself."
    ]


@pytest.mark.parametrize(
    ("code", "name"),
    [
        ("G51 X2", "scaling"), ("G5 X1 Z2 I1 K1", "spline"), ("G5.1 X1 I1", "spline"), ("G12.1", "polar coordinate"), ("G13.1", "polar"),
        ("G7.1 C20", "cylindrical"), ("G107", "cylindrical"), ("G112", "polar"), ("G68", "mirroring"), ("G34 Z-5 F1", "lead"),
        ("G51.2 P1 Q2", "polygon"), ("G31 Z-5", "probing"), ("G66 P9001", "macro call"), ("G114", "offset (Haas)"), ("M66 P0", "input"),
    ],
)  # fmt: skip
def test_a_code_of_another_control_is_refused_by_its_name(code: str, name: str) -> None:
    for dialect in ("paper", "linuxcnc", "grbl", "fanuc", "fanuc-b"):
        if dialect.startswith("fanuc") and code.startswith("M"):
            continue  # there it belongs to the builder of the machine
        with pytest.raises(ProgramError) as error:
            interpret(read_program(f"{code}\nM2\n", "turn.nc"), dialect)
        assert f"turn.nc:1: {code.split()[0]} is not supported here: " in str(error.value)
        assert name in error.value.fact and "correct it" not in str(error.value)


@needs_shared
def test_a_spline_is_refused_by_its_name() -> None:
    with pytest.raises(ProgramError, match=r"g5_spline.ngc:4: G5.1 is not supported here: a quadratic spline"):
        load_program(FOUND / "g5_spline.ngc", "auto")


def test_a_program_that_no_dialect_has_is_refused_for_the_word_that_is_missing() -> None:
    assert "G51 is not supported here: scaling" in refused("G21\nG51 X2\nG0 X1\nM30\n")
    assert "V5 names an axis this lathe does not have" in refused("G21\nG90 G1 X10 F100\nV5\nM2\n")


@pytest.mark.parametrize(
    "text",
    [
        "%_N_SHAFT_MPF\nG0 X1\nM30\n",
        "G500\nG0 X1\nM30\n",
        "G0 X1\nG153 X2\nM30\n",
        "N10 GOTOB ANF\nM30\n",
        'T="ROUGH" D1\nM30\n',
        "ANF:\nM30\n",
    ],
)
def test_sinumerik_is_told_by_its_header_and_codes(text: str) -> None:
    assert "This is a program for Sinumerik (" in refused(text)


def test_a_command_to_grbl_itself_is_no_part_of_a_program() -> None:
    assert "$H is a command to GRBL itself, not a part of a program. Take it out" in refused("$h\nG21\nG0 X1\n")
