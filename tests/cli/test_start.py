"""The command line starts at once: nothing heavy is imported before it is needed."""

import json
from pathlib import Path

import pytest

from lathesim.cli.main import stock_commands
from tests.cli.command import call, done, python

HEAVY = ["scipy", "matplotlib", "numba", "textual", "numpy", "pint", "pydantic", "yaml", "h5py", "rich"]
LOADED = f"import json, sys, time\n{{}}\nprint(json.dumps([sorted(set({HEAVY}) & set(sys.modules)), time.process_time()]), file=sys.stderr)"
HELP = "from lathesim.cli.main import run_command_line\nassert run_command_line(['--help']) == 0"


def test_help_imports_nothing_heavy_and_takes_no_time() -> None:
    tries = [python(LOADED.format(HELP)) for _ in range(3)]
    assert all(done.returncode == 0 for done in tries), tries[0].stderr
    loaded = [json.loads(done.stderr) for done in tries]
    assert loaded[0][0] == []
    assert min(seconds for _, seconds in loaded) < 0.15


def test_help_lists_the_commands_that_are_there(capsys: pytest.CaptureFixture[str]) -> None:
    said = done(capsys, "--help")
    for name in stock_commands():
        assert f"\n  {name} " in said.out
    assert "Exit codes: 0 done" in said.out


@pytest.mark.parametrize("name", stock_commands())
def test_every_command_has_a_help_of_its_own(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = done(capsys, name, "--help")
    assert said.out.startswith(f"Usage: lathesim {name}")


def test_the_table_names_every_command_in_one_line() -> None:
    assert all(entry.sentence.endswith(".") and "\n" not in entry.sentence for entry in stock_commands().values())


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["rum"], "Error: there is no command 'rum'. Did you mean 'run'?"),
        (["run"], "Error: Missing argument 'LESSON'."),
        (["run", "01_contour_error", "--sett", "a"], "Error: No such option '--sett'"),
        (["run", "01_contour_error", "--set", "x_axis.gain"], "Error: --set x_axis.gain: write it as --set x_axis.time_constant='24 ms'."),
        (["run", "01_contour_error", "--set", "a.b=1 m", "--set", "a.b=2 m"], "Error: --set a.b=2 m: a.b is set twice."),
    ],
)
def test_wrong_usage_leaves_with_two(arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = call(capsys, *arguments)
    assert said.code == 2
    assert sentence in said.err
    assert said.out == ""


def test_a_fault_of_the_program_leaves_with_three_and_keeps_its_traceback(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError("deep inside")

    monkeypatch.setattr("lathesim.shipped.shipped_files", broken)
    monkeypatch.setattr("lathesim.lessons.lesson.shipped_files", broken)
    said = call(capsys, "run", "no_such_lesson")
    assert said.code == 3
    start = "This is a fault of the program, not of your input: ZeroDivisionError: deep inside. Its traceback is in "
    assert said.err.startswith(start)
    kept = said.err.removeprefix(start).partition(";")[0]
    assert "ZeroDivisionError: deep inside" in Path(kept).read_text(encoding="utf-8")


ONE_CORE = """\
import os, sys
os.environ.pop('OPENBLAS_NUM_THREADS', None)
from lathesim.cli.main import main
sys.argv = ['lathesim', 'lessons']
try:
    main()
except SystemExit:
    print(os.environ['OPENBLAS_NUM_THREADS'])
"""


def test_every_command_keeps_a_matrix_on_one_core() -> None:
    done = python(ONE_CORE)
    assert done.stdout.splitlines()[-1] == "1", done.stderr
