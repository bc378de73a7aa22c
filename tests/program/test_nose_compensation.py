"""Nose compensation: the tool point's path was held against LinuxCNC 2.9's rs274; the nose touches the contour and never cuts into it."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from lathesim.errors import ProgramError
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Move, Program, Tool
from lathesim.program.words import read_program

CONTOUR = "G1 X10 Z2\nG1 Z-10\nG1 X14\nG3 X16 Z-12 K-2\nG1 Z-20\nG2 X18 Z-22 I2\nG1 X25\n"


def run(text: str, dialect: str = "linuxcnc", tools: dict[int, Tool] | None = None) -> Program:
    return interpret(read_program(text, "turn.nc"), dialect, tools=tools)


def compensated(code: str, contour: str = CONTOUR) -> Program:
    return run(f"G21 G18 G90 G94 G8 F100\nG0 X20 Z5\n{code}\n{contour}G40\nG1 X30 Z0\nM2\n")


def points(moves: list[Move]) -> list[tuple[float, float]]:
    found = []
    for move in moves:
        for share in [k / 40 for k in range(41)]:
            if move.arc is not None:
                angle = move.arc.start_angle + share * move.arc.sweep
                found.append((move.arc.centre_x + move.arc.radius * math.sin(angle), move.arc.centre_z + move.arc.radius * math.cos(angle)))
            else:
                found.append((move.start_x + share * (move.end_x - move.start_x), move.start_z + share * (move.end_z - move.start_z)))
    return found


def test_the_tool_point_runs_as_in_another_interpreter() -> None:
    ends = [(round(1e3 * move.end_x, 4), round(1e3 * move.end_z, 4)) for move in compensated("G42.1 D1.6 L3").moves[1:]]
    assert ends == [
        (11.6, 0.6048), (11.6, -10.0), (14.8, -10.0), (17.6, -12.8), (17.6, -20.8), (18.8, -22.0), (25.8, -22.0), (30.0, 0.0),
    ]  # fmt: skip


@pytest.mark.parametrize("radius", [0.4, 0.8, 1.6])
def test_the_centre_of_the_nose_keeps_its_distance_from_the_contour(radius: float) -> None:
    contour = [move for move in compensated("G40").moves if move.line in range(5, 11)]
    made = [move for move in compensated(f"G42.1 D{2 * radius} L0").moves if move.line in range(5, 11)]
    assert all(
        math.isclose(a.end_x, b.start_x, abs_tol=1e-12) and math.isclose(a.end_z, b.start_z, abs_tol=1e-12) for a, b in pairwise(made)
    )
    wall = points(contour)
    for x, z in points(made):
        nearest = min(math.hypot(x - there[0], z - there[1]) for there in wall)
        assert 1e-3 * radius - 2e-6 < nearest < 1e-3 * radius * math.sqrt(2.0) + 2e-4


@pytest.mark.parametrize(
    ("orientation", "point"), [(1, (1, 1)), (2, (1, -1)), (3, (-1, -1)), (4, (-1, 1)), (7, (0, -1)), (8, (-1, 0)), (9, (0, 0))]
)
def test_orientations_count_as_on_a_lathe_with_its_tool_behind(orientation: int, point: tuple[int, int]) -> None:
    head = f"G21 G99 G97 S500 M03 T0101\nG10 P1 R0.8 Q{orientation}\nG00 X40. Z5.\n"
    text = head + "G42 G00 X20. Z2.\nG01 Z-10. F0.1\nX40.\nG40 G00 X50.\nM30\n"
    end = run(text, "fanuc").moves[2]
    assert end.end_x == pytest.approx(0.0108 + 0.0008 * point[0])
    assert end.end_z == pytest.approx(-0.010 + 0.0008 + 0.0008 * point[1])


def test_a_taper_comes_out_with_compensation_and_off_without() -> None:
    """The nose touches a 45 degree taper beside the tool point: without compensation r (sqrt 2 - 1) sqrt 2 / 2 more is left on it."""
    text = "G21 G99 G97 S500 M03 T0101\nG00 X40. Z5.\nG42 G00 X16. Z2.\nG01 X40. Z-10. F0.1\nX50.\nG40 G00 X60.\nM30\n"
    tool = Tool(0.8e-3, 3)
    plain, made = run(text, "fanuc").moves[2], run(text, "fanuc", {1: tool}).moves[2]
    shift = (made.end_x - plain.end_x) * math.cos(math.pi / 4) + (made.end_z - plain.end_z) * math.sin(math.pi / 4)
    assert shift == pytest.approx(-0.8e-3 * (math.sqrt(2.0) - 1.0), abs=1e-9)


def test_without_a_radius_the_programmed_path_is_run_and_that_is_said() -> None:
    program = run("G21 G99 G97 S500 M03 T0101\nG42 G00 X20. Z2.\nG01 Z-10. F0.1\nG40 G00 X50.\nM30\n", "fanuc")
    assert [round(2e3 * move.end_x, 6) for move in program.moves] == [20.0, 20.0, 50.0]
    assert [warned.sentence for warned in program.warnings] == [
        "G42 is read with a nose radius of 0: the tool point runs along the programmed path."
    ]


@pytest.mark.parametrize(
    ("code", "contour", "sentence"),
    [
        ("G42.1 D1.6 L3", "G1 X10 Z2\nG1 Z-10\nG2 X10.5 Z-10.5 I0.5\nG1 X25\n", "The nose radius of 0.8 mm does not go into the arc"),
        ("G42.1 D4 L3", "G1 X10 Z2\nG1 Z-10\nG1 X11\nG1 Z-20\nG1 X12\n", "does not go into the corner"),
        ("G41.1 D1 L2", "G2 X10 Z-5 R20\n", "turn.nc:4: Nose compensation begins with an arc. Begin it with G0 or G1 to the contour."),
        ("G41 D99", "G1 X10\n", "turn.nc:3: D99 of G41 names an offset that there is not. Give the number of a tool of the turret."),
        ("G41.1 D1 L2", "G1 X10\nG20\n", "turn.nc:5: G20 changes the units while nose compensation is on. Write G40 before it."),
        ("G41.1", "G1 X10\n", "turn.nc:3: G41.1 needs the diameter of the nose. Write it as G41.1 D0.8 L2."),
    ],
)
def test_what_a_nose_cannot_do_is_told(code: str, contour: str, sentence: str) -> None:
    with pytest.raises(ProgramError) as refused:
        compensated(code, contour)
    assert sentence in str(refused.value)
