"""What holds for every program, drawn at random."""

import math
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from lathesim.errors import ProgramError
from lathesim.path_columns import ARC_MOVE, CENTRE_X, CENTRE_Z, END_X, END_Z, KIND, LENGTH, RADIUS, START_X, START_Z
from lathesim.program.canonical_moves import canon
from lathesim.program.interpreter import interpret
from lathesim.program.moves import Tool
from lathesim.program.path import lay_path
from lathesim.program.words import read_program

DIALECTS = st.sampled_from(["paper", "linuxcnc", "grbl", "fanuc", "fanuc-b"])
CODES = "0 1 2 3 4 7 8 10 18 20 21 28 33 40 41 42 50 52 53 55 65 70 71 72 73 74 75 76 77 80 83 90 91 92 94 95 96 97 98 99"
MILLIMETRES = st.integers(-200_000, 200_000).map(lambda thousandths: thousandths / 1000)
WORD = st.one_of(
    st.sampled_from([f"G{code}" for code in CODES.split()]),
    st.sampled_from(
        ["X[#1+2]", "#1=[3*2]", "Z#<a>", "#<a>=SIN[30]", "X-[1/#2]", ",R1", ",C0.5", "G01 Z3 I-1", "R1", "G01 X4 ,A45", "G41.1 D1 L2"]
    ),
    st.sampled_from(["M0", "M2", "M3", "M5", "M6", "T1"]),
    st.builds(lambda letter, value: f"{letter}{value}", st.sampled_from("XZIJKRFSPUWDTQ"), MILLIMETRES),
)


@given(st.one_of(st.text(), st.binary(), st.text("GMXZIKRFSN0123456789.-+ ()%/;\n#E")), DIALECTS)
def test_any_text_is_a_program_or_a_program_error(text: str | bytes, dialect: str) -> None:
    try:
        lay_path(interpret(read_program(text, "turn.nc"), dialect))
    except ProgramError as error:
        assert error.place.startswith("turn.nc") or "turn.nc" in str(error)


@given(st.lists(st.lists(WORD, min_size=1, max_size=5).map(" ".join), max_size=12).map("\n".join), DIALECTS)
def test_any_words_are_a_program_or_a_program_error(text: str, dialect: str) -> None:
    try:
        program = interpret(read_program(text, "turn.nc"), dialect, tools={0: Tool(0.4e-3, 3)})
        canon(program)
        table = lay_path(program).table
    except ProgramError:
        return
    for row, following in pairwise(table):
        assert math.isclose(row[END_X], following[START_X], abs_tol=1e-11) and math.isclose(row[END_Z], following[START_Z], abs_tol=1e-11)


@given(st.lists(st.tuples(st.sampled_from(["G00", "G01"]), MILLIMETRES, MILLIMETRES), min_size=1, max_size=10), st.booleans())
def test_what_is_written_is_what_moves(points: list[tuple[str, float, float]], incremental: bool) -> None:
    """Positions written absolutely or as increments come back to a micrometre's millionth."""
    lines, x, z = ["G71 G94", "M03 S500", "G91" if incremental else "G90", "F100"], 0.0, 0.0
    for code, to_x, to_z in points:
        lines.append(f"{code} X{to_x - x:.3f} Z{to_z - z:.3f}" if incremental else f"{code} X{to_x:.3f} Z{to_z:.3f}")
        x, z = to_x, to_z
    program = interpret(read_program("\n".join([*lines, "M30"])))
    for move, (code, to_x, to_z) in zip(program.moves, points, strict=True):
        assert move.kind == ("rapid" if code == "G00" else "feed")
        assert math.isclose(move.end_x, to_x / 1000, abs_tol=1e-12) and math.isclose(move.end_z, to_z / 1000, abs_tol=1e-12)


@given(
    st.floats(0.5, 100), st.floats(-math.pi, math.pi), st.floats(0.05, 2 * math.pi - 0.05), st.sampled_from(["G02", "G03"]), st.booleans()
)  # fmt: skip
def test_radius_and_centre_describe_the_same_arc(radius: float, start: float, sweep: float, code: str, by_radius: bool) -> None:
    """An arc written with rounded coordinates lies on its circle, in the right direction, within what rounding does to it."""
    turn = -sweep if code == "G02" else sweep
    start_x, start_z = radius * math.sin(start), radius * math.cos(start)
    end_x, end_z = radius * math.sin(start + turn), radius * math.cos(start + turn)
    how = f"R{radius if sweep <= math.pi else -radius:.6f}" if by_radius else f"I{-start_x:.6f} K{-start_z:.6f}"
    text = f"M3 S500\nG00 X{start_x:.6f} Z{start_z:.6f}\n{code} X{end_x:.6f} Z{end_z:.6f} {how} F100\nM30"
    path = lay_path(interpret(read_program(text)))
    row = next(row for row in path.table if row[KIND] == ARC_MOVE)
    slack = 3e-3 if by_radius and abs(sweep - math.pi) < 0.02 else 2e-4  # near a half circle R hardly fixes the centre
    assert math.isclose(row[LENGTH], 1e-3 * radius * sweep, rel_tol=slack, abs_tol=1e-8)
    assert math.hypot(row[CENTRE_X], row[CENTRE_Z]) < slack * 1e-3 * max(radius, 1.0) * 40
    assert math.isclose(row[RADIUS], 1e-3 * radius, rel_tol=1e-4, abs_tol=1e-8)
