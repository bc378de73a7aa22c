"""Which dialect a program is in, what its lines do in words, what is odd in it, and its drawing."""

from __future__ import annotations

from pathlib import Path

import pytest

from lathesim.program.checks import checked
from lathesim.program.detect import detect_dialect
from lathesim.program.explain import explain
from lathesim.program.interpreter import interpret
from lathesim.program.words import read_program
from tests.cli.command import call
from tests.shared_data import SHARED, needs_shared

GCODE = SHARED / "gcode"


@pytest.mark.parametrize(
    ("text", "dialect", "reason"),
    [
        ("(dialect: linuxcnc)\nG0 X1\nM2\n", "linuxcnc", "line 1 says so"),
        ("G71 G90 G94\nG0 X1 Z1\n", "paper", "its words are used as there"),
        ("O1\nT0101\nG0 X1. Z1.\nM30\n", "fanuc", "no other dialect has all its words"),
        ("G8 G21\nG0 X1\nM2\n", "linuxcnc", "no other dialect has all its words"),
        ("G0 X10 Z1\nM2\n", "paper", "nothing tells it from linuxcnc or fanuc"),
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
    assert told[1] == "G21: millimetres; G99: feed per revolution; G97: constant spindle speed; M3: spindle on clockwise."
    assert told[2] == "Rapid to X 21 mm (radius), Z 2 mm."
    cycle = "G90: the simple turning cycle; rapid to X 18 mm (radius), Z 2 mm; straight line to X 18 mm (radius), Z -20 mm at 0.2 mm/rev"
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
    Path("shaft.nc").write_text("O1\nT0101\nG50 S2000\nG96 S150 M03\nG00 X42. Z2.\nG01 Z-20. F0.2\nM30\n", encoding="utf-8")
    said = call(capsys, "program", "shaft.nc", "--explain", "--plot", "shaft.png")
    assert said.code == 0
    assert "Read in the dialect 'fanuc'" in said.err
    assert "Rapid to X 21 mm (radius), Z 2 mm." in said.out
    assert Path("shaft.png").stat().st_size > 5000
    said = call(capsys, "program", "shaft.nc", "--check")
    assert (said.code, said.out) == (0, "shaft.nc: 7 moves, nothing odd.\n".replace("7", "2"))
