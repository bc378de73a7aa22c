"""Threads as one motion, several starts, tapping, and drilling along Z: the moves and the rows of the path that programs give."""

from __future__ import annotations

import numpy as np
import pytest

from lathesim.path_columns import FEED_MODE, KIND, LINE_MOVE, THREAD, THREAD_ON
from lathesim.program.interpreter import interpret
from lathesim.program.loading import load_program
from lathesim.program.moves import Program
from lathesim.program.path import lay_path
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
