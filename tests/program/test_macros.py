"""Expressions, variables, and the statements that choose the next block. Positions were held against LinuxCNC 2.9's rs274."""

from __future__ import annotations

import pytest

from lathesim.errors import ProgramError
from lathesim.program import flow
from lathesim.program.interpreter import interpret
from lathesim.program.words import read_program

HEAD = "G21 G18 G90 G94 G8 F100\n"


def ends(text: str, dialect: str = "linuxcnc", head: str = HEAD, last: str = "M2\n") -> list[tuple[float, float]]:
    """Return where the moves of a program end [mm]."""
    program = interpret(read_program(head + text + last, "turn.ngc"), dialect)
    return [(round(1e3 * move.end_x, 6), round(1e3 * move.end_z, 6)) for move in program.moves]


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("[1 + 2 * 3 ** 2]", 19.0), ("[2 ** 3 ** 2]", 64.0), ("[10 - 3 - 2]", 5.0), ("[-7 MOD 3]", 2.0), ("[2 + 3 MOD 2]", 3.0),
        ("SIN[30]", 0.5), ("[ATAN[1]/[1]]", 45.0), ("[FIX[-2.5]]", -3.0), ("[FUP[-2.5]]", -2.0), ("[ROUND[2.5]]", 3.0), ("-[2]", -2.0),
        ("[1 LT 2]", 1.0), ("[3 GE 4 OR 1]", 1.0), ("[1 AND 0 XOR 1]", 1.0), ("[ABS[-4] - SQRT[9]]", 1.0), ("[EXISTS[#<none>]]", 0.0),
        ("[ACOS[0.5] + LN[EXP[2]]]", 62.0), ("[[1 + 2] * [3 - 1] / 4]", 1.5),
    ],
)  # fmt: skip
def test_an_expression_has_its_value(expression: str, value: float) -> None:
    assert ends(f"G1 X{expression}\n")[0][0] == pytest.approx(value, abs=1e-6)


def test_assignments_count_from_the_next_block_on() -> None:
    text = "#1=5 #<dia>=8\nG0 X#1 Z#<dia>\n#1=7 G1 X#1\nG1 X#1\n#3=1\n##3=9\nG1 X#1\n"
    assert [x for x, _ in ends(text)] == [5.0, 5.0, 7.0, 9.0]


def test_positions_and_offsets_can_be_asked_for() -> None:
    text = "G10 L2 P1 X1 Z2\nG0 X10 Z5\nG1 X[#5420 + 1] Z[#<_z> - 1]\nG1 X[#5221] Z0\n"
    assert ends(text) == [(11.0, 7.0), (12.0, 6.0), (2.0, 2.0)]


SUB = """o100 sub
  o101 if [#2 GT 15]
    G1 X#1
  o101 elseif [#2 GT 12]
    G1 X[#1 - 1]
  o101 else
    o100 return [7]
  o101 endif
o100 endsub [#2 * 2]
"""


def test_subprograms_have_arguments_and_give_a_value_back() -> None:
    text = SUB + "o100 call [18] [20]\nG1 Z-#<_value>\no100 call [17] [13]\no100 call [1] [1]\nG1 Z#<_value>\n"
    assert ends(text) == [(18.0, 0.0), (18.0, -40.0), (16.0, -40.0), (16.0, 7.0)]


def test_loops_run_as_often_as_they_say() -> None:
    text = """#100=0
    o200 while [#100 LT 9]
      #100=[#100 + 1]
      o210 if [#100 EQ 2]
        o200 continue
      o210 endif
      o211 if [#100 EQ 4]
        o200 break
      o211 endif
      G1 X#100
    o200 endwhile
    o300 repeat [2]
      G91 G1 Z-1
      G90
    o300 endrepeat
    o400 do
      #100=[#100 + 3]
    o400 while [#100 LT 9]
    G1 X#100
    """
    assert [x for x, _ in ends(text)] == [1.0, 3.0, 3.0, 3.0, 10.0]


def test_macros_of_fanuc_branch_loop_and_call() -> None:
    text = """G99 G97 S500 M03 F0.1
    #100=40.
    WHILE [#100 GT 34.] DO1
    G01 X#100
    #100=#100-2.
    END1
    IF [#100 EQ 34.] GOTO 50
    G01 X99.
    N50 IF [#100 NE #0] THEN #101=30.
    G01 X#101
    G65 P9001 A10. Z-5. R#0
    M97 P500
    M30
    O9001
    G01 X[#1 * 2] Z#26
    IF [#18 EQ #0] GOTO 1
    G01 X99.
    N1 M99
    N500 G01 X24.
    M99
    """
    program = interpret(read_program(text, "turn.nc"), "fanuc")
    assert [round(2e3 * move.end_x, 6) for move in program.moves] == [40.0, 38.0, 36.0, 30.0, 20.0, 24.0]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("G1 X[1/0]", "turn.ngc:2: 1 is divided by 0. Check what stands behind the /."),
        ("G1 X[1+2", "turn.ngc:2: The bracket of [1+2 is not closed. Put ] behind the expression."),
        ("G1 X[SQRT[-1]]", "turn.ngc:2: SQRT[-1] has no value. Check the number in its bracket."),
        ("G1 X[SINE[1]]", "turn.ngc:2: There is no function SINE. Did you mean 'SIN'?"),
        ("G1 X#<depth>", "turn.ngc:2: #<depth> has no value yet. Assign to it first, as in #<depth>=1."),
        ("o1 while [1]\nG1 X1\no1 endwhile", "Loops and subprograms run more than 2000 blocks."),
        ("o1 if [1]\nG1 X1", "turn.ngc:2: O1 IF is not closed. Write O1 ENDIF behind it."),
        ("o1 endif", "turn.ngc:2: O1 ENDIF closes or divides nothing that is open."),
        ("o1 call", "turn.ngc:2: O1 CALL calls a subprogram that the file does not have."),
        ("o1 sub\no1 call\no1 endsub\no1 call", "turn.ngc:3: O1 CALL calls more than 10 programs deep."),
        ("G[323] X1", "turn.ngc:2: G[323] is in no dialect known here"),
        ("WHILE [1 LT 0] DO1\nEND1", "turn.ngc:2: DO n is written so in 'fanuc', and not in the dialect 'linuxcnc'."),
        ("#1", "turn.ngc:2: #1 stands alone. Assign to it, as in #1=1, or put a letter before it."),
    ],
)
def test_what_cannot_be_computed_is_told_with_its_line(text: str, sentence: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flow, "MOST_RUNS", 2000)
    with pytest.raises(ProgramError) as refused:
        ends(text + "\n")
    assert sentence in str(refused.value)
    assert str(refused.value).startswith("turn.ngc:")
