"""Programs made from a few numbers, and the two commands."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from lathesim.cli.part_program import new_program, program
from lathesim.errors import ProgramError, UnitError, WriteError
from lathesim.program.interpreter import interpret
from lathesim.program.words import read_program

TAPER = ["taper", "--large-diameter", "34mm", "--small-diameter", "30mm", "--length", "20mm"]


def printed(*arguments: str) -> str:
    result = CliRunner().invoke(new_program, list(arguments), catch_exceptions=False)
    assert result.exit_code == 0
    return result.output


def test_the_taper_cut_of_example_2() -> None:
    assert printed(*TAPER) == (
        "(Taper cut: diameters 30.0 to 34.0 mm, length 20.0 mm, face at Z15.0; X is a radius)\n"
        "N10 G90 G94 G71\n"
        "N20 G97 S1000.0 M03\n"
        "N30 G00 X15.0 Z10.0\n"
        "N40 G01 Z15.0 F120.0\n"
        "N50 X17.0 Z35.0\n"
        "N60 X22.0\n"
        "N70 G00 Z0.0\n"
        "N80 X0.0 M05\n"
        "N90 M30\n"
    )


def test_a_straight_cut_per_revolution_at_constant_surface_speed() -> None:
    text = printed("straight", "--diameter", "30mm", "--length", "25mm", "--feed", "0.2 mm/rev", "--speed", "150 m/min")
    moves = interpret(read_program(text)).moves
    cut = moves[2]
    assert (cut.end_x, cut.end_z, cut.feed, cut.mode.per_revolution) == (0.015, 0.04, 0.0002, True)
    assert cut.mode.spindle.surface and cut.mode.spindle.speed == 2.5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["taper", "--large-diameter", "30mm", "--small-diameter", "34mm", "--length", "20mm"],
            "The large diameter 30.0 mm is below the small one, 34.0 mm. The taper widens away from the face; exchange the two.",
        ),
        ([*TAPER, "--feed", "0 mm/min"], "The feed of the cut is 0, and it has to be above 0. Give a feed above 0."),
        (
            [*TAPER, "--clearance", "20mm"],
            "The tool would wait at Z-5.0, and it starts from Z0 in front of the part. Put the face further away or the clearance smaller.",
        ),
    ],
)
def test_numbers_that_make_no_cut_are_refused(arguments: list[str], message: str) -> None:
    with pytest.raises(ProgramError) as refused:
        CliRunner().invoke(new_program, arguments, catch_exceptions=False)
    assert str(refused.value) == message


def test_a_number_without_a_unit_is_refused() -> None:
    with pytest.raises(UnitError, match="'20' has no unit"):
        CliRunner().invoke(new_program, [*TAPER[:-1], "20"], catch_exceptions=False)


def test_a_file_is_written_and_not_replaced(tmp_path: Path) -> None:
    out = tmp_path / "taper.nc"
    assert printed(*TAPER, "--out", str(out)) == f"wrote {out}\n"
    assert out.read_text() == printed(*TAPER)
    with pytest.raises(ProgramError, match="is there already"):
        CliRunner().invoke(new_program, [*TAPER, "--out", str(out)], catch_exceptions=False)
    printed(*TAPER, "--out", str(out), "--force")
    with pytest.raises(WriteError, match="there is no folder"):
        CliRunner().invoke(new_program, [*TAPER, "--out", str(tmp_path / "no" / "taper.nc")], catch_exceptions=False)


def test_the_command_shows_a_table_or_json(tmp_path: Path) -> None:
    file = tmp_path / "turn.nc"
    file.write_text("G71 G90 G94\nM03 S1000\nG00 X20 Z2\nG01 X15 F120\nG03 X17 Z4 I2 K0\n")
    shown = CliRunner().invoke(program, [str(file)], catch_exceptions=False)
    assert "   4  feed           15.0000      2.0000  120 mm/min      cw 1000 rpm" in shown.stdout
    assert "1 rapid, 1 feed, 1 arc; cut 8.142 mm, rapid 20.100 mm" in shown.stdout
    assert f"{file}:5: The program ends without M02 or M30." in shown.stderr
    made = json.loads(CliRunner().invoke(program, [str(file), "--json"], catch_exceptions=False).stdout)
    assert made["schema"] == "lathe-canon/1" and len(made["moves"]) == 3


def test_a_program_that_is_not_there(tmp_path: Path) -> None:
    (tmp_path / "turning.nc").write_text("M2")
    with pytest.raises(ProgramError) as refused:
        CliRunner().invoke(program, [str(tmp_path / "turnin.nc")], catch_exceptions=False)
    assert str(refused.value) == f"There is no part program '{tmp_path / 'turnin.nc'}'. Did you mean 'turning.nc'?"


def test_a_folder_is_no_program(tmp_path: Path) -> None:
    with pytest.raises(ProgramError, match="cannot be read: Is a directory"):
        CliRunner().invoke(program, [str(tmp_path)], catch_exceptions=False)
