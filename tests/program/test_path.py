"""The table the interpolator walks along: geometry, modes, joints."""

import math
import pathlib

import numpy as np
import pytest

from lathesim import path_columns as columns
from lathesim.errors import ProgramError
from lathesim.program.interpreter import interpret
from lathesim.program.path import Limits, Path, lay_path
from lathesim.program.program_file import load_program
from lathesim.program.words import read_program


def laid(text: str, dialect: str = "paper", limits: Limits | None = None) -> Path:
    return lay_path(interpret(read_program(text, "turn.nc"), dialect), limits)


def point(path: Path, row: int, distance: float) -> tuple[float, float]:
    """Return the point (x, z) [m] of an arc at a distance [m] from its start."""
    values = path.table[row]
    angle = values[columns.START_ANGLE] + values[columns.SWEEP] * min(1.0, distance / values[columns.LENGTH])
    across, along = values[columns.RADIUS] * math.sin(angle), values[columns.RADIUS] * math.cos(angle)
    return values[columns.CENTRE_X] + across, values[columns.CENTRE_Z] + along


EXAMPLE_1 = """N10 G90 G94 G71
N20 G00 X15.0 Z10.0
N30 M03 G01 Z30.0 F120 S1000
N40 X17.0 Z40.0 F180
N50 Z50.0
N60 X20.0
N70 M00 G00 Z0.0
N80 X0.0
"""


def test_example_1_lies_as_printed() -> None:
    table = laid(EXAMPLE_1).table
    assert table.shape == (7, len(columns.PATH_COLUMNS))
    assert table[:, columns.KIND].tolist() == [0, 1, 1, 1, 1, 0, 0]
    assert table[:, columns.LINE].tolist() == [2, 3, 4, 5, 6, 7, 8]
    assert table[:, columns.END_X].tolist() == [0.015, 0.015, 0.017, 0.017, 0.02, 0.02, 0.0]
    assert table[:, columns.END_Z].tolist() == [0.01, 0.03, 0.04, 0.05, 0.05, 0.0, 0.0]
    assert table[1:5, columns.FEED] == pytest.approx([0.002, 0.003, 0.003, 0.003], rel=1e-15)
    assert table[2, columns.LENGTH] == pytest.approx(math.hypot(0.002, 0.01), rel=1e-12)
    assert table[0, columns.SPINDLE_DIRECTION] == 0 and table[0, columns.SPINDLE_MODE] == columns.SPINDLE_OFF
    assert table[1:, columns.SPINDLE_SPEED] == pytest.approx(1000 * 2 * math.pi / 60)
    assert (table[1:, columns.SPINDLE_DIRECTION] == 1).all()


@pytest.mark.parametrize(("example", "cycle_time"), [(1, 18.48), (2, 13.17)])
def test_the_ways_of_the_examples_take_the_published_times(example: int, cycle_time: float) -> None:
    """Blocks cut into whole samples of 5 ms, rapid 0.12 m/s along the path (Liu and Landers 2004, Tables 1 and 2, no controller)."""
    file = pathlib.Path(__file__).parents[2] / "part_programs" / f"liu_landers_2004_example_{example}.nc"
    table = lay_path(load_program(file)).table
    speed = np.where(table[:, columns.KIND] == columns.RAPID, 0.12, table[:, columns.FEED])
    samples = np.ceil(table[:, columns.LENGTH] / speed / 0.005 - 1e-9)
    assert 0.005 * samples.sum() == pytest.approx(cycle_time, abs=1e-9)


def test_the_table_cannot_be_written() -> None:
    with pytest.raises(ValueError, match="read-only"):
        laid("G0 X1\nM2").table[0, 0] = 1.0


@pytest.mark.parametrize(
    ("block", "centre", "sweep"),
    [
        ("G02 X12 Z-2 I2 K0", (12, 0), -90),
        ("G02 X12 Z-2 R2", (12, 0), -90),
        ("G03 X12 Z-2 R2", (10, -2), 90),
        ("G03 X12 Z-2 R-2", (12, 0), 270),
        ("G02 X10 Z-16 I3 K-8", (13, -8), -2 * math.degrees(math.atan2(8, 3))),
        ("G02 X10 Z0 I2 K0", (12, 0), -360),
    ],
)
def test_arcs_run_from_start_to_end_on_their_circle(block: str, centre: tuple[float, float], sweep: float) -> None:
    path = laid(f"G90 G94\nM3 S500\nG0 X10 Z0\n{block} F100\nM2")
    row = path.table[1]
    assert row[columns.KIND] == columns.ARC_MOVE
    assert (1e3 * row[columns.CENTRE_X], 1e3 * row[columns.CENTRE_Z]) == pytest.approx(centre, abs=1e-9)
    assert math.degrees(row[columns.SWEEP]) == pytest.approx(sweep)
    assert point(path, 1, 0.0) == pytest.approx((0.01, 0.0), abs=1e-12)
    assert point(path, 1, row[columns.LENGTH]) == pytest.approx((row[columns.END_X], row[columns.END_Z]), abs=1e-12)
    assert row[columns.LENGTH] == pytest.approx(abs(row[columns.SWEEP]) * row[columns.RADIUS])


