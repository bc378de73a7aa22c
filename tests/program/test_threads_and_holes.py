"""Threads as one motion, several starts, tapping, and drilling along Z: the moves and the rows of the path that programs give."""

from __future__ import annotations

import numpy as np
import pytest

from lathesim.errors import ProgramError
from lathesim.path_columns import FEED_MODE, KIND, LINE_MOVE, START_ANGLE, TAP_OUT, THREAD, THREAD_ON
from lathesim.program.canonical_moves import linuxcnc_text
from lathesim.program.explain import explain
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Program, Tool
from lathesim.program.path import lay_path
from lathesim.program.program_checks import checked
from lathesim.program.program_file import detect_dialect, load_program
from lathesim.program.words import read_program
from tests.shared_data import SHARED, needs_shared

FOUND = SHARED / "found_3" / "programs"
HEAD = "G21 G99 G97 S300 M3\nG0 X32. Z5.\n"


def run(text: str, dialect: str = "fanuc") -> Program:
    return interpret(read_program(text), dialect)


def modes(program: Program) -> list[float]:
    """Return how each row of the path that is no rapid is walked."""
    table = lay_path(program).table
    return [float(mode) for mode in table[table[:, KIND] == LINE_MOVE, FEED_MODE]]


@needs_shared
def test_chained_threads_and_run_outs_are_one_motion() -> None:
    assert modes(load_program(FOUND / "chained_g32.nc", "fanuc")) == [THREAD, THREAD_ON]
    run_outs = modes(load_program(FOUND / "g76_pullout_waits.nc", "fanuc"))
    assert run_outs == [THREAD, THREAD_ON] * (len(run_outs) // 2)
    assert run_outs


@pytest.mark.parametrize(
    ("text", "dialect", "expected"),
    [
        (f"{HEAD}G32 Z-20. F2.\nX35. Z-23.\nZ-30. F3.\nM30", "fanuc", [THREAD, THREAD_ON, THREAD_ON]),
        (f"{HEAD}G32 Z-20. F2.\nG4 X0.5\nG32 Z-23.\nG0 X33.\nG32 Z-30.\nM30", "fanuc", [THREAD, THREAD, THREAD]),
        (f"{HEAD}G32 Z-20. F2.\nM4\nG32 Z5.\nM30", "fanuc", [THREAD, THREAD]),
        (f"{HEAD}G76 P011060 Q200 R0.05\nG92 X29. Z-20. F2.\nX28.\nM30", "fanuc", [THREAD, THREAD_ON] * 2),
        ("G21 G18 G97 S300 M3\nG0 X10 Z5\nG33 Z-20 K2\nX12 Z-22\nG33 Z-30 K3\nM2", "linuxcnc", [THREAD, THREAD_ON, THREAD_ON]),
        (
            "G21 G18 G97 S300 M3\nG0 X12 Z5\nG76 P2 Z-20 I-2 J0.9 K0.9001 L3 E2\nM2",
            "linuxcnc",
            [THREAD, THREAD_ON, THREAD_ON, THREAD_ON] * 2,
        ),
    ],
    ids=["modal blocks", "dwell and rapid wait", "the other sense waits", "G92 runs out as G76 says", "G33", "tapers of G76"],
)
def test_a_thread_waits_only_behind_what_is_no_thread(text: str, dialect: str, expected: list[float]) -> None:
    assert modes(run(text, dialect)) == expected


def test_a_modal_block_of_g32_has_its_own_lead_along_the_longer_axis() -> None:
    program = run(f"{HEAD}G32 Z-20. F2.\nX36. Z-23. F3.\nM30")
    assert [move.feed for move in program.moves if move.kind == "thread"] == pytest.approx([0.002, 0.003 * np.hypot(2.0, 3.0) / 3.0])


def test_the_run_out_of_g92_ends_one_lead_outside_the_thread() -> None:
    passes = [move for move in run(f"{HEAD}G76 P011060 Q200 R0.05\nG92 X29. Z-20. F2.\nM30").moves if move.kind == "thread"]
    assert [move.end_x for move in passes] == pytest.approx([0.0145, 0.0165])
    assert [move.end_z for move in passes] == pytest.approx([-0.018, -0.020])


def test_the_run_up_of_a_thread_counts_all_its_moves() -> None:
    assert checked(run(f"{HEAD}G32 Z2. F2.\nZ-1. F2.\nM30")) == []
    told = checked(run(f"{HEAD}G32 Z4. F2.\nZ2. F2.\nM30"))
    assert [warned.sentence for warned in told] == ["The thread is only 1.5 leads long, too short to run up to its speed."]


def test_nose_compensation_leaves_a_chain_of_threads_as_it_is() -> None:
    text = "G21 G99 G97 S300 M3\nG0 X40. Z5. T0303\nG42 G1 X32. F0.2\nG32 Z-20. F2.\nX36. Z-23.\nG40 G0 X50.\nM30"
    program = interpret(read_program(text), "fanuc", tools={3: Tool(0.0004, 3)})
    threads = [move for move in program.moves if move.kind == "thread"]
    assert [(move.end_x, move.end_z) for move in threads] == [(0.016, -0.020), (0.018, -0.023)]
    assert modes(program)[-2:] == [THREAD, THREAD_ON]
    assert "Nose compensation does not act on threads" in program.warnings[0].sentence


# ---- start angles ----------------------------------------------------------------------------------------------------------------------


def angles(program: Program) -> list[float]:
    """Return the start angles of the threads in turns of the spindle."""
    table = lay_path(program).table
    return [float(angle) / (2.0 * np.pi) for angle in table[table[:, FEED_MODE] == THREAD, START_ANGLE]]


@needs_shared
def test_the_second_start_begins_half_a_turn_later() -> None:
    assert angles(load_program(FOUND / "g32_q_start_angle.nc", "auto")) == [0.0, 0.5]
    program = load_program(FOUND / "g33_start_angle.ngc", "auto")
    assert angles(program) == [0.5]
    assert "2.10" in program.assumed["start_angle"]


@pytest.mark.parametrize(
    ("text", "dialect", "expected"),
    [
        (f"{HEAD}G92 X29. Z-20. F4. Q90000\nX28.\nX28. Q270000\nM30", "fanuc", [0.25, 0.0, 0.75]),
        (f"{HEAD}G76 X29. Z-20. K0.9 D0.899 F4. Q180000\nM30", "fanuc", [0.5, 0.5]),
        ("G21 G18 G97 S300 M3\nG0 X12 Z5\nG76 P2 Z-20 I-2 J0.9 K0.9001 D90\nM2", "linuxcnc", [0.25, 0.25]),
    ],
    ids=["G92, for its block alone", "G76 in one block", "G76 of LinuxCNC"],
)
def test_cycles_have_start_angles_too(text: str, dialect: str, expected: list[float]) -> None:
    assert angles(run(text, dialect)) == pytest.approx(expected)


def test_a_start_angle_that_is_likely_a_slip_or_does_nothing_is_told() -> None:
    program = run(f"{HEAD}G32 Z-20. F2. Q180\nZ-25. Q90000\nM30")
    assert [warned.sentence for warned in program.warnings] == [
        "Q180 is a start angle of 0.18 degrees. Write Q180000 for half a turn.",
        "Q90000 changes nothing: the thread continues the previous one.",
    ]


# ---- holes -----------------------------------------------------------------------------------------------------------------------------

DRILL = "G21 G18 G8 G90 G94 S500 M3 F100\nG0 X0 Z5\nG17\n{}\nG18\nM2"


def made(program: Program) -> list[tuple[str, float, float]]:
    """Return the moves behind the first as (kind, x, z) in mm, X as a radius."""
    return [(move.kind, round(1e3 * move.end_x, 6), round(1e3 * move.end_z, 6)) for move in program.moves[1:]]


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        ("G98 G81 R2 Z-8", [("rapid", 0, 5), ("rapid", 0, 2), ("feed", 0, -8), ("rapid", 0, 5)]),
        ("G99 G82 R2 Z-8 P0.5", [("rapid", 0, 5), ("rapid", 0, 2), ("feed", 0, -8), ("dwell", 0, -8), ("rapid", 0, 2)]),
        ("G98 G73 R2 Z-8 Q5", [("rapid", 0, 5), ("rapid", 0, 2), ("feed", 0, -3), ("rapid", 0, -2.746), ("feed", 0, -8), ("rapid", 0, 5)]),
        ("G98 G85 R2 Z-8", [("rapid", 0, 5), ("rapid", 0, 2), ("feed", 0, -8), ("feed", 0, 2), ("rapid", 0, 5)]),
        ("G98 G86 R2 Z-8 P0.5", [("rapid", 0, 5), ("rapid", 0, 2), ("feed", 0, -8), ("dwell", 0, -8), ("rapid", 0, 5)]),
        ("G98 G89 R2 Z-8 P0.5", [("rapid", 0, 5), ("rapid", 0, 2), ("feed", 0, -8), ("dwell", 0, -8), ("feed", 0, 5)]),
        ("G98 G84 R2 Z-8", [("rapid", 0, 5), ("rapid", 0, 2), ("feed", 0, -8), ("feed", 0, 5)]),
        ("G98 G81 R10 Z-8", [("rapid", 0, 10), ("rapid", 0, 10), ("feed", 0, -8), ("rapid", 0, 10)]),
        (
            "G98 G81 R2 Z-8\nX3 Z-9",
            [
                *(("rapid", 0, 5), ("rapid", 0, 2), ("feed", 0, -8), ("rapid", 0, 5)),
                *(("rapid", 3, 5), ("rapid", 3, 2), ("feed", 3, -9), ("rapid", 3, 5)),
            ],
        ),
        (
            "G99 G91 G81 X3 R-3 Z-10 L2\nG90",
            [("rapid", 3, 5), ("rapid", 3, 2), ("feed", 3, -8), ("rapid", 3, 2), ("rapid", 6, 2), ("feed", 6, -8), ("rapid", 6, 2)],
        ),
    ],
    ids=["G81", "G82 to R", "G73", "G85", "G86", "G89", "G84", "R above the start", "modal", "G91 with L"],
)
def test_holes_of_linuxcnc_are_drilled_as_its_interpreter_does(block: str, expected: list[tuple[str, float, float]]) -> None:
    assert made(run(DRILL.format(block), "linuxcnc")) == expected


