"""Apps that run lessons on one folder at the same time, each in a process of its own: ``python -m tests.tui.two_apps SECONDS``."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
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
    command = [sys.executable, "-m", "tests.tui.two_apps", str(seconds)]
    working = [subprocess.Popen(command, cwd=folder, env=environment(), stdout=subprocess.PIPE, text=True) for _ in range(apps)]
    told = [(process.communicate()[0], process.returncode) for process in working]
    assert [code for _, code in told] == [0] * apps, told
    kept = tuple(name for said, _ in told for name in json.loads(said))
    records = tuple(sorted(path.name for path in (folder / "lathesim_runs" / LESSON).iterdir() if path.suffix == ".h5"))
    for name in records:
        assert load(folder / "lathesim_runs" / LESSON / name).status == "complete"
    with chdir(folder):
        return Outcome(kept, records, StudentBook().entry(LESSON).tries)


if __name__ == "__main__":
    print(json.dumps(asyncio.run(_run_on(float(sys.argv[1])))))
