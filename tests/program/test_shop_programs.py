"""The five programs of the shop: both forms give the same part, run from their lessons, and moves written out read back the same."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lathesim.analysis.failed_run import RawStock
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.program.canonical_moves import linuxcnc_text
from lathesim.program.moves import Move, Program
from lathesim.program.program_checks import checked
from lathesim.program.program_file import load_program
from lathesim.record import FloatArray
from lathesim.shipped import shipped_folder
from lathesim.tui.drawing.lathe_picture import CarvedStock
from tests.shared_data import SHARED, needs_shared

PARTS = ["shaft", "thread", "taper", "ball_end", "grooved_bush"]
BAR = RawStock("stock", 0.0205, 0.060, -0.060, "x", "z", free_end=1.0, edge_length=0.005)
GCODE = SHARED / "gcode"


def shape(program: Program) -> FloatArray:
    """Return the part that the moves leave of a bar."""
    x, z = [program.moves[0].end_x], [program.moves[0].end_z]
    for move in program.moves[1:]:
        if move.arc is not None:
            angles = move.arc.start_angle + move.arc.sweep * np.linspace(0.0, 1.0, 400)
            x += list(move.arc.centre_x + move.arc.radius * np.sin(angles))
            z += list(move.arc.centre_z + move.arc.radius * np.cos(angles))
        x.append(move.end_x)
        z.append(move.end_z)
    return CarvedStock(BAR).cut(np.array(x), np.array(z), len(x))


@pytest.mark.parametrize("part", PARTS)
def test_both_forms_of_a_program_give_the_same_part_within_a_micrometre(part: str) -> None:
    folder = shipped_folder("part_programs")
    fanuc = load_program(folder / f"shop_{part}_fanuc.nc", "fanuc")
    written_out = load_program(folder / f"shop_{part}_linuxcnc.nc", "linuxcnc")
    assert np.abs(shape(fanuc) - shape(written_out)).max() < 1e-6
    assert shape(fanuc).min() < 0.018
    assert fanuc.warnings == ()
    assert checked(fanuc) == []


@pytest.mark.parametrize("part", ["shaft", "ball_end", "shaft_linuxcnc", "ball_end_linuxcnc"])
def test_the_lesson_turns_the_part(part: str) -> None:
    record = run_prepared(prepare(load_lesson("16_shop_programs"), load_registry(), part), engine="compiled")
    assert record.status == "complete"
    assert record["stock.removed_volume"][-1] > 1e-5


def alike(first: Move, second: Move) -> bool:
    ends = (first.end_x - second.end_x, first.end_z - second.end_z)
    if first.kind != second.kind or max(abs(end) for end in ends) > 1e-9 or first.mode.per_revolution != second.mode.per_revolution:
        return False
    if first.arc is not None and second.arc is not None:
        return abs(first.arc.sweep - second.arc.sweep) < 1e-5 and math.isclose(first.arc.radius, second.arc.radius, abs_tol=1e-8)
    return (
        math.isclose(first.feed or 0.0, second.feed or 0.0, rel_tol=1e-6) and first.mode.spindle.direction == second.mode.spindle.direction
    )


def reads_back(program: Program, folder: Path) -> None:
    place = folder / "written.ngc"
    place.write_text(linuxcnc_text(program), encoding="utf-8")
    again = load_program(place, "linuxcnc")
    moves = [move for move in program.moves if move.kind != "rapid" or move.length > 1e-10]
    assert len(again.moves) == len(moves)
    assert all(alike(here, there) for here, there in zip(moves, again.moves, strict=True))


@pytest.mark.parametrize("source", sorted(shipped_folder("part_programs").glob("*.nc")), ids=lambda path: path.name)
def test_moves_written_out_read_back_the_same(source: Path, tmp_path: Path) -> None:
    reads_back(load_program(source, "auto"), tmp_path)


@needs_shared
@pytest.mark.parametrize("source", sorted((GCODE / "programs").glob("*")) if GCODE.is_dir() else [], ids=lambda path: path.name)
def test_moves_of_real_programs_read_back_the_same(source: Path, tmp_path: Path) -> None:
    dialect = "linuxcnc" if source.suffix == ".ngc" or source.name.startswith("nhsd") else "fanuc"
    if source.name == "blogspot_g72.nc":
        pytest.skip("a faulty program, which is refused")
    reads_back(load_program(source, dialect), tmp_path)
