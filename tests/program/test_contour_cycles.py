"""Contour cycles on hard inputs: starts at the contour, noses in a contour, pockets, blocks in between, names in subprograms."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from lathesim.errors import ProgramError
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Move, Program, Tool
from lathesim.program.words import read_program
from tests.program import cycle_invariants as keeps

FANUC = "G21 G99 G97 S500 M3\nT0101\n"
LINUXCNC = "G21 G18 G8 G90 G94 F140\nS700 M3\n"


def run(text: str, dialect: str = "fanuc", tools: dict[int, Tool] | None = None) -> Program:
    head, end = (LINUXCNC, "M2\n") if dialect == "linuxcnc" else (FANUC, "M30\n")
    return interpret(read_program(f"{head}{text}{end}"), dialect, tools=tools)


def of_cycle(program: Program, code: str) -> list[Move]:
    return [move for move in program.moves if move.mode.cycle == code]


def levels(moves: list[Move], across: bool = False) -> list[float]:
    """Return the depths [mm] of the level cuts in their order."""
    found: list[float] = []
    for move in moves:
        x, z = (move.start_x, move.end_x), (move.start_z, move.end_z)
        depth, along = (z, x) if across else (x, z)
        if move.kind == "feed" and abs(depth[1] - depth[0]) < 1e-12 and abs(along[1] - along[0]) > 1e-4:
            found.append(round(1e3 * depth[1], 6))
    return found


PIT = "N10 G1 X50. Z0 F0.1\nZ-5.\nX40. Z-10.\nZ-20.\nX50. Z-25.\nN20 X52.\n"
RECESS = "N10 G1 X30. Z0 F0.1\nZ-5.\nX40. Z-10.\nZ-20.\nX30. Z-25.\nN20 X28.\n"
FACE_PIT = "N10 G1 X60. Z0 F0.1\nX50.\nX40. Z-5.\nX20.\nX10. Z0\nN20 Z1.\n"


@pytest.mark.parametrize(
    ("start", "first", "second", "contour", "wanted"),
    [
        ("X50. Z2.", "G71 U1. R0.5", "G71 P10 Q20 U0.4 W0 F0.2", PIT, [24.2, 23.2, 22.2, 21.2]),
        ("X50. Z2.", "G71 U1. R0.5", "G71 P10 Q20 U0 W0 F0.2", PIT, [24.0, 23.0, 22.0, 21.0]),
        ("X49.9 Z2.", "G71 U1. R0.5", "G71 P10 Q20 U0 W0 F0.2", PIT, [23.95, 22.95, 21.95, 20.95]),
        ("X30. Z2.", "G71 U1. R0.5", "G71 P10 Q20 U-0.4 W0 F0.2", RECESS, [15.8, 16.8, 17.8, 18.8]),
        ("X30.1 Z2.", "G71 U1. R0.5", "G71 P10 Q20 U0 W0 F0.2", RECESS, [16.05, 17.05, 18.05, 19.05]),
        ("X62. Z0", "G72 W1. R0.5", "G72 P10 Q20 U0 W0.2 F0.2", FACE_PIT, [-0.8, -1.8, -2.8, -3.8]),
        ("X62. Z0", "G72 W1. R0.5", "G72 P10 Q20 U0 W0 F0.2", FACE_PIT, [-1.0, -2.0, -3.0, -4.0]),
    ],
)
def test_a_cycle_that_starts_at_its_contour_cuts_down_to_it_by_its_depth(
    start: str, first: str, second: str, contour: str, wanted: list[float]
) -> None:
    code = first[:3]
    moves = of_cycle(run(f"G0 {start}\n{first}\n{second}\n{contour}G70 P10 Q20\n"), code)
    made = levels(moves, across=code == "G72")
    assert list(dict.fromkeys(made))[: len(wanted)] == wanted
    assert keeps.from_start_to_start(moves) == []


def test_linuxcnc_takes_the_first_move_that_moves_as_the_way_to_the_contour() -> None:
    text = "G0 X15 Z14.4\no100 sub\nG1 X14.3 Z12.5\nG1 X0.01\nG1 Z0 X14.325\nG1 X15\no100 endsub\nG71 Q100 X14.3 Z12.5 D0.25 I0.2 R1\n"
    moves = of_cycle(run(text, "linuxcnc"), "G71")
    made = levels(moves)
    assert all(abs(here - there - 0.2) < 1e-6 for here, there in pairwise([14.3, *made]))
    assert made[-1] == 0.3
    slope = (14.325 - 0.01) / -12.5
    from_wall = [(x - 0.01e-3 - slope * (z - 12.5e-3)) / math.hypot(1.0, slope) for move in moves for x, z in keeps.points(move)]
    assert min(from_wall) > 0.25e-3 - 1e-9
    assert all(abs(move.arc.radius - 0.25e-3) < 1e-9 for move in moves if move.arc is not None)


def test_a_finishing_cycle_of_linuxcnc_over_its_contour_is_named() -> None:
    contour = "O100 SUB\nG0 X5 Z1\nG1 Z-10\nG1 X14\nO100 ENDSUB\nG0 X20 Z2\nG71 Q100 I2\n"
    assert run(f"{contour}G70 Q100 X20 Z2\n", "linuxcnc").warnings == ()
    over = run(f"{contour}G70 Q100\n", "linuxcnc")
    assert (over.moves[-4].end_x, over.moves[-4].end_z) == pytest.approx((0.020, -0.010))
    assert over.warnings[0].sentence.startswith("G70 begins at X 20 mm (radius), Z -10 mm, over its contour")


def test_linuxcnc_leaves_pockets_to_their_own_form_of_the_cycle() -> None:
    contour = "G0 X15 Z0\nO200 SUB\nG1 X10 Z0\nG1 X10 Z-14\nG1 X3\nG1 X7 Z-22\nG1 X15\nO200 ENDSUB\n"
    whole, later, only = (run(f"{contour}{code} Q200 X15 Z0 D0.04 I0.5 R1\n", "linuxcnc").moves for code in ("G71", "G71.1", "G71.2"))
    assert min(move.end_x for move in later) == pytest.approx(10.04e-3, abs=1e-9)
    assert max(levels(list(only))[:-1]) == 10.0
    passes = [{level for level in levels(list(moves)) if level != 10.04} for moves in (whole, later, only)]
    assert passes[0] == passes[1] | passes[2]
    for moves in (whole, only):
        assert min(move.end_x for move in moves) == pytest.approx(3.065e-3, abs=1e-5)


BALL = "N1 G0 X19.\nG1 G42 Z0.5 F0.18\nX20. Z0\nG3 X50. Z-15. R15.\nG1 Z-25.\nX99.\nN2 G40 X102.\n"
NOSE = {1: Tool(0.8e-3, 3)}


def test_g70_follows_the_nose_compensation_of_its_contour_and_roughing_says_that_it_does_not() -> None:
    program = run(f"G0 X102. Z2.\nG71 U2. R0.2\nG71 P1 Q2 U1. W0.1 F0.35\n{BALL}G70 P1 Q2\nG0 X200. Z200.\n", tools=NOSE)
    arc = next(move for move in of_cycle(program, "G70") if move.arc is not None and move.arc.radius > 2e-3)
    assert arc.arc is not None
    assert (arc.arc.radius, arc.end_x, arc.end_z) == pytest.approx((15.8e-3, 25e-3, -15.8e-3), abs=1e-9)
    assert of_cycle(program, "G70")[-1].end_x == 51e-3
    rough = next(move for move in of_cycle(program, "G71") if move.arc is not None)
    assert rough.arc is not None
    assert rough.arc.radius == pytest.approx(15e-3)
    assert "G70" in program.assumed["nose_in_cycles"]


def test_nose_compensation_before_the_cycles_acts_in_g70_only() -> None:
    contour = BALL.replace("G42 ", "").replace("G40 ", "")
    program = run(f"G0 X102. Z4.\nG42 G0 Z2.\nG71 U2. R0.2\nG71 P1 Q2 U1. W0.1 F0.35\n{contour}G70 P1 Q2\nG40 G0 X200. Z200.\n", tools=NOSE)
    radii = {code: next(m.arc.radius for m in of_cycle(program, code) if m.arc and m.arc.radius > 2e-3) for code in ("G71", "G70")}
    assert radii == pytest.approx({"G71": 15e-3, "G70": 15.8e-3})


@pytest.mark.parametrize("cycle", ["G76 X27. Z-17. K0.9 D0.3 F1.5", "G92 X27. Z-17. F1.5", "G75 X27. I1. F0.1"])
def test_pecks_and_threads_run_without_nose_compensation_and_say_so(cycle: str) -> None:
    program = run(f"G0 X40. Z4.\nG42 G0 X32. Z2.\n{cycle}\nG40 G0 X50. Z20.\n", tools=NOSE)
    code = cycle[:3]
    assert min(move.end_x for move in of_cycle(program, code)) == pytest.approx(13.5e-3)
    assert "all other cycles run without it" in program.assumed["nose_in_cycles"]


def test_linuxcnc_says_that_it_passes_over_compensation_in_a_contour() -> None:
    contour = "O100 SUB\nG0 X5\nG42.1 D1.6 L2\nG1 Z-10\nG1 X14\nO100 ENDSUB\nG0 X20 Z2\n"
    program = run(f"{contour}G70 Q100\n", "linuxcnc")
    assert any("does nothing in LinuxCNC" in warned.sentence for warned in program.warnings)
    assert min(move.end_x for move in program.moves[1:]) == 5e-3


def test_finishing_takes_the_speeds_and_switches_of_its_contour() -> None:
    program = run("G0 X52. Z2.\nG70 P1 Q2\nGOTO 9\nN1 G0 X20. S900\nG1 Z-5. F0.1 M8\nN2 X52.\nN9 M5\n")
    cuts = [move for move in of_cycle(program, "G70") if move.kind == "feed"]
    assert cuts[0].mode.spindle.speed == pytest.approx(900 * 2 * math.pi / 60)
    assert any(event.kind == "flood_on" and program.moves[event.before_move - 1].mode.cycle == "G70" for event in program.events)


def test_blocks_between_a_cycle_and_its_contour_are_named() -> None:
    contour = "N10 G0 X20.\nG1 Z-10. F0.1\nX40.\nN20 X50.\n"
    cycle = "G0 X50. Z2.\nG71 U2. R0.5\nG71 P10 Q20 U0.4 W0.1 F0.2\n"
    assert run(f"{cycle}{contour}").warnings == ()
    told = [warned.sentence for warned in run(f"{cycle}G0 X60.\n(a note)\nG4 X2.\n{contour}").warnings]
    assert told[0].startswith("Lines 6 to 8 stand between G71 and its contour.")


def test_an_allowance_that_is_taken_off_the_part_is_named() -> None:
    contour = "N10 G0 X20.\nG1 Z-10. F0.1\nX40.\nN20 X50.\n"
    program = run(f"G0 X50. Z2.\nG71 U2. R0.5\nG71 P10 Q20 U-0.4 W0.1 F0.2\n{contour}")
    assert program.warnings[0].sentence.startswith("U-0.4 of G71 cuts into the contour")
    assert max(here - there for here, there in pairwise([25.0, *levels(of_cycle(program, "G71"))])) <= 2.0


@pytest.mark.parametrize("call", ["G71 Q100 I0.2", "G70 Q100", "O100 CALL"])
def test_a_name_of_the_main_program_is_not_known_in_a_contour(call: str) -> None:
    with pytest.raises(ProgramError, match="#<sx> is local to the calling program") as refused:
        run(f"G0 X15 Z14\n#<sx>=14.3\no100 sub\nG1 X#<sx> Z12\nG1 X1\nG1 Z0 X15\no100 endsub\n{call}\n", "linuxcnc")
    assert "#<_sx>" in refused.value.remedy


def test_a_step_smaller_than_the_distance_is_left_out_of_the_roughed_contour() -> None:
    contour = "O100 SUB\nG0 X5 Z1\nG1 Z-10\nG1 X5.08\nG1 Z-20\nG3 X5.6 Z-20.52 R0.6\nG1 X14\nO100 ENDSUB\nG0 X20 Z2\n"
    moves = of_cycle(run(f"{contour}G71 Q100 D0.2 I2 R0.5\n", "linuxcnc"), "G71")
    wall = [point for move in of_cycle(run(f"{contour}G70 Q100\n", "linuxcnc"), "G70")[1:] for point in keeps.points(move)]
    last = [point for move in moves[-6:] if move.kind != "rapid" for point in keeps.points(move)]
    nearest = [min(math.hypot(x - there[0], z - there[1]) for there in wall[::4]) for x, z in last[::8]]
    assert min(nearest) == pytest.approx(0.2e-3, abs=2e-5)


def test_a_distance_that_does_not_go_into_a_contour_is_named_as_one() -> None:
    contour = "O100 SUB\nG0 X8 Z1\nG1 Z-10\nG1 X5\nG1 Z-10.3\nG1 X14\nO100 ENDSUB\nG0 X20 Z2\n"
    assert min(move.end_x for move in run(f"{contour}G71 Q100 D0.5 I2\n", "linuxcnc").moves) == pytest.approx(8.5e-3)
    with pytest.raises(ProgramError, match=r"A contour at a distance of 0\.5 mm does not fit into"):
        run("O100 SUB\nG0 X8 Z0\nG1 X7.8 Z-0.2\nG1 X12\nG1 X14 Z-9\nO100 ENDSUB\nG0 X20 Z2\nG71 Q100 D0.5 I2\n", "linuxcnc")
