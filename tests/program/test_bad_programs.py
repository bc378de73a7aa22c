"""Bad programs, each with the exact sentence it deserves."""

import json

import pytest

from lathesim.errors import ProgramError
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Program
from lathesim.program.words import read_program
from tests.shared_data import SHARED, needs_shared


def run(text: str | bytes, dialect: str = "paper") -> Program:
    return interpret(read_program(text, "turn.nc"), dialect)


# (program, the whole message in the dialect paper)
REFUSED = {
    "no feed": ("G71 G90 G94\nG1 X10\nM2", "turn.nc:2: G1 needs a feed and none is set yet. Add an F word, for example F120 with G94."),
    "no feed per revolution": (
        "G95\nM3 S500\nG1 X10\nM2",
        "turn.nc:3: G1 needs a feed and none is set yet. Add an F word, for example F0.2 with G95.",
    ),
    "feed zero": (
        "F0\nG1 X10\nM2",
        "turn.nc:2: G1 needs a feed and the feed of line 1 is 0. Add an F word, for example F120 with G94.",
    ),
    "feed negative": (
        "G1 X10 F-5\nM2",
        "turn.nc:1: F-5 is a negative feed. Give the feed without a sign; the end point says the direction.",
    ),
    "feed dropped": (
        "G94 F100\nG1 X10\nG95\nM3 S500 G1 X11\nM2",
        "turn.nc:4: G1 needs a feed and G95 in line 3 dropped the one of line 1. Add an F word, for example F0.2 with G95.",
    ),
    "feed per revolution, spindle off": (
        "G95 F0.2\nG1 X10\nM2",
        "turn.nc:2: G1 feeds per revolution and the spindle stands still. Turn it on with M3 and an S word, or use G94.",
    ),
    "arc without centre": (
        "F100\nG0 X10\nG2 X12 Z-2\nM2",
        "turn.nc:3: G2 needs I and K, or R, and has none of them. Give the centre with I and K, or the radius with R.",
    ),
    "arc with radius and centre": (
        "F100\nG0 X10\nG2 X12 Z-2 R2 I2\nM2",
        "turn.nc:3: G2 has both R2 and I2. Give the radius with R, or the centre with I and K.",
    ),
    "arc off its circle": (
        "F100\nG0 X10\nG2 X12 Z-2.5 I2 K0\nM2",
        "turn.nc:3: G2 ends 2.5000 mm from its centre and starts 2.0000 mm from it. "
        "Correct I and K, or the end point, so that both lie on one circle.",
    ),
    "arc too small": (
        "F100\nG0 X10\nG2 X20 Z-10 R2\nM2",
        "turn.nc:3: G2 has the radius 2.0000 mm, too small to reach its end 14.1421 mm away. It takes 7.0711 mm at least.",
    ),
    "arc by radius to its start": (
        "F100\nG0 X10\nG2 X10 R2\nM2",
        "turn.nc:3: G2 with R ends where it starts, so its centre could lie anywhere. Give the centre of a full circle with I and K.",
    ),
    "arc about its start": (
        "F100\nG0 X10\nG2 X10 I0 K0\nM2",
        "turn.nc:3: G2 has its centre where it starts. I and K point from the start to the centre.",
    ),
    "arc of radius 0": ("F100\nG2 X12 Z-2 R0\nM2", "turn.nc:2: G2 has the radius 0. Give R, or the centre with I and K."),
    "arc with J": (
        "F100\nG0 X10\nG2 X12 Z-2 I2 J1\nM2",
        "turn.nc:3: J1 is an arc centre along Y, and this lathe has no Y. Take it out; I goes along X and K along Z.",
    ),
    "arc without end": ("F100\nG2 R2\nM2", "turn.nc:2: G2 with R names no end point. Add X and Z words."),
    "an axis Y": ("G0 X10 Y1\nM2", "turn.nc:1: Y1 names an axis this lathe does not have. It has X and Z."),
    "two motions": ("G0 G1 X10\nM2", "turn.nc:1: G0 and G1 exclude each other (motion). Keep one, or write two blocks."),
    "G90 with G91": (
        "G90 G91\nM2",
        "turn.nc:1: G90 and G91 exclude each other (absolute or incremental). Keep one, or write two blocks.",
    ),
    "inch with millimetres": ("G70 G71\nM2", "turn.nc:1: G70 and G71 exclude each other (units). Keep one, or write two blocks."),
    "G94 with G95": ("G94 G95\nM2", "turn.nc:1: G94 and G95 exclude each other (feed mode). Keep one, or write two blocks."),
    "G96 with G97": ("G96 G97 S100\nM2", "turn.nc:1: G96 and G97 exclude each other (spindle mode). Keep one, or write two blocks."),
    "M3 with M4": ("M3 M4 S100\nM2", "turn.nc:1: M3 and M4 exclude each other (spindle). Keep one, or write two blocks."),
    "two X": ("G0 X1 X2\nM2", "turn.nc:1: The block has two X words, X1 and X2. Keep one of them."),
    "unknown G": (
        "G323 X1\nM2",
        "turn.nc:1: G323 is in no dialect known here (paper, linuxcnc, fanuc). Look the code up and correct it.",
    ),
    "unknown M": ("M77\nM2", "turn.nc:1: M77 is in no dialect known here (paper, linuxcnc, fanuc). Look the code up and correct it."),
    "no letter": (
        "G0 $1\nM2",
        "turn.nc:1: '$' is no part of a program. Words are a letter and a number; put remarks in parentheses.",
    ),
    "decimal comma": ("G0 Z,15\nM2", "turn.nc:1: A comma stands behind Z. Write numbers with a decimal point, as in X0.5."),
    "letter without number": (
        "G0 X\nM2",
        "turn.nc:1: X has no number. Write one right behind it, as in X10; put remarks in parentheses.",
    ),
    "number without letter": ("G0 X1 (a) 5\nM2", "turn.nc:1: The number 5 has no letter. Put its letter right in front, as in X10."),
    "two points": ("G0 X1.2.3\nM2", "turn.nc:1: X1.2.3 has more than one decimal point. Write X1.2."),
    "two signs": ("G0 X--1\nM2", "turn.nc:1: X--1 has two signs. Write one sign."),
    "exponent": ("G0 X1e3\nM2", "turn.nc:1: X1E3: E is not a number exponent in G-code. Write the number out, as in X1000."),
    "letter O for zero": ("GO X1\nM2", "turn.nc:1: GO is written with the letter O. Write G0 with a zero."),
    "negative G": ("G-1 X1 F1\nM2", "turn.nc:1: G-1 is negative; codes are not. Write G1."),
    "open comment": ("G0 X1 (abc\nM2", "turn.nc:1: A comment is opened and not closed. Put ) at its end."),
    "nested comment": ("G0 X1 (a (b) c)\nM2", "turn.nc:1: A comment stands inside a comment. Use one pair of parentheses."),
    "closing parenthesis": ("G0 X1 )\nM2", "turn.nc:1: A ) closes a comment that was not opened. Put ( in front of the comment."),
    "text": (
        "roughing pass\nM2",
        "turn.nc:1: R has no number. Write one right behind it, as in R10; put remarks in parentheses.",
    ),
    "no second percent": (
        "%\nG0 X1\n",
        "turn.nc:3: The % of line 1 opens the program, but no second % closes it. The file may be cut short. End it with M30 and %.",
    ),
    "negative speed": ("S-100 M3\nM2", "turn.nc:1: S-100 is a negative speed. Give it without a sign; M03 and M04 say the direction."),
    "G96 without S": ("G96\nM2", "turn.nc:1: G96 needs a surface speed and has none. Add an S word in m/min, for example G96 S150."),
    "G97 without S after G96": (
        "G96 S150\nG97\nM2",
        "turn.nc:2: G97 needs a spindle speed and has none. Add an S word in rpm, for example G97 S1000.",
    ),
    "axis without motion": (
        "X10\nM2",
        "turn.nc:1: X10 needs a motion code and none is set yet. Write G0 or G1 in front of it.",
    ),
    "R without arc": (
        "G1 X10 R5 F10\nM2",
        "turn.nc:1: R5 has no code in its block that uses it (arc radius). Take it out, or add the code.",
    ),
    "negative N": ("N-5 G0 X1\nM2", "turn.nc:1: N-5 is negative. N numbers count from 0 up."),
    "N behind": ("G0 N5 X1\nM2", "turn.nc:1: N5 stands behind another word. The N number comes first in its block."),
    "variable": (
        "G0 X#100\nM2",
        "turn.nc:1: X#100 computes with expressions or variables, and the dialect 'paper' has none; 'linuxcnc' and 'fanuc' have them. "
        "Choose the dialect the program is written in, or write the numbers themselves.",
    ),
    "expression": (
        "G0 X[1/0]\nM2",
        "turn.nc:1: X[1/0] computes with expressions or variables, and the dialect 'paper' has none; 'linuxcnc' and 'fanuc' have them. "
        "Choose the dialect the program is written in, or write the numbers themselves.",
    ),
    "slash inside": (
        "G0 X1 /Z5\nM2",
        "turn.nc:1: A / stands inside the block. Block delete / comes first in its line and takes all of it.",
    ),
    "control characters": (
        "G0 X1\n\x01\x02\nM2",
        "turn.nc:2: A control character (code 1) stands in the line, so this is no plain text. "
        "Save the program as plain text; it may have been damaged on the way.",
    ),
    "line too long": (
        "G0 X" + "0" * 300 + "\nM2",
        "turn.nc:1: The line is too long: 303 characters of code, and 256 are read. Write it as several blocks.",
    ),
    "number too large": ("G0 X12345678901\nM2", "turn.nc:1: X12345678901 is too large a number. At most 9 digits stand before the point."),
    "plane": (
        "G17\nM2",
        "turn.nc:1: G17 means a plane with Y in it in the dialect 'paper', and that is not interpreted here; "
        "in the dialect 'linuxcnc' it means the plane of X and Y, for drilling along Z. "
        "This is for a mill; a two-axis lathe moves in the plane of X and Z. Write G18, or choose the dialect the program is written in; "
        "'linuxcnc' has all its words. A comment (dialect: linuxcnc) at its head chooses one. "
        "A run takes the one of its lesson: write dialect: linuxcnc there.",
    ),
    "units change with F": (
        "G70 G1 X1 F5\nM2",
        "turn.nc:1: F5 stands in the block in which G70 changes the units, and controls differ in which unit it then has. "
        "Write G70 in a block before it.",
    ),
    "foreign code with an own one": (
        "G21\nG0 X1\nM2",
        "turn.nc:1: G21 is not in the dialect 'paper'; 'linuxcnc' and 'fanuc' have it (millimetres). "
        "Write G71 for it here, or choose the dialect the program is written in; 'linuxcnc' and 'fanuc' have all its words. "
        "A comment (dialect: linuxcnc) at its head chooses one. A run takes the one of its lesson: write dialect: linuxcnc there.",
    ),
    "cycle of another dialect, both readings": (
        "G71 U2. R0.5\nM2",
        "turn.nc:1: U2. is not in the dialect 'paper'; 'linuxcnc' has it (allowance along X), "
        "'fanuc' has it (incremental X). G71 means millimetres in the dialect 'paper'; "
        "in the dialects 'linuxcnc' and 'fanuc' it means the roughing cycle. "
        "Choose the dialect the program is written in; 'linuxcnc' and 'fanuc' have all its words. "
        "A comment (dialect: linuxcnc) at its head chooses one. A run takes the one of its lesson: write dialect: linuxcnc there.",
    ),
    "feed per revolution of fanuc": (
        "G99 G1 X10 F0.1\nM2",
        "turn.nc:1: G99 is not in the dialect 'paper'; 'linuxcnc' has it (the return level of canned cycles); "
        "'fanuc' has it (feed per revolution). "
        "Write G95 for it here, or choose the dialect the program is written in; 'linuxcnc' and 'fanuc' have all its words. "
        "A comment (dialect: linuxcnc) at its head chooses one. A run takes the one of its lesson: write dialect: linuxcnc there.",
    ),
}


