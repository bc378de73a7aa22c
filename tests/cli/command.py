"""Calls of the command line as a person makes them, in this process or in a new one."""

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from lathesim.cli.main import run_command_line

ROOT = Path(__file__).parents[2]
PUSHED = """\
machine: A table that is pushed
sample_period: 5 ms
step: 1 ms
parts: {table: {component: ForceAxis}}
wires: {table.force: 1 N}
"""
"""A machine that takes no time to simulate."""


@dataclass
class Said:
    """What a call wrote and left with."""

    code: int
    out: str
    err: str


def call(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> Said:
    """Call ``lathesim`` in this process."""
    capsys.readouterr()
    code = run_command_line([str(argument) for argument in arguments])
    written = capsys.readouterr()
    return Said(code, written.out, written.err)


def done(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> Said:
    """Call ``lathesim`` in this process for what it can do."""
    said = call(capsys, *arguments)
    assert said.code == 0, said.err
    return said


def json_of(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> Any:
    """Return what a call for JSON that is done writes."""
    return json.loads(done(capsys, *arguments).out)


def refused(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> Said:
    """Call ``lathesim`` in this process for what it refuses, as the input is at fault."""
    said = call(capsys, *arguments)
    assert said.code == 1, said.err
    return said


def python(text: str, **options: object) -> subprocess.CompletedProcess[str]:
    """Run a few lines of Python in a new process."""
    return subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, env=environment(), check=False, **options)  # type: ignore[call-overload, no-any-return]


def environment() -> dict[str, str]:
    """Return the environment with which a new process finds this package."""
    return {**os.environ, "PYTHONPATH": str(ROOT)}
