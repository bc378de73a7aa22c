"""``lathesim couple``: the tip of an assembly file, as a table and as JSON; what is no part is told with its place."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.command import call, json_of

ASSEMBLY = """assembly: A cylinder on a prism
model: {model}
parts:
  - {{diameter: 20 mm, length: 100 mm{joint}}}
  - {{width: 30 mm, height: 30 mm, length: 150 mm}}
"""


def tip(capsys: pytest.CaptureFixture[str], model: str, joint: str = "") -> complex:
    Path("tool.yaml").write_text(ASSEMBLY.format(model=model, joint=joint), encoding="utf-8")
    (row,) = json_of(capsys, "couple", "tool.yaml", "--frequency", "2000", "--json")["rows"]
    return complex(*row["receptance"][0][0])


def test_the_tip_of_a_file_is_that_of_the_worked_example(capsys: pytest.CaptureFixture[str]) -> None:
    assert tip(capsys, "euler_bernoulli") == pytest.approx(-4.875905e-07 - 2.669427e-08j, rel=1e-5)
    assert tip(capsys, "timoshenko") == pytest.approx(-3.619829e-07 - 1.402277e-08j, rel=1e-4)


def test_a_joint_moves_the_tip(capsys: pytest.CaptureFixture[str]) -> None:
    soft = tip(capsys, "timoshenko", ", joint: {translation: 1e8 N/m, rotation: 1e5 N*m/rad}")
    assert abs(soft - tip(capsys, "timoshenko")) > 1e-8


def test_the_table_and_the_faults(capsys: pytest.CaptureFixture[str]) -> None:
    tip(capsys, "timoshenko")
    assert "A cylinder on a prism" in call(capsys, "couple", "tool.yaml", "--frequency", "100..5000:3").out
    Path("wrong.yaml").write_text("assembly: A\nparts:\n  - {length: 100 mm}\n", encoding="utf-8")
    assert "wrong.yaml:3" in call(capsys, "couple", "wrong.yaml").err
    Path("wrong.yaml").write_text("assembly: A\nparts:\n  - {diameter: 20 s, length: 100 mm}\n", encoding="utf-8")
    assert "is given in s, but m is wanted" in call(capsys, "couple", "wrong.yaml").err