def test_clockwise_is_seen_with_z_to_the_right_and_x_up() -> None:
    """From the top of a circle G02 goes toward +Z first."""
    path = laid("M3 S500\nG0 X10 Z0\nG02 X10 Z0 I-5 K0 F100\nM2")
    x, z = point(path, 1, 1e-4)
    assert z > 0.0 and x < 0.01


def test_an_arc_that_misses_its_circle_within_the_tolerance_is_laid_on_a_true_one() -> None:
    path = laid("G0 X10 Z0\nG02 X12.02 Z-2 I2 K0 F100\nG1 Z-5\nM2")
    row = path.table[1]
    for share in (0.0, 0.5, 1.0):
        x, z = point(path, 1, share * row[columns.LENGTH])
        assert math.hypot(x - row[columns.CENTRE_X], z - row[columns.CENTRE_Z]) == pytest.approx(row[columns.RADIUS], abs=1e-12)
    assert point(path, 1, row[columns.LENGTH]) == pytest.approx((0.01202, -0.002), abs=1e-12)


def test_an_arc_whose_centre_cannot_be_moved_is_closed_with_a_straight_row() -> None:
    """Nearly a full circle, ending 0.02 mm outside its start: no circle through both lies near the programmed one."""
    path = laid("G0 X10 Z0\nG02 X9.98 Z0.001 I5 K0 F100\nM2")
    assert path.table[1:, columns.KIND].tolist() == [columns.ARC_MOVE, columns.LINE_MOVE]
    assert path.table[2, columns.LENGTH] < 3e-5
    assert path.table[2, columns.END_X] == pytest.approx(0.00998)


def test_moves_of_no_length_make_no_row_and_what_they_change_stays() -> None:
    table = laid("G0 X10\nG0 X10\nM3 S600\nG1 X10 F60\nX12\nM2").table
    assert table.shape[0] == 2
    assert table[1, columns.FEED] == pytest.approx(0.001)
    assert table[1, columns.SPINDLE_SPEED] == pytest.approx(20 * math.pi)


def test_modes_of_feed_and_spindle() -> None:
    table = laid("G95\nG96 S150 M4\nG0 X20\nG1 X10 F0.2\nG97 S300\nG1 X5\nM2").table
    assert table[1, columns.FEED] == pytest.approx(0.0002)
    assert table[1, columns.FEED_MODE] == columns.PER_REVOLUTION
    assert table[1, columns.SPINDLE_MODE] == columns.CONSTANT_SURFACE_SPEED
    assert table[1, columns.SPINDLE_SPEED] == pytest.approx(2.5)
    assert table[1, columns.SPINDLE_DIRECTION] == -1
    assert table[1, columns.SPINDLE_LIMIT] == 0.0
    assert table[2, columns.SPINDLE_MODE] == columns.CONSTANT_SPEED
    assert table[2, columns.SPINDLE_SPEED] == pytest.approx(-10 * math.pi)


def test_speed_limit_dwell_and_thread_of_the_linuxcnc_dialect() -> None:
    table = laid("G21 G18\nG96 D2500 S180 M3\nG0 X30 Z1\nG4 P1.5\nG33 Z-10 K1.5\nM2", "linuxcnc").table
    assert table[0, columns.SPINDLE_LIMIT] == pytest.approx(2500 * 2 * math.pi / 60)
    assert table[1, columns.KIND] == columns.DWELL_PAUSE
    assert table[1, columns.DWELL] == 1.5 and table[1, columns.LENGTH] == 0.0
    assert table[2, columns.KIND] == columns.LINE_MOVE
    assert table[2, columns.FEED] == pytest.approx(0.0015) and table[2, columns.FEED_MODE] == columns.THREAD


LIMITS = Limits(x_low=-0.005, x_high=0.08, z_low=-0.01, z_high=0.3, feed=0.1)


def test_an_arc_that_bulges_inward_stays_inside_the_travel() -> None:
    assert laid("M3 S100\nG0 X75\nG3 X75 Z20 R10.0 F100\nM2", limits=LIMITS).segments == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("M2", "turn.nc: The program moves nothing. Write a G0 or G1 with an end point."),
        (
            "G0 X10\nG0 Z400\nM2",
            "turn.nc:2: The move reaches Z 400 mm, and the machine travels from -10 to 300 mm. Keep the move inside; X is a radius.",
        ),
        (
            "M3 S100\nG0 X75\nG2 X75 Z20 R10.0 F100\nM2",
            "turn.nc:3: The move reaches X 85 mm, and the machine travels from -5 to 80 mm. Keep the move inside; X is a radius.",
        ),
        ("M3 S100\nG1 X10 F9000\nM2", "turn.nc:2: The feed of 9000 mm/min is above the machine's 6000 mm/min. Lower F."),
    ],
)
def test_what_the_machine_cannot_reach_is_refused(text: str, message: str) -> None:
    with pytest.raises(ProgramError) as refused:
        laid(text, limits=LIMITS)
    assert str(refused.value) == message
