"""What the interpreter makes of single codes, in the dialect paper unless said otherwise."""

import math

import pytest

from lathesim.errors import ProgramError
from lathesim.program.canonical_moves import canon
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Program
from lathesim.program.words import read_program


def run(text: str, dialect: str = "paper") -> Program:
    return interpret(read_program(text, "turn.nc"), dialect)


def ends(program: Program) -> list[tuple[float, float]]:
    return [(round(1e3 * move.end_x, 9), round(1e3 * move.end_z, 9)) for move in program.moves]


def test_absolute_and_incremental() -> None:
    assert ends(run("G90\nG00 X10 Z5\nG91\nX1 Z-1\nX1\nG90\nX3\nM2")) == [(10, 5), (11, 4), (12, 4), (3, 4)]


def test_inches_and_millimetres_and_what_is_already_set() -> None:
    program = run("G70\nM3 S500\nG01 X1 F4\nG71\nX30\nM2")
    assert ends(program) == [(25.4, 0), (30, 0)]
    assert [move.feed for move in program.moves] == pytest.approx([101.6 / 60e3] * 2)


def test_the_order_of_words_in_a_block_does_not_matter() -> None:
    one = canon(run("G94 G71\nM03 G01 X10 Z5 F120 S1000\nM30"))
    other = canon(run("G71 G94\nS1000 F120 Z5 X10 G01 M03\nM30"))
    assert one == other


def test_the_spindle_turns_before_and_stops_come_after_the_motion_of_their_block() -> None:
    program = run("M03 S100 G00 X1\nM00 G00 X2\nM30")
    assert program.moves[0].mode.spindle.direction == 1
    assert [(event.kind, event.before_move) for event in program.events] == [
        ("spindle", 0),
        ("program_stop", 2),
        ("spindle", 2),
        ("program_end", 2),
    ]


def test_m00_leaves_the_spindle_as_it_is_and_takes_no_time() -> None:
    program = run("M03 S100\nM00 G00 Z1\nX1\nM30")
    assert program.moves[1].mode.spindle.direction == 1
    assert all(move.kind == "rapid" for move in program.moves)


def test_feeds_of_other_modes_are_not_carried_over() -> None:
    program = run("M3 S600\nG94 F120\nG1 X1\nG95 F0.2\nX2\nG98 F60\nX3\nM2")
    assert [(move.feed, move.mode.per_revolution) for move in program.moves] == [(0.002, False), (0.0002, True), (0.001, False)]


def test_constant_surface_speed_is_metres_per_minute() -> None:
    spindle = run("G96 S150 M03\nG00 X25\nM2").moves[0].mode.spindle
    assert (spindle.surface, spindle.speed, spindle.limit) == (True, 2.5, None)
    feet = run("G70\nG96 S500 M03\nG00 X1\nM2").moves[0].mode.spindle
    assert feet.speed == pytest.approx(500 * 0.3048 / 60)


def test_block_delete_is_a_switch() -> None:
    text = "G00 X1\n/X2\nM2"
    assert len(interpret(read_program(text)).moves) == 1
    assert len(interpret(read_program(text, block_delete=False)).moves) == 2


def test_what_the_program_leaves_open_is_told() -> None:
    assert run("G00 X1\nM2").assumed == {
        "start": "X0 Z0 mm, X as a radius", "units": "millimetres", "distance": "absolute positions", "feed_mode": "feed per minute",
        "x_mode": "radius", "plane": "the plane of X and Z",
    }  # fmt: skip
    assert run("G71 G90 G94 G18\nG00 X1\nM2").assumed == {"start": "X0 Z0 mm, X as a radius", "x_mode": "radius"}


def test_a_start_elsewhere() -> None:
    program = interpret(read_program("G91\nG00 X1\nM2"), start=(0.01, 0.02))
    assert ends(program) == [(11, 20)]


def test_messages_and_coolant_of_linuxcnc() -> None:
    program = run("(MSG, turn the part)\nM8\nM7\nM9\nM2", "linuxcnc")
    assert [event.kind for event in program.events] == ["message", "flood_on", "mist_on", "flood_off", "spindle", "program_end"]
    assert program.events[0].text == "turn the part"


def test_fanuc_words() -> None:
    program = run("O0001\nG21 G99\nG50 S2000\nG96 S150 M03\nT0303\nG00 X50. Z2.\nG01 U-10. W-3. F.2\nG04 P500\nG28 U0\nM30", "fanuc")
    assert ends(program) == [(25, 2), (20, -1), (20, -1), (20, -1), (100, -1)]
    assert program.moves[0].mode.tool == 3
    assert program.moves[0].mode.spindle.limit == pytest.approx(2000 * 2 * math.pi / 60)
    assert program.moves[2].mode.seconds == 0.5
    assert program.assumed["reference_point"] == "X100 Z200 mm, X as a radius"


