"""Which dialect a program is in, what its lines do in words, what is odd in it, and its drawing."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lathesim.errors import ProgramError
from lathesim.program.explain import explain
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Tool
from lathesim.program.program_checks import Bar, checked, meets_stock
from lathesim.program.program_file import detect_dialect, load_program
from lathesim.program.words import read_program
from lathesim.shipped import shipped_folder
from tests.cli.command import call, done
from tests.shared_data import SHARED, needs_shared

GCODE = SHARED / "gcode"


@pytest.mark.parametrize(
    ("text", "dialect", "reason"),
    [
        ("(dialect: linuxcnc)\nG0 X1\nM2\n", "linuxcnc", "line 1 says so"),
        ("G71 G90 G94\nG0 X1 Z1\n", "paper", "its words are used as there"),
        ("O1\nT0101\nG0 X1. Z1.\nM30\n", "fanuc", "no other dialect has all its words but its rarer form 'fanuc-b'"),
        ("G8 G21\nG0 X1\nM2\n", "linuxcnc", "no other dialect has all its words but its rarer form 'grbl'"),
        ("G0 X10 Z1\nM2\n", "paper", "its words do not distinguish it from linuxcnc or fanuc"),
    ],
)
def test_a_dialect_is_found_and_the_reason_said(text: str, dialect: str, reason: str) -> None:
    found = detect_dialect(read_program(text))
    assert (found.dialect.name, found.reason) == (dialect, reason)


@needs_shared
@pytest.mark.parametrize("source", sorted((GCODE / "programs").glob("*")) if GCODE.is_dir() else [], ids=lambda path: path.name)
def test_real_programs_are_found_in_the_dialect_of_their_references(source: Path) -> None:
    expected = "linuxcnc" if source.suffix == ".ngc" or source.name.startswith("nhsd") else "fanuc"
    from lathesim.program.words import read_program_file

    assert detect_dialect(read_program_file(source)).dialect.name == expected


def test_each_line_is_explained_in_the_dialect_in_force() -> None:
    text = "G21 G99 G97 S800 M03\nG00 X42. Z2.\nG90 X36. Z-20. F0.2\nG04 X1.5\nM30\n"
    blocks = read_program(text)
    told = dict(explain(blocks, interpret(blocks, "fanuc")))
    assert told[1] == "G21: millimetres; G99: feed per revolution; M3: spindle on clockwise; G97: constant spindle speed of 800 rpm."
    assert told[2] == "Rapid to X 42 mm (diameter), Z 2 mm."
    cycle = (
        "G90: the simple turning cycle; rapid to X 36 mm (diameter), Z 2 mm; straight line to X 36 mm (diameter), Z -20 mm at 0.2 mm/rev"
    )
    assert told[3].startswith(cycle)
    assert told[4] == "Dwell of 1.5 s."


def test_what_is_odd_is_said_with_its_line() -> None:
    text = "G21 G99\nG96 S200 M03\nG00 X42. Z0.\nG01 X-5. F0.1\nG00 Z5.\nX30.\nG01 Z-10.\nM30\n"
    told = {warned.line: warned.sentence for warned in checked(interpret(read_program(text), "fanuc"))}
    assert "Write a speed limit" in told[4] or "beyond the spindle" in told[4]
    assert len(checked(interpret(read_program(text), "fanuc"))) == 2


def test_the_command_finds_the_dialect_explains_checks_and_draws(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("shaft.nc").write_text("O1\nG21 T0101\nG50 S2000\nG96 S150 M03\nG00 X42. Z2.\nG01 Z-20. F0.2\nM30\n", encoding="utf-8")
    said = done(capsys, "program", "shaft.nc", "--explain", "--plot", "shaft.png")
    assert "Read in the dialect 'fanuc'" in said.err
    assert "Rapid to X 42 mm (diameter), Z 2 mm." in said.out
    assert Path("shaft.png").stat().st_size > 5000
    said = call(capsys, "program", "shaft.nc", "--check")
    assert (said.code, said.out) == (0, "shaft.nc: 7 moves, nothing odd.\n".replace("7", "2"))


def test_cycles_statements_and_assignments_are_put_into_words() -> None:
    text = "G50 S2500\nG96 S180 M03 M58\nG71 U2. R0.5\nG71 P10 Q20 U0.4 W0.1 F0.3\nN10 G00 X20.\nN20 G01 Z-5.\n#1=[2*3]\n"
    text += "IF [#1 GT 5] GOTO 30\nN30 G70 P10 Q20\nM30\n"
    blocks = read_program("T0101\nG00 X40. Z2.\n" + text)
    told = dict(explain(blocks, interpret(blocks, "fanuc")))
    assert told[3] == "G50: the spindle turns at most at 2500 rpm."
    assert told[4] == (
        "M3: spindle on clockwise; M58: a code of the machine's builder, which does nothing here; G96: constant surface speed of 180 m/min."
    )
    assert told[5] == "G71: the roughing cycle, depth of cut 2 (radius), retract 0.5."
    assert told[6].startswith("G71: the roughing cycle, from N10, to N20, 0.4 left on the diameter, 0.1 left along Z, feed 0.3; ")
    assert told[9] == "#1 becomes [2*3]."
    assert told[10] == "If [#1GT5] holds, goes to N30."
    assert told[11].startswith("G70: the finishing cycle, from N10, to N20; ")


def test_rapids_into_the_stock_are_told_where_the_bar_is_given() -> None:
    text = "T0101\nG99 G97 S500 M03\nG00 X30. Z2.\nZ-10.\nG01 X28. F0.1\nG00 X50.\nZ2.\nG01 X28.\nZ-20.\nX50.\nG00 X30.\nZ2.\nM30\n"
    program = interpret(read_program(text), "fanuc")
    told = meets_stock(program, Bar(0.02, -0.06, 0.06))
    assert [warned.line for warned in told] == [4]
    assert told[0].sentence.startswith("The rapid goes into the stock at X 15 mm (radius)")
    inside = "T0101\nG99 G97 S500 M03\nG00 X36. Z2.\nG71 U2. R0.5\nG71 P10 Q20 U0.4 W0 F0.3\nN10 G00 X20.\nG01 Z-25.\nN20 X40.\nM30\n"
    assert [warned.sentence for warned in interpret(read_program(inside), "fanuc").warnings] == [
        "G71 begins at X 36 mm, inside its contour from 20 to 40 mm. Begin it outside; its rapid moves return there."
    ]


@pytest.mark.parametrize("part", ["shaft", "thread", "taper", "ball_end", "grooved_bush"])
def test_the_programs_of_the_shop_never_run_into_their_bar(part: str) -> None:
    for form in ("fanuc", "linuxcnc"):
        program = load_program(shipped_folder("part_programs") / f"shop_{part}_{form}.nc", form)
        assert meets_stock(program, Bar(0.0205, -0.06, 0.06)) == []


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("G21 G99\nG96 S200 M03\nG00 X42. Z0.\nG01 X5. F0.1\nM30\n", "at up to 12732 rpm under constant surface speed"),
        ("G21 G99 G97 S500 M03\nG00 X42. Z0.\nG01 X5. F5.\nM30\n", "The feed is 5 mm per revolution. If it is meant per minute"),
        ("G21 G99 G96 S200 M03\nG50 S2000\nG00 X42. Z0.\nG32 Z-20. F2.\nM30\n", "A thread is cut under constant surface speed"),
        ("G21 G99 G97 S500 M03\nG00 X42. Z0.\nG32 Z-3. F2.\nM30\n", "The thread is only 1.5 leads long"),
        ("G21 G99 G97 S500 M03\nG00 X42000 Z0.\nM30\n", "X42000 has no decimal point and is read in whole units."),
        ("G21 G99 G97 S500 M03\nG00 X42. Z0.\nG01 X30. F0.1\nX-8.\nM30\n", "The cut goes beyond the spindle's axis, to X -4 mm (radius)"),
    ],
)
def test_each_oddity_is_told(text: str, sentence: str) -> None:
    blocks = read_program(text)
    assert any(sentence in warned.sentence for warned in checked(interpret(blocks, "fanuc"), blocks))


@pytest.mark.parametrize(
    ("text", "control"),
    [
        ("N10 G0 X=40 Z2\nM30", "Sinumerik (X=4)"),
        ("G96 S200 LIMS=3000 M4\nM30", "Sinumerik (LIMS=)"),
        ("G50 S2000\nNAT01\nG85 NLAP1 D4 F0.3\nM02", "Okuma OSP (NAT01)"),
        ("0 BEGIN PGM T MM\n1 L X+10 FMAX\n", "Heidenhain (0 BEGIN PGM)"),
    ],
)
def test_a_program_for_another_control_is_refused_by_its_name(text: str, control: str) -> None:
    with pytest.raises(ProgramError, match="that control is not supported here") as refused:
        read_program(text, "turn.nc")
    assert f"This is a program for {control}, and" in str(refused.value)


def test_codes_of_the_builder_are_said_and_refused_strictly() -> None:
    blocks = read_program("T0101\nM58\nG00 X40. Z2.\nM30\n", "turn.nc")
    assert [warned.sentence for warned in interpret(blocks, "fanuc").warnings] == [
        "M58 (a code of the machine's builder) changes nothing in the simulation."
    ]
    with pytest.raises(ProgramError, match=r"M58 .a code of the machine's builder. does nothing"):
        interpret(blocks, "fanuc", strict=True)


def test_the_command_takes_tools_and_the_bar(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = "T0101\nG21 G99 G97 S500 M03\nG00 X50. Z2.\nG42 X30.\nG01 Z-10. F0.1\nX50.\nG40 G00 X60.\nM30\n"
    Path("shaft.nc").write_text(text, encoding="utf-8")
    said = call(capsys, "program", "shaft.nc", "--tool", "1=0.8mm,3", "--stock", "40mm,60mm", "--check")
    assert (said.code, said.out) == (0, "shaft.nc: 5 moves, nothing odd.\n")
    said = call(capsys, "program", "shaft.nc", "--tool", "1=0.8mm,3")
    assert "-10.8000" not in said.out and "-10.0000" in said.out
    assert call(capsys, "program", "shaft.nc", "--tool", "nose").code == 2
    assert call(capsys, "program", "shaft.nc", "--stock", "40mm").code == 2


def test_the_cycles_of_linuxcnc_are_explained_in_their_own_words() -> None:
    contour = "O100 SUB\nG0 X5\nG1 Z-10\nG1 X14\nO100 ENDSUB\n"
    blocks = read_program(f"G7 F100 S500 M3\n{contour}G0 X40 Z2\nG71.1 Q100 I1\nG76 P2 Z-18 I-4 J0.6 K2.4 Q30\nM2\n")
    told = dict(explain(blocks, interpret(blocks, "linuxcnc")))
    assert "contour O100, depth of cut 1 (radius)" in told[8]
    assert "crest -4 from the drive line (counted as X)" in told[9]
    assert "slide angle 30 degrees" in told[9]


def test_every_move_of_a_block_is_told_also_in_contours_and_with_a_nose(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    text = "G21 G99 G97 S500 M03 T0101\nG00 X52. Z2.\nG71 U2. R0.5\nG71 P1 Q2 U0.4 W0.1 F0.3\n"
    text += "N1 G42 G00 X18.\nG01 Z0. F0.1\nX30.,C2.\nZ-10.\nX40.,R3.\nZ-20.\nN2 G40 X52.\nG70 P1 Q2\n"
    text += "G42 G00 X20. Z3.\nG01 Z-5. F0.1\nX24.\nZ-12.\nG03 X30. Z-15. R3.\nG01 X46.\nG40 G00 X60.\nG04 X1.\nG04 X1.\nM30\n"
    Path("nose.nc").write_text(text, encoding="utf-8")
    program = interpret(read_program(text), "fanuc", tools={1: Tool(0.4e-3, 3)})
    said = call(capsys, "program", "nose.nc", "--tool", "1=0.4mm,3", "--explain").out
    blocks = re.split(r"\n(?= *\d+  [A-Z])", said)
    assert len(blocks) == len(text.splitlines())
    for line, words in enumerate(blocks, start=1):
        told = len(re.findall(r"(?:[Rr]apid|straight line|[Ss]traight line|arc of radius [^,]*, [^,]*,) to X|[Dd]well of", words))
        own = [move for move in program.moves if line in (move.line, move.mode.cycle_line)]
        assert told == len(own), (line, words)
    assert "Part of the contour: " in said and "G42: nose compensation, tool on the right; part of the contour: rapid to X" in said


def test_a_contour_that_only_roughing_runs_is_told_too() -> None:
    text = "G21 G99 G97 S500 M03 T0101\nG00 X52. Z2.\nG71 U2. R0.5\nG71 P1 Q2 U0.4 F0.3\nN1 G00 X18.\nG01 Z-10.,C1. F0.1\nN2 X52.\nM30\n"
    blocks = read_program(text)
    told = dict(explain(blocks, interpret(blocks, "fanuc")))
    assert told[5] == "Part of the contour: rapid to X 18 mm (diameter), Z 2 mm."
    line, chamfer = (f"straight line to X {x} mm (diameter), Z {z} mm at 0.1 mm/rev" for x, z in ((18, -9), (20, -10)))
    assert told[6] == f"Part of the contour: {line}; {chamfer}."