@pytest.mark.parametrize("name", list(REFUSED))
def test_refused_with_place_fact_and_remedy(name: str) -> None:
    text, message = REFUSED[name]
    with pytest.raises(ProgramError) as refused:
        run(text)
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("text", "dialect", "message"),
    [
        (
            "G71 G90 G94 G18\nG0 X1\nM2", "linuxcnc",
            "turn.nc:1: G71 needs Q, the number of the subprogram with its contour; in the dialect 'paper' it means millimetres. "
            "Write the contour from O100 SUB to O100 ENDSUB, and G71 Q100.",
        ),
        ("G4\nM2", "linuxcnc", "turn.nc:1: G4 needs a time and has none. Write one, as in G4 P1.5."),
        ("G4 P-1\nM2", "linuxcnc", "turn.nc:1: P of G4 is a negative time. A dwell takes 0 s or more."),
        ("G96 D-5 S100\nM2", "linuxcnc", "turn.nc:1: D-5 is no speed limit. Give it in rpm, above 0."),
        ("G33 Z-10\nM2", "linuxcnc", "turn.nc:1: G33 needs a lead and has none. Add a K word, for example K1.5."),
        (
            "M3 S0\nG33 Z-10 K1\nM2", "linuxcnc",
            "turn.nc:2: G33 follows the spindle, and the spindle stands still. Turn it on with M3 and an S word.",
        ),
        ("T77 M6\nM2", "linuxcnc", "turn.nc:1: T77 asks for tool 77, and the turret has 12. Use a tool of the turret."),
        ("M6\nM2", "linuxcnc", "turn.nc:1: M6 changes the tool and no T word has named one. Write it as T1 M6."),
        ("G92\nM2", "linuxcnc", "turn.nc:1: G92 shifts the origin and names no axis. Add an X or a Z word."),
        (
            "G91\nG53 G0 X1\nM2", "linuxcnc",
            "turn.nc:2: G53 names machine coordinates and positions are incremental. Write G90 before it.",
        ),
        (
            "G80 X10\nM2", "linuxcnc",
            "turn.nc:1: X10 needs a motion code and G80 has ended the one before. Write G0 or G1 in front of it.",
        ),
        ("G0 X1\n", "linuxcnc", "turn.nc:1: The program has no end. Write M2 or M30 in its last block; it may be cut short."),
        (
            "G50\nM2", "fanuc",
            "turn.nc:1: G50 needs the spindle speed limit as an S word, or a position. Write it as G50 S2000.",
        ),
        (
            "G50 G96 S2000\nM2", "fanuc",
            "turn.nc:1: G50 needs the spindle speed limit as an S word, or a position. Write it as G50 S2000.",
        ),
        (
            "G90 G54 F0.2\nM2", "fanuc",
            "turn.nc:1: G90 is a cycle here and names no end point; in the dialects 'paper' and 'linuxcnc' it means absolute positions. "
            "Add X and Z words, or take it out.",
        ),
        (
            "S500 M3\nG73 U5. W0 R3\nG73 P10 Q20 F0.2\nN10 S600\nN20 S700\nM30", "fanuc",
            "turn.nc:3: The contour of G73 cuts nothing. Write it with G1, G2 and G3 behind its first block.",
        ),
        ("G0 X1 U2\nM2", "fanuc", "turn.nc:1: X1 and U2 both move X. Keep the absolute or the incremental one."),
        ("G0 X1", "papre", "There is no dialect 'papre'; there are paper, linuxcnc, fanuc, grbl, fanuc-b. Did you mean 'paper'?"),
    ],
)  # fmt: skip
def test_other_dialects_refuse_as_plainly(text: str, dialect: str, message: str) -> None:
    with pytest.raises(ProgramError) as refused:
        run(text, dialect)
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("text", "moves", "warned"),
    [
        ("G0 X1\n", 1, "The program ends without M02 or M30."),
        ("%\nG0 X1\n%\nG0 X5\n", 1, "All lines after % of line 3 are ignored, from here on."),
        ("G0 X1\nM30\nG0 X99", 1, "All lines after M30 of line 2 are ignored, from here on."),
        ("", 0, "The program is empty."),
        ("N1234567 G0 X1\nM2", 1, ""),
        ("N1.5 G0 X1\nM2", 1, ""),
        ("G71 G18\r\nG0 X10 Z1\r\nM2\r\n", 1, ""),
        ("G0\tX 1 0\nM2", 1, ""),
        ("g0 x1\nm2", 1, ""),
        ("/G0 X10\nM2", 0, ""),
        ("G0 X1 ; Z9\nM2", 1, ""),
        ("G0 X1;\nM2", 1, ""),
        ("G0 X1 (Ø20 °)\nM2", 1, ""),
        ("G0 X+1.\nM2", 1, ""),
        ("M3 S9\nG01 X1. F10.\nG1X2.\nM2", 2, ""),
        ("M03. S100\nG0001 X1 F10\nM2", 1, ""),
        ("G98\nM2", 0, ""),
        ("G1 X1 F10\nM2", 1, "The tool feeds while the spindle stands still."),
    ],
)
def test_odd_but_clear_programs_are_taken(text: str, moves: int, warned: str) -> None:
    program = run(text)
    assert len(program.moves) == moves
    assert [warning.sentence for warning in program.warnings] == ([warned] if warned else [])