@needs_shared
def test_peck_drilling_on_a_linuxcnc_lathe_makes_seventeen_moves() -> None:
    program = load_program(FOUND / "drill_g17_lathe.ngc", "auto")
    assert len(program.moves) == 17
    assert [z for kind, _, z in made(program) if kind == "feed"] == [-3, -8, -13, -18, -20]
    assert [z for kind, _, z in made(program) if kind == "rapid"] == [5, 2, 2, -2.746, 2, -7.746, 2, -12.746, 2, -17.746, 5]


def test_the_spindle_stops_and_turns_back_where_a_cycle_says_so() -> None:
    directions = [move.mode.spindle.direction for move in run(DRILL.format("G86 R2 Z-8 P0.5\nG84 R2 Z-8\nG0 X5"), "linuxcnc").moves]
    assert directions == [1, 1, 1, 1, 1, 0, 1, 1, -1, 1]


def test_a_dialect_is_told_by_the_plane_in_which_it_drills() -> None:
    fanuc = "G21 G97 S800 M3\nG0 X0 Z5\nG83 Z-20 R2 Q5000 F0.1\nG80\nM30"
    assert detect_dialect(read_program(fanuc)).dialect.name == "fanuc"
    assert detect_dialect(read_program(DRILL.format("G83 R2 Z-20 Q5"))).dialect.name == "linuxcnc"


