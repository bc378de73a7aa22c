"""Programs damaged at random give moves or a program error with its place, and neither a traceback nor a hang."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from lathesim.errors import ProgramError, SeveralFaultsError
from lathesim.program.explain import explain
from lathesim.program.interpreter import interpret
from lathesim.program.path import lay_path
from lathesim.program.program_checks import checked
from lathesim.program.program_file import detect_dialect, load_program
from lathesim.program.words import read_program
from lathesim.shipped import shipped_folder
from tests.shared_data import SHARED

GCODE = SHARED / "gcode"
CHARACTERS = "GMXZUWRPQIKFSTDNOAEHL0123456789.-+()/%;#[]<>=* \n"
DIALECTS = ("paper", "linuxcnc", "grbl", "fanuc", "fanuc", "fanuc-b")


MACROS = (
    "G21 G18 G90 G94 G8 F100 S500 M3\no100 sub\no101 if [#1 GT 5]\nG1 X#1\no101 else\nG1 X[#1 + 5]\no101 endif\no100 endsub [#1]\n"
    "#2=0\no200 while [#2 LT 3]\n#2=[#2 + 1]\no100 call [#2 * 3]\no200 endwhile\no300 repeat [2]\nG1 Z-[SIN[30] * #2]\no300 endrepeat\n"
    "O400 SUB\nG0 X5\nG1 Z0\nG3 X9 Z-4 K-4\nG1 Z-25\nO400 ENDSUB\nG0 X20 Z2\nG71 Q400 D0.2 I2 R0.5\nG70 Q400 X20 Z2\n"
    "G42.1 D0.8 L2\nG1 X10 Z2\nZ-10\nG2 X14 Z-14 I4\nG1 X20\nG40\nG1 X30\nG10 L2 P2 X1 Z2\nG55 G0 X1\nM2\n",
    "O1\nG21 G99 G97 S500 M03 T0101\nG10 P1 R0.8 Q3\n#100=40.\nWHILE [#100 GT 34.] DO1\nG01 X#100 F0.1\n#100=#100-2.\nEND1\n"
    "IF [#100 EQ 34.] GOTO 50\nG01 X99.\nN50 G65 P9001 A10. Z-5.\nM97 P500\nG42 G00 X20. Z2.\nG01 Z-10.\nG03 X26. Z-13. R3.\n"
    "G40 G00 X50.\nG83 Z-20. R2. Q5000\nG80\nG50 X60. Z5.\nM30\nO9001\nG01 X[#1 * 2] Z#26\nM99\nN500 G01 X24.\nM99\n",
)
"""Programs with expressions, statements and nose compensation, to be damaged like the others."""


def corpus() -> list[str]:
    """Return the programs that come along, and those of the reference set where it is there."""
    files = sorted(shipped_folder("part_programs").glob("*.nc"))
    for folder in ("micro", "programs"):
        files += sorted((GCODE / folder).iterdir()) if GCODE.is_dir() else []
    return [file.read_text(encoding="utf-8", errors="replace") for file in files] + 12 * list(MACROS)


def mutated(text: str, chance: random.Random) -> str:
    """Return a part of a program with a few characters and lines taken out, put in or exchanged."""
    lines = text.splitlines(keepends=True)
    if len(lines) > 60:
        begin = chance.randrange(len(lines) - 50)
        lines = lines[:8] + lines[begin : begin + 50]
    text = "".join(lines)
    for _ in range(chance.randint(1, 4)):
        place, kind = chance.randrange(len(text) + 1), chance.randrange(4)
        if kind == 0:
            text = text[:place] + text[place + 1 :]
        elif kind == 1:
            text = text[:place] + chance.choice(CHARACTERS) + text[place:]
        elif kind == 2:
            text = text[:place] + chance.choice("0123456789") + text[place + 1 :]
        else:
            text = text[:place] + chance.choice(lines) + text[place:]
    return text


def damage(number: int, seed: int) -> tuple[int, int]:
    """Interpret so many damaged programs; give how many were programs and how many were refused."""
    chance, sources, good, refused = random.Random(seed), corpus(), 0, 0
    for _ in range(number):
        text = mutated(chance.choice(sources), chance)
        begun = time.process_time()
        try:
            blocks = read_program(text)
            found = detect_dialect(blocks).dialect if chance.random() < 0.7 else chance.choice(DIALECTS)
            program = interpret(blocks, found)
            if program.summary.cut_path > 0.0:
                lay_path(program)
            list(explain(blocks, program))
            checked(program, blocks)
            good += 1
        except ProgramError as error:
            assert error.place.startswith("program"), text
            refused += 1
        assert time.process_time() - begun < 5.0, text
    return good, refused


def test_damaged_programs_make_no_fault() -> None:
    good, refused = damage(400, 11)
    assert good > 25
    assert refused > 25


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_hundred_thousand_damaged_programs_make_no_fault() -> None:
    good, refused = damage(100_000, 3)
    assert good + refused == 100_000


def test_all_lines_that_cannot_be_read_are_told_at_once() -> None:
    with pytest.raises(SeveralFaultsError) as refused:
        read_program("G0 X1\nG1 X,5\nG1 X1..2\nG1 (open\nM2\n", "turn.nc")
    told = str(refused.value).splitlines()
    assert [line.partition(": ")[0] for line in told] == ["turn.nc:2", "turn.nc:3", "turn.nc:4"]


def test_a_long_program_is_laid_in_proportion(tmp_path: Path) -> None:
    def seconds(blocks: int) -> float:
        lines = ["G71 G90 G94", "M03 S1000", "G00 X20 Z1"]
        lines += [f"G01 X{20 - (number % 100) * 0.01:.3f} Z{-0.001 * number:.4f} F120" for number in range(blocks)]
        path = tmp_path / f"{blocks}.nc"
        path.write_text("\n".join([*lines, "M30"]), encoding="utf-8")
        begun = time.process_time()
        assert lay_path(load_program(path)).segments == blocks + 1
        return time.process_time() - begun

    seconds(500)
    # the least of three: a busy machine makes any single one longer
    assert min(seconds(4_000) for _ in range(3)) < 8.0 * min(seconds(1_000) for _ in range(3))