# What the recommendation of each case of the reference set comes to, where it is not simply LinuxCNC's own answer.
ACCEPTED = {
    "no_end": "paper", "after_percent": "linuxcnc", "N_big": "linuxcnc", "N_float": "linuxcnc", "g71_unit_paper": "paper",
    "g70_alone": "paper", "G50_S": "fanuc", "G98_feed": "paper", "G28_U": "fanuc", "m_code_30_then_more": "linuxcnc",
    "empty": "paper", "crlf": "linuxcnc",
    "tabs_spaces": "linuxcnc", "lower": "linuxcnc", "block_delete_off": "linuxcnc", "semicolon_eol": "linuxcnc", "fanuc_eob": "linuxcnc",
    "unicode": "linuxcnc", "plus_sign": "linuxcnc", "G01_G1": "linuxcnc", "G0_4digits": "linuxcnc", "no_integer_G_with_dot": "linuxcnc",
    "M03.": "linuxcnc", "T_4digit": "fanuc",
}  # fmt: skip
OTHERWISE = {"U_word": "fanuc", "G99_feed": "linuxcnc"}  # taken in this dialect, refused in the others


@needs_shared
def test_all_bad_programs_follow_their_recommendation() -> None:
    cases = json.loads((SHARED / "gcode" / "bad_programs.json").read_text())["cases"]
    assert len(cases) == 112
    for case in cases:
        name = case["name"]
        for dialect in ("paper", "linuxcnc", "fanuc"):
            try:
                interpret(read_program(case["program"], "turn.nc"), dialect)
            except ProgramError as error:
                assert ACCEPTED.get(name) != dialect, f"{name} in {dialect}: {error}"
                assert error.place.startswith("turn.nc:"), name
                assert error.remedy.endswith("."), name
                assert "!" not in str(error) and "invalid" not in str(error).lower(), name
            else:
                assert name in ACCEPTED or OTHERWISE.get(name) == dialect, f"{name} was taken in {dialect}"
