"""A long program: how much memory and work a line of it takes, counted and not timed, and what its drawing is made of."""

from __future__ import annotations

import json
import logging
import sys
import tracemalloc
from pathlib import Path
from types import FrameType

import pytest

from lathesim.analysis.path_figures import program_figure
from lathesim.cli.part_program import _points
from lathesim.program.canonical_moves import canon, canon_text
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Moves
from lathesim.program.program_file import detect_dialect
from lathesim.program.words import read_program
from tests.cli.command import call

RS274_BYTES = 70
"""Memory that LinuxCNC's own interpreter takes for a line: 14 MB for 200 000 lines."""


def zigzag(lines: int) -> str:
    moves = [f"{'G1 ' if k % 3 == 0 else ''}X{20 + k % 7}.{k % 1000:04d} Z-{0.001 * k:.4f}" for k in range(lines)]
    return "\n".join(["G21 G18 G8 G90 G94 F100 S500 M3", "G0 X50 Z5", *moves, "M2", ""])


def test_a_line_takes_at_most_twice_the_memory_of_the_interpreter_of_linuxcnc() -> None:
    text = zigzag(5000)
    interpret(read_program(text), "linuxcnc")  # what is made once is there
    tracemalloc.start()
    try:
        blocks = read_program(text.encode())
        program = interpret(blocks, detect_dialect(blocks).dialect)
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(program.moves) == 5001
    assert most / 5000 < 2 * RS274_BYTES


def calls(text: str, dialect: str) -> int:
    """Return how many functions are called while a program is read and run."""
    count = 0

    def counted(_: FrameType, event: str, __: object) -> None:
        nonlocal count
        count += event == "call"

    sys.setprofile(counted)
    try:
        interpret(read_program(text), dialect)
    finally:
        sys.setprofile(None)
    return count


def test_a_line_takes_the_same_work_however_long_the_program_is() -> None:
    short, long = calls(zigzag(500), "linuxcnc"), calls(zigzag(1500), "linuxcnc")
    assert (long - short) / 1000 < 40
    assert long < 3 * short


def test_a_jump_takes_the_same_work_however_long_the_program_is() -> None:
    loop = "O1\nG21 G99 G97 S500 M3 T0101\n#1=0\nGOTO 5\n{}N5 #1=#1+1\nG0 X[10+#1]\nIF [#1 LT 300] GOTO 5\nM30\n"
    passed = 1000
    assert calls(loop.format("G0 X5.\n" * passed), "fanuc") - calls(loop.format(""), "fanuc") < 40 * passed


def test_moves_in_columns_are_the_moves_that_were_put_in() -> None:
    text = (
        "G21 G99 S500 M3 T0101\nG0 X42. Z2.\nG1 Z-5. F0.2\nG2 X50. Z-9. R4.\nG4 P500\nG32 Z-20. F2.\nG96 S100\nG1 X60.,R2. F0.1\nZ-30.\nM30"
    )
    moves = interpret(read_program(text), "fanuc").moves
    listed = list(moves)
    assert Moves(listed) == moves == tuple(listed)
    assert moves[-1] == listed[-1] and moves[1:3] == tuple(listed[1:3])
    assert [(move.kind, move.length) for move in listed] == list(moves.ways())
    assert moves.counts == {kind: sum(move.kind == kind for move in listed) for kind in ("rapid", "feed", "arc", "dwell", "thread")}
    with pytest.raises(IndexError):
        moves[len(moves)]


@pytest.mark.parametrize("body", ["", "(MSG, 1)\nG0 X1\n", "G0 X1\nG1 Z-2\nG3 X3 Z-4 K-2\n"])
def test_the_moves_in_json_are_written_one_by_one_and_read_the_same(body: str) -> None:
    program = interpret(read_program(f"G21 G18 F100 S500 M3\n{body}M2\n", 'a "moves": [].ngc'), "linuxcnc")
    assert "".join(canon_text(program)) == json.dumps(canon(program), indent=1, ensure_ascii=False)


def test_a_long_program_is_drawn_with_a_line_for_each_kind_of_move() -> None:
    moves = interpret(read_program(zigzag(3000)), "linuxcnc").moves
    (panel,) = program_figure("zigzag", map(_points, moves)).axes
    assert len(panel.lines) == 3  # rapid moves, feeds and the spindle's axis
    assert max(len(line.get_xdata()) for line in panel.lines) == 3001


@pytest.mark.parametrize(
    "body", ["G0 X20 Z0\nG1 X0\n", "G1 X0 Z0\n", "G4 P1\n", "G0 X5 Z5\nG1 Z-500\n", "G0 X5 Z5\n", "", "G1 X1 Z1\nG2 X3 Z-1 K-2\n"]
)
def test_no_drawing_brings_a_warning_of_a_library(
    body: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("part.ngc").write_text(f"G21 G18 G8 G90 G94 F100 S500 M3\n{body}M2\n", encoding="utf-8")
    with caplog.at_level(logging.WARNING):
        said = call(capsys, "program", "part.ngc", "--plot", "part.png", "--dialect", "linuxcnc")
    assert (said.code, said.err, caplog.records) == (0, "drew part.png\n", [])
    assert Path("part.png").stat().st_size > 3000
