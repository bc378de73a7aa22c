"""What a start may cost: nothing heavy is imported before it is needed, and a warm run needs no compiler."""

from __future__ import annotations

import contextlib
import io
import json
import subprocess
import sys
from pathlib import Path

import pytest

from lathesim.cli.main import run_command_line
from tests.cli.command import environment

ARGUMENTS = ["run", "01_contour_error", "--variant", "I", "--json", "--no-plots"]
CALL = """\
import json, sys, time
from lathesim.cli.main import main
try:
    main({arguments})
except SystemExit as leaving:
    assert leaving.code == 0
print(json.dumps([sorted(sys.modules), time.process_time()]), file=sys.stderr)
"""


def called(folder: Path, *arguments: str) -> tuple[set[str], float]:
    """Call lathesim in a new process; give the modules it loaded and the CPU seconds it took."""
    command = [sys.executable, "-c", CALL.format(arguments=list(arguments))]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder, env=environment())
    modules, seconds = json.loads(done.stderr.splitlines()[-1])
    return set(modules), seconds


@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder to run in, with the lesson's machine compiled."""
    folder = tmp_path_factory.mktemp("warm")
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        assert run_command_line(["warm", "01_contour_error"]) == 0
    return folder


def test_a_warm_run_loads_neither_compiler_nor_plots_nor_units_library(warm: Path) -> None:
    modules, _ = called(warm, *ARGUMENTS)
    assert {"llvmlite.binding", "h5py", "numpy", "pydantic", "yaml"} <= modules
    assert not {"numba", "matplotlib", "scipy", "textual", "rich", "pint", "jinja2"} & modules


@pytest.mark.slow
def test_a_warm_run_costs_less_than_nine_tenths_of_a_second(warm: Path) -> None:
    assert min(called(warm, *ARGUMENTS)[1] for _ in range(5)) < 0.9


@pytest.mark.slow
def test_a_warm_run_with_plots_costs_less_than_two_and_a_half_seconds(warm: Path) -> None:
    assert min(called(warm, *ARGUMENTS[:-2])[1] for _ in range(5)) < 2.5
