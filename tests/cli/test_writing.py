"""The one writer of results: JSON and lines of the same result, tables with units, and options in groups."""

from __future__ import annotations

import ast
import json
import math
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
import pytest

from lathesim.cli.options import grouped
from lathesim.cli.writing import CommandResult, Heading, table, write
from lathesim.json_text import eight_digits, plain
from lathesim.units import in_unit
from tests.cli.command import ROOT

MOST_ARGUMENTS = 8
COMMANDS = sorted((ROOT / "lathesim" / "cli").rglob("*.py"))


@dataclass(frozen=True)
class Mode:
    """What a command found."""

    frequency: float
    shape: tuple[float, ...]


def test_one_result_is_written_for_programs_and_for_a_person(capsys: pytest.CaptureFixture[str]) -> None:
    result = CommandResult("lathesim-modes/1", {"modes": [Mode(100.0, (1.0, math.inf))]}, iter(["One mode."]), code=3)
    assert write(result, as_json=True) == 3
    assert json.loads(capsys.readouterr().out) == {"schema": "lathesim-modes/1", "modes": [{"frequency": 100.0, "shape": [1.0, None]}]}
    assert write(result, as_json=False) == 3
    assert capsys.readouterr().out == "One mode.\n"


def test_arrays_paths_and_numbers_that_are_none_become_json() -> None:
    found = {"row": np.array([1.5, np.nan]), "count": np.int64(2), "place": Path("a/b"), 7: {"none": None, "yes": True}}
    assert plain(found) == {"row": [1.5, None], "count": 2, "place": str(Path("a/b")), "7": {"none": None, "yes": True}}
    assert [eight_digits(value) for value in (1.0 / 3.0, math.nan, None)] == [0.33333333, None, None]


def test_the_unit_of_a_heading_is_that_of_its_numbers() -> None:
    columns = (Heading("width [mm]", 12, ".2f", si=True, missing="stable"), Heading("share", 8, ".1%"), Heading("  kind", -1))
    assert list(table(columns, [(0.0012, 0.25, "  flip"), (math.inf, 1.0, "  Hopf")])) == [
        "  width [mm]   share  kind",
        "        1.20   25.0%  flip",
        "      stable  100.0%  Hopf",
    ]


@pytest.mark.parametrize(
    ("value", "unit", "form", "text"),
    [(0.0012, "mm", ".3f", "1.200 mm"), (0.35, "%", ".0f", "35 %"), (2e-6, "um", ".4g", "2 um"), (1.0, "N", "g", "1 N")],
)
def test_a_quantity_is_written_in_a_unit(value: float, unit: str, form: str, text: str) -> None:
    assert in_unit(value, unit, form) == text


def test_a_command_takes_its_options_in_groups() -> None:
    @click.command()
    @click.option("--shape", nargs=2, type=float)
    @click.option("--frequency", type=float)
    @click.option("--loud", is_flag=True)
    @grouped(mode=Mode)
    def command(mode: Mode, loud: bool) -> tuple[Mode, bool]:
        return mode, loud

    found = command.main(["--shape", "1", "2", "--frequency", "5", "--loud"], standalone_mode=False)
    assert found == (Mode(5.0, (1.0, 2.0)), True)


def test_no_command_takes_many_arguments_or_writes_json_by_itself() -> None:
    many, own = [], []
    for path in COMMANDS:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and len(node.args.args) + len(node.args.kwonlyargs) > MOST_ARGUMENTS:
                many.append(f"{path.name}: {node.name}")
            if isinstance(node, ast.Attribute) and node.attr == "dumps":
                own.append(path.name)
    assert many == []
    # the schema of lessons and the answer of a diagnosis have texts of their own; an event of a watch is one line
    assert sorted(own) == ["diagnose_command.py", "listing.py", "watch_commands.py"]