def test_odd_encodings_are_read() -> None:
    plain = [block.words for block in read_program(b"G0 X1 (\xc3\x98 20)\nM2").blocks]
    for content in (b"\xef\xbb\xbfG0 X1\r\nM2", "G0 X1 (Ø 20)\nM2".encode("cp1252"), "G0 X1\nM2".encode("utf-16"), b"G0 X1\rM2\x1a"):
        assert [block.words for block in read_program(content).blocks] == plain


def test_canon_has_the_schema_of_the_references() -> None:
    made = canon(run("G71 G90 G94 G18\nM03 S1000\nG00 X20 Z2\nG02 X22 Z4 R2 F120\nM30"))
    assert made["schema"] == "lathe-canon/1"
    assert made["moves"][1] == {
        "i": 1, "line": 4, "type": "arc", "from": [20.0, 2.0], "x": 22.0, "z": 4.0, "feed": 120.0, "feed_mode": "per_min",
        "arc": {"dir": "cw", "cx": 20.0, "cz": 4.0, "r": 2.0, "r_end": 2.0, "sweep_deg": -90.0},
        "spindle": {"dir": "cw", "mode": "rpm", "speed": 1000.0, "max_rpm": None}, "tool": None,
    }  # fmt: skip
    assert made["summary"]["counts"] == {"rapid": 1, "arc": 1}
    assert made["events"][0] == {"type": "spindle", "line": 2, "before_move": 0, "dir": "cw"}


def test_corners_are_chamfered_and_rounded_between_straight_feeds() -> None:
    text = "G21 G99 G97 S800 M03\nG00 X40. Z0.\nG01 Z-20. F0.2\nX45. ,C1.\nZ-30. ,R2.\nX60.\nM30\n"
    program = interpret(read_program(text, "turn.nc"), "fanuc")
    ends = [(move.kind, round(2e3 * move.end_x, 6), round(1e3 * move.end_z, 6)) for move in program.moves[1:]]
    assert ends == [
        ("feed", 40.0, -20.0), ("feed", 43.0, -20.0), ("feed", 45.0, -21.0), ("feed", 45.0, -28.0),
        ("arc", 49.0, -30.0), ("feed", 60.0, -30.0),
    ]  # fmt: skip
    arc = program.moves[5].arc
    assert arc is not None and arc.clockwise and arc.radius == pytest.approx(0.002)
    assert (arc.centre_x, arc.centre_z) == (pytest.approx(0.0245), pytest.approx(-0.028))


@pytest.mark.parametrize("text", ["X45. K-1.\nZ-30. R2.\n", "X45. C1.\nZ-30. R2.\n", "X45. K-1.\nZ-30. ,R2.\n"])
def test_corners_are_written_without_a_comma_too(text: str) -> None:
    comma, plain = (
        interpret(read_program(f"G21 G99 G97 S800 M03\nG00 X40. Z0.\nG01 Z-20. F0.2\n{corners}X60.\nM30\n"), "fanuc").moves
        for corners in ("X45. ,C1.\nZ-30. ,R2.\n", text)
    )
    assert plain == comma