# ---- tapping ---------------------------------------------------------------------------------------------------------------------------


@needs_shared
def test_rigid_tapping_goes_in_and_out_on_one_lead_while_the_spindle_reverses() -> None:
    program = load_program(FOUND / "g33_1_tap.ngc", "auto")
    assert modes(program) == [THREAD, TAP_OUT]
    assert made(program) == [("thread", 0, -20), ("thread", 0, 5)]
    assert [move.mode.spindle.direction for move in program.moves] == [1, 1, -1]
    assert [(event.kind, event.direction) for event in program.events[:3]] == [("spindle", 1), ("spindle", -1), ("spindle", 1)]


@pytest.mark.parametrize(("mode", "feed"), [("G99", "F1.25"), ("G98", "F375.")])
def test_tapping_of_fanuc_takes_its_lead_from_either_feed(mode: str, feed: str) -> None:
    program = run(f"G21 {mode} G97 S300\nG0 X0 Z5.\nM29 S300\nG84 Z-20. R2. {feed}\nG80\nG0 Z50.\nM30")
    threads = [move for move in program.moves if move.kind == "thread"]
    assert [(move.end_z, move.mode.spin_back) for move in threads] == [(-0.020, False), (0.002, True)]
    assert [move.feed for move in threads] == pytest.approx([0.00125, 0.00125])
    assert [move.mode.spindle.direction for move in program.moves] == [0, 1, 1, -1, 1, 0]
    assert program.assumed["tapping"] == "G84 starts the standing spindle clockwise and stops it after the hole"
    assert program.assumed["tapping_depth"].startswith("deeper than Z")


