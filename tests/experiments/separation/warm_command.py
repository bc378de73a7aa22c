"""Commands of the program in forks of a process that has imported it already: a start costs nothing, and nothing is left behind."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

from lathesim.cli.main import run_command_line


def command(*arguments: object) -> dict[str, Any]:
    """Run a command of the program in a process of its own and return its JSON; what it says where it has none."""
    with tempfile.TemporaryDirectory() as folder:
        out, err = Path(folder) / "out", Path(folder) / "err"
        sys.stdout.flush()
        child = os.fork()
        if child == 0:
            _become(out, err, [str(item) for item in arguments])
        os.waitpid(child, 0)
        try:
            told: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
        except ValueError:
            told = {"error": err.read_text(encoding="utf-8")[-400:]}
    return told


def _become(out: Path, err: Path, arguments: list[str]) -> None:
    """Run the command line with its output in files, and end the process."""
    code = 1
    try:
        for stream, place in ((1, out), (2, err)):
            os.dup2(os.open(place, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
        code = run_command_line(arguments)
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)
