"""Programs damaged at random give moves or a program error with its place, and neither a traceback nor a hang."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from lathesim.errors import ProgramError, SeveralFaultsError
from lathesim.program.interpreter import interpret
from lathesim.program.loading import load_program
from lathesim.program.path import lay_path
from lathesim.program.words import read_program
from lathesim.shipped import shipped_folder
from tests.shared_data import SHARED

GCODE = SHARED / "gcode"
CHARACTERS = "GMXZUWRPQIKFSTDNO0123456789.-+()/%; \n"
DIALECTS = ("paper", "linuxcnc", "fanuc", "fanuc")


def corpus() -> list[str]:
    """Give the programs that come along, and those of the reference set where it is there."""
    files = sorted(shipped_folder("part_programs").glob("*.nc"))
    for folder in ("micro", "programs"):
        files += sorted((GCODE / folder).iterdir()) if GCODE.is_dir() else []
    return [file.read_text(encoding="utf-8", errors="replace") for file in files]


def mutated(text: str, chance: random.Random) -> str:
    """Give a part of a program with a few characters and lines taken out, put in or exchanged."""
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
            interpret(read_program(text), chance.choice(DIALECTS))
            good += 1
        except ProgramError as error:
            assert error.place.startswith("program"), text
            refused += 1
        assert time.process_time() - begun < 5.0, text
    return good, refused


def test_damaged_programs_make_no_fault() -> None:
    good, refused = damage(1500, 11)
    assert good > 50
    assert refused > 50


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

    seconds(1000)
    assert seconds(16_000) < 8.0 * seconds(4000)