@pytest.mark.parametrize(
    ("text", "x", "z"),
    [
        ("G01 X40. ,A90. F0.1", 20.0, 0.0),
        ("X50. A135.", 25.0, -10.0),
        ("Z-20. ,A150.", 15.0 + 20.0 / 3.0**0.5, -20.0),
        ("W-5. ,A180.", 15.0, -5.0),
    ],
)
def test_the_end_of_a_line_is_told_by_its_angle(text: str, x: float, z: float) -> None:
    program = interpret(read_program(f"G21 G99 G97 S800 M03 F0.1\nG00 X30. Z0.\nG01\n{text}\nM30\n"), "fanuc")
    move = program.moves[-1]
    assert (move.end_x, move.end_z) == (pytest.approx(1e-3 * x), pytest.approx(1e-3 * z, abs=1e-12))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("G01 X45. I1.\nZ-3.\n", "I1. says that the next move goes to +X, and it goes to -Z. Correct the sign or the letter."),
        ("G01 X45. K1.\nZ-3.\n", "K1. says that the next move goes to +Z, and it goes to -Z."),
        ("G01 X45. R-1.\nZ3.\n", "R-1. says that the next move goes to -Z, and it goes to +Z."),
        ("G01 X45. K-1.\nX50. Z-3.\n", "K-1. needs a move along one axis before it and one along the other behind it. Write ,C1 for any"),
        ("G01 X45. ,A200.\n", "A line at ,A200. does not get to that X. Correct the angle: it counts from +Z towards +X."),
        ("G01 X45. Z-3. A20.\n", "A20. is the angle of a line whose end is named by X and Z. Give one of X and Z beside an angle."),
        ("G01 X45. ,C1.\nG00 Z-30.\n", ",C1. needs a straight feed before and behind it."),
        ("G01 X45. ,R9.\nZ-3.\n", ",R9. takes 9 mm off moves of 2.5 and 3 mm. Make it smaller."),
        ("G01 X45. ,C1.\n", ",C1. has no move behind it. Take it out."),
        ("G01 X45. ,C0\nZ-3.\n", ",C0 is no size of a corner"),
    ],
)
def test_a_corner_that_cannot_be_broken_is_told(text: str, sentence: str) -> None:
    with pytest.raises(ProgramError) as refused:
        interpret(read_program(f"G21 G99 G97 S800 M03 F0.1\nG00 X40. Z0.\n{text}M30\n", "turn.nc"), "fanuc")
    assert str(refused.value).startswith(f"turn.nc:3: {sentence}")


def test_a_position_set_where_the_tool_stands_moves_the_origin_and_says_so() -> None:
    text = "G21 G99 G97 S800 M03\nG50 X150. Z200. S1500\nG00 X40. Z0.\nM30\n"
    program = interpret(read_program(text, "turn.nc"), "fanuc")
    assert (program.moves[0].end_x, program.moves[0].end_z) == (pytest.approx(0.045), 0.0)
    assert program.warnings[0].sentence.startswith(
        "G50 puts the origin to X 25 mm (radius), Z 0 mm, as the tool stands at X 100 mm (radius)"
    )


@pytest.mark.parametrize(
    ("text", "ends"),
    [
        ("G90 G00 X40. Z2.\nG91 G01 X-10. Z-5. F0.1\nG90 X50.\n", [(40.0, 2.0), (30.0, -3.0), (50.0, -3.0)]),
        ("G00 X40. Z2.\nG77 X36. Z-20. F0.2\n", [(40.0, 2.0), (36.0, 2.0), (36.0, -20.0), (40.0, -20.0), (40.0, 2.0)]),
        ("G00 X40. Z2.\nG79 X20. Z-2. F0.2\n", [(40.0, 2.0), (40.0, -2.0), (20.0, -2.0), (20.0, 2.0), (40.0, 2.0)]),
        ("G92 S2000\nG94 G00 X40. Z2.\nG01 X30. F100\n", [(40.0, 2.0), (30.0, 2.0)]),
    ],
)
def test_system_b_has_its_own_numbers_for_the_same_work(text: str, ends: list[tuple[float, float]]) -> None:
    program = interpret(read_program(f"G21 G95 G97 S800 M03\n{text}M30\n", "turn.nc"), "fanuc-b")
    assert [(round(2e3 * move.end_x, 6), round(1e3 * move.end_z, 6)) for move in program.moves] == ends


def test_offsets_shift_the_coordinates_of_both_controls() -> None:
    text = "G21 G99 G97 S800 M03\nG10 L2 P2 X-10. Z-30.\nG55\nG00 X40. Z2.\nG52 X2. Z1.\nX40. Z2.\nG52 X0 Z0\nG54\nX40. Z2.\nM30\n"
    program = interpret(read_program(text, "turn.nc"), "fanuc")
    ends = [(round(2e3 * move.end_x, 6), round(1e3 * move.end_z, 6)) for move in program.moves]
    assert ends == [(30.0, -28.0), (32.0, -27.0), (40.0, 2.0)]
    wear = "G21 G99 G97 S800 M03\nG10 P1 X-0.04 Z0.1 R0.8 Q3\nT0101\nG00 X40. Z2.\nT0100\nX40. Z2.\nM30\n"
    program = interpret(read_program(wear, "turn.nc"), "fanuc")
    assert [(round(2e3 * move.end_x, 6), round(1e3 * move.end_z, 6)) for move in program.moves] == [(39.96, 2.1), (40.0, 2.0)]
    text = (
        "G21 G18 G8 F100\nG10 L2 P1 X1 Z2\nG0 X10 Z0\nG92 X0\nG1 X1\nG92.2\nG1 X2\nG92.3\nG1 X3\nG92.1\nG10 L20 P1 X0 Z0\nG1 X4 Z-1\nM2\n"
    )
    program = interpret(read_program(text, "turn.ngc"), "linuxcnc")
    ends = [(round(1e3 * move.end_x, 6), round(1e3 * move.end_z, 6)) for move in program.moves]
    assert ends == [(11.0, 2.0), (12.0, 2.0), (3.0, 2.0), (14.0, 2.0), (18.0, 1.0)]


