"""Help is there at once: the pages of all commands are written without anything that computes or draws."""

import json

from tests.cli.command import python

HEAVY = ["h5py", "llvmlite", "matplotlib", "numba", "numpy", "pydantic", "rich", "scipy", "textual", "yaml"]
HELP = f"""\
import json, sys
from lathesim.cli.main import run_command_line, stock_commands
assert all(run_command_line([*name, "--help"]) == 0 for name in [[], *[[name] for name in stock_commands()]])
assert run_command_line(["--version"]) == 0
print(json.dumps(sorted(set({HEAVY}) & set(sys.modules))), file=sys.stderr)
"""


def test_no_page_of_help_imports_what_computes_or_draws() -> None:
    done = python(HELP)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stderr) == []
