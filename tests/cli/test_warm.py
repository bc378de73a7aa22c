"""``lathesim warm``: what was compiled is found again, and every case says in one line where it stands."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.command import done, environment, refused
from tests.files.commands import MACHINE

LESSON = """\
lesson: One axis
machine: machine
duration: 50 ms
variants:
  slow: {set: {axis.time_constant: 30 ms}}
  quick: {set: {axis.time_constant: 10 ms}}
"""


@pytest.fixture
def lesson(tmp_path: Path) -> Path:
    (tmp_path / "machine.yaml").write_text(MACHINE)
    (tmp_path / "one_axis.yaml").write_text(LESSON)
    return tmp_path / "one_axis.yaml"


def warm(lesson: Path, cache: Path) -> list[str]:
    command = [sys.executable, "-m", "lathesim", "warm", str(lesson)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env={**environment(), "LATHESIM_CACHE": str(cache)})
    return done.stdout.splitlines()


@pytest.mark.slow
def test_the_second_time_everything_is_there(lesson: Path, tmp_path: Path) -> None:
    first = warm(lesson, tmp_path / "cache")
    assert first[0].startswith("one_axis slow: compiling, about ")
    assert first[1] == "one_axis quick: the same machine as one_axis slow."
    assert first[2].startswith("1 compiled in ")

    second = warm(lesson, tmp_path / "cache")
    assert second[0] == "one_axis slow: was compiled already."
    assert second[2].startswith("0 compiled in ")
    assert second[2].endswith(f"1 before; kept in {tmp_path / 'cache'}.")


def test_after_it_a_run_is_compiled_whatever_the_values(lesson: Path, capsys: pytest.CaptureFixture[str]) -> None:
    done(capsys, "warm", lesson)
    said = done(capsys, "run", lesson, "--variant", "quick", "--set", "axis.gain=20 mm/(s*V)", "--json", "--no-plots")
    assert json.loads(said.out)["engine"] == "compiled"
    assert said.err == ""


def test_a_lesson_at_fault_is_left_out_and_the_others_are_compiled(
    lesson: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = tmp_path / "broken.yaml"
    broken.write_text(LESSON.replace("machine: machine", "machine: no_such_machine"))
    said = refused(capsys, "warm", broken, lesson)
    assert "broken.yaml: left out. " in said.err
    assert "there is no machine template 'no_such_machine'" in said.err
    assert "one_axis quick: the same machine as one_axis slow." in said.out