def test_a_spindle_speed_without_s_is_the_one_that_turned() -> None:
    program = interpret(read_program("G21 G99 G50 S3000\nG96 S180 M03\nG00 X40. Z0.\nG97\nG01 Z-5. F0.1\nM30\n", "turn.nc"), "fanuc")
    assert program.moves[-1].mode.spindle.speed == pytest.approx(3.0 / 0.020)
    assert program.warnings[0].sentence == "G97 has no S word and holds the speed of 1432 rpm."
    program = interpret(read_program("G21 G18 F100\nG96 S180 D2000 M3\nG0 X20\nG97\nG1 Z-5\nM2\n", "turn.ngc"), "linuxcnc")
    assert program.moves[-1].mode.spindle.speed == pytest.approx(6.0 * math.pi)
    assert program.warnings[0].sentence == "G97 has no S word; the 180 of the surface speed counts in rpm now."


def test_a_length_offset_is_that_of_the_tool() -> None:
    text = "G21 G18 G8 F100\nG10 L1 P2 X1 Z-2\nT2 M6\nG0 X10 Z0\nG43\nG0 X10 Z0\nG49\nG0 X10 Z0\nG43 H0\nG0 X12\nM2\n"
    program = interpret(read_program(text, "turn.ngc"), "linuxcnc")
    ends = [(round(1e3 * move.end_x, 6), round(1e3 * move.end_z, 6)) for move in program.moves]
    assert ends == [(10.0, 0.0), (11.0, -2.0), (10.0, 0.0), (12.0, 0.0)]
    with pytest.raises(ProgramError, match="H44 names an offset that there is not"):
        interpret(read_program("G43 H44\nM2\n", "turn.ngc"), "linuxcnc")


def test_a_tool_change_stops_the_spindle_of_linuxcnc_only() -> None:
    text = "G21 G18 F100 S500 M3\nG0 X10\nT2 M6\nG0 X11\nM2\n"
    assert [move.mode.spindle.direction for move in interpret(read_program(text), "linuxcnc").moves] == [1, 0]
    text = "G21 G98 F100 S500 M3\nG0 X10.\nT0202 M6\nG0 X11.\nM30\n"
    assert [move.mode.spindle.direction for move in interpret(read_program(text), "fanuc").moves] == [1, 1]


def test_an_origin_shift_is_restored_as_it_was_set() -> None:
    text = "G21 G18 G8 F100\nG0 X20 Z0\nG92 X26 Z3\nG1 X25\nG92.3\nG1 X24\nG92.2\nG1 X23\nG92.3\nG1 X22\nG92.1\nG92.3\nG1 X21\nM2\n"
    program = interpret(read_program(text, "turn.ngc"), "linuxcnc")
    assert [round(1e3 * move.end_x, 6) for move in program.moves] == [20.0, 19.0, 18.0, 23.0, 16.0, 21.0]


@pytest.mark.parametrize("call", ["G154 P3", "G54.1 P3"])
def test_further_work_offsets_are_set_by_g10_and_called_by_number(call: str) -> None:
    text = f"G21 G99 G97 S800 M03\nG10 L20 P3 X-10. Z-30.\n{call}\nG00 X40. Z2.\nG54\nX40. Z2.\nM30\n"
    moves = interpret(read_program(text, "turn.nc"), "fanuc").moves
    assert [(round(2e3 * move.end_x, 6), round(1e3 * move.end_z, 6)) for move in moves] == [(30.0, -28.0), (40.0, 2.0)]


def test_a_further_work_offset_without_a_number_is_refused() -> None:
    with pytest.raises(ProgramError, match=r"turn.nc:1: G154 needs the number of a work offset. Write it as G154 P1, up to P300."):
        interpret(read_program("G154\nM30\n", "turn.nc"), "fanuc")


@pytest.mark.parametrize("code", ["G187 P1 E0.01", "G103 P1", "G23", "G25"])
def test_a_code_of_the_control_that_moves_nothing_is_told(code: str) -> None:
    program = interpret(read_program(f"{code}\nG00 X40. Z2.\nM30\n", "turn.nc"), "fanuc")
    assert len(program.moves) == 1
    assert "changes nothing in the simulation." in program.warnings[0].sentence