def test_threads_and_taps_written_out_read_back_the_same() -> None:
    program = run("G21 G18 G97 S300 M3\nG0 X10 Z5\nG33.1 Z-20 K1.25 I2\nG33 Z-10 K2 D120\nM2", "linuxcnc")
    again = run(linuxcnc_text(program), "linuxcnc")
    for here, there in zip(program.moves, again.moves, strict=True):
        assert (here.kind, here.mode.spin_back, here.feed) == (there.kind, there.mode.spin_back, there.feed)
        assert (here.mode.start_angle, here.mode.spindle.speed) == pytest.approx((there.mode.start_angle, there.mode.spindle.speed))
    assert program.moves[2].mode.spindle.speed == pytest.approx(2.0 * program.moves[1].mode.spindle.speed)


def test_explain_tells_start_angles_taps_and_holes() -> None:
    text = DRILL.format("G83 R2 Z-8 Q5\nG18\nG33 Z-20 K2 D180\nG33.1 Z-30 K2")
    sentences = dict(explain(read_program(text), run(text, "linuxcnc")))
    assert sentences[4].startswith("G83: the peck drilling cycle, plane 2, pecks of 5; ")
    assert "begun 180 degrees behind the index, to X 0 mm (radius), Z -20 mm" in sentences[6]
    assert "the spindle turns back, and on it thread with a lead of 2 mm to X 0 mm (radius), Z -20 mm" in sentences[7]


@pytest.mark.parametrize(
    ("text", "dialect", "sentence"),
    [
        (f"{HEAD}G32 Z-20. F2. Q180.\nM30", "fanuc", "Q180. is not a start angle of a thread. It is an integer in units of 0.001 degree"),
        (f"{HEAD}G32 Z-20. F2. Q400000\nM30", "fanuc", "a start angle of 400 degrees, more than a turn. Write Q180000 for half a turn"),
        (DRILL.format("G18\nG83 R2 Z-8 Q5"), "linuxcnc", "G83 drills along Z only in G17; in G18 it drills along Y. Write G17 before it"),
        (DRILL.format("G83 R2 Z-8"), "linuxcnc", "G83 needs Q. Write it as G83 R2 Z-20 Q5"),
        (DRILL.format("G81 Z-8"), "linuxcnc", "G81 needs R"),
        (DRILL.format("G81 R-9 Z-8"), "linuxcnc", "The bottom Z of G81 lies above its R plane"),
        (DRILL.format("G81 R2 Z-8 L0"), "linuxcnc", "L0 of G81 is not a number of holes"),
        (DRILL.format("M4\nG84 R2 Z-8"), "linuxcnc", "G84 needs a spindle that turns by M3"),
        (DRILL.format("G2 X5 Z0 R5"), "linuxcnc", "G2 needs the plane of X and Z, but G17 is in force"),
        (DRILL.format("G33.1 Z-8"), "linuxcnc", "G33.1 needs a lead and has none. Add a K word"),
        ("G21 G18\nG0 X0 Z5\nG33.1 Z-8 K1\nM2", "linuxcnc", "G33.1 follows the spindle, and the spindle stands still"),
        (DRILL.format("G33.1 Z-8 K1 I-1"), "linuxcnc", "I-1 is not a factor of the speed on the way out"),
        (
            "G21 G99 G96 S100 M3\nG0 X0 Z5.\nG84 Z-20. R2. F1.25\nM30",
            "fanuc",
            "G84 follows the spindle, and constant surface speed is in force",
        ),
        ("G21 G99\nG0 X0 Z5.\nG84 Z-20. R2. F1.25\nM30", "fanuc", "G84 follows the spindle, and no speed is set"),
    ],
)
def test_threads_and_holes_that_cannot_be_made_are_refused(text: str, dialect: str, sentence: str) -> None:
    with pytest.raises(ProgramError) as refused:
        run(text, dialect)
    assert sentence in str(refused.value)
    assert refused.value.place.startswith("program:")
    assert refused.value.remedy
