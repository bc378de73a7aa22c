"""Apps that run lessons on one folder at the same time.

``python -m tests.tui.two_apps`` drives two apps for five minutes, each in a process of its own. It counts the runs that each app called
kept, the records that stand there, and the runs in the book. ``--minutes`` and ``--apps`` change the numbers.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import subprocess
import sys
import tempfile
import time
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path

from textual.widgets import Static

from lathesim.record import load
from lathesim.tui.model.student_book import StudentBook
from tests.cli.command import environment
from tests.tui.driving import opened, run_to_end

LESSON = "01_contour_error"


@dataclass(frozen=True)
class Outcome:
    """The records that the apps called kept, those that stand in the folder, and the runs in the book."""

    called_kept: tuple[str, ...]
    standing: tuple[str, ...]
    noted: int

    @property
    def lost(self) -> int:
        """How many records or entries are missing, or were taken twice."""
        names = set(self.called_kept)
        return len(self.called_kept) - len(names) + len(names ^ set(self.standing)) + abs(len(self.called_kept) - self.noted)


async def _run_on(seconds: float) -> list[str]:
    """Run the lesson again and again in this folder; return the names of the records that the app called kept."""
    end = time.monotonic() + seconds
    names = []
    async with opened(LESSON, size=(80, 24)) as (app, pilot):
        while not names or time.monotonic() < end:
            await run_to_end(app, pilot)
            live = app.workbench.runs[-1].live
            assert live is not None
            assert live.kept is not None, live.fault
            names.append(live.kept.path.name)
            assert f"Done, kept as {live.kept.path.stem}." in str(app.screen.query_one("#result", Static).content)
    return names


def together(folder: Path, apps: int, seconds: float) -> Outcome:
    """Drive several apps on one folder and return what became of their runs."""
    command = [sys.executable, "-m", "tests.tui.two_apps", "--alone", str(seconds)]
    working = [subprocess.Popen(command, cwd=folder, env=environment(), stdout=subprocess.PIPE, text=True) for _ in range(apps)]
    told = [(process.communicate()[0], process.returncode) for process in working]
    assert [code for _, code in told] == [0] * apps, told
    kept = tuple(name for said, _ in told for name in json.loads(said))
    records = tuple(sorted(path.name for path in (folder / "lathesim_runs" / LESSON).iterdir() if path.suffix == ".h5"))
    for name in records:
        assert load(folder / "lathesim_runs" / LESSON / name).status == "complete"
    with chdir(folder):
        return Outcome(kept, records, StudentBook().entry(LESSON).tries)


def main() -> int:
    """Drive the apps and leave with 1 where something was lost."""
    parser = argparse.ArgumentParser(description="Drive apps on one folder.")
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--apps", type=int, default=2)
    parser.add_argument("--alone", type=float, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.alone is not None:
        print(json.dumps(asyncio.run(_run_on(options.alone))))
        return 0
    with tempfile.TemporaryDirectory(prefix="two_apps_") as folder:
        found = together(Path(folder), options.apps, 60.0 * options.minutes)
    print(f"{len(found.called_kept)} runs kept by {options.apps} apps, {len(found.standing)} records, {found.noted} runs in the book")
    print(f"lost or taken twice: {found.lost}")
    return 0 if found.lost == 0 else 1


if __name__ == "__main__":
    raise SystemExit(main())
