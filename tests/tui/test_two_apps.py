"""Two apps on one folder: each run gets a number of its own, and both books are one."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path

import pytest

from lathesim.plugins import load_registry
from lathesim.record import load
from lathesim.tui.model.student_book import StudentBook
from lathesim.tui.model.workbench import Workbench
from lathesim.whole_file import write_new
from tests.cli.command import environment
from tests.tui.driving import content, opened, run_to_end

LESSON = "01_contour_error"


def bench(variant: str) -> Workbench:
    """Return a workbench with a case of the first lesson."""
    found = Workbench(lambda: load_registry([]))
    found.open_lesson("01_contour_error", variant)
    return found


def test_two_runs_that_begin_with_one_number_are_both_kept() -> None:
    benches = [bench("I"), bench("II")]
    setup = benches[1].setup
    assert setup is not None
    benches[1].change(setup.with_simulation("duration", "2 s"))
    runs = [each.new_run() for each in benches]
    assert {run.path.name for run in runs} == {"001.h5"}
    for run, each in zip(runs, benches, strict=True):
        run.run(each.registry)
    assert [each.runs[0].title.partition(" ")[0] for each in benches] == ["001", "002"]
    assert benches[1].command().endswith("--out lathesim_runs/01_contour_error/002.h5")
    folder = Path("lathesim_runs/01_contour_error")
    assert sorted(path.name for path in folder.iterdir()) == ["001.h5", "002.h5", "002.yaml"]
    assert [load(folder / f"00{number}.h5").meta.get("variant", "") for number in (1, 2)] == ["I", ""]
    assert benches[0].new_run().path.name == "003.h5"


def test_a_name_that_is_counted_up_is_taken_by_one_alone() -> None:
    together = threading.Barrier(8)

    def written(worker: int) -> list[str]:
        names = []
        for number in range(5):
            together.wait()
            text = f"{worker} {number}"
            taken = write_new((Path(f"{place}.txt") for place in count(1)), lambda part, text=text: part.write_text(text))  # type: ignore[misc]
            assert taken.read_text(encoding="utf-8") == text
            names.append(taken.name)
        return names

    with ThreadPoolExecutor(8) as pool:
        names = [name for found in pool.map(written, range(8)) for name in found]
    assert sorted(names) == sorted(f"{place}.txt" for place in range(1, 41))
    assert sorted(path.name for path in Path().iterdir()) == sorted(names)


def test_a_taken_name_without_another_is_refused_and_what_stands_there_stays() -> None:
    Path("cut.nc").write_text("M30\n", encoding="utf-8")
    with pytest.raises(FileExistsError):
        write_new((Path("cut.nc"),), lambda part: part.write_text("M2\n"))
    assert [path.read_text(encoding="utf-8") for path in Path().iterdir()] == ["M30\n"]


async def run_on(seconds: float) -> list[str]:
    """Run the lesson again and again in this folder; return the names of the records that the app called kept."""
    end = time.monotonic() + seconds
    names = []
    async with opened(LESSON, size=(80, 24)) as (app, pilot):
        while len(names) < 2 or time.monotonic() < end:
            await run_to_end(app, pilot)
            live = app.workbench.runs[-1].live
            assert live is not None
            assert live.kept is not None, live.fault
            names.append(live.kept.path.name)
            assert f"Done, kept as {live.kept.path.stem}." in content(app, "#result")
    return names


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_two_apps_that_run_together_lose_no_record(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.tui.test_two_apps", "4"]
    working = [subprocess.Popen(command, env=environment(), stdout=subprocess.PIPE, text=True) for _ in range(2)]
    told = [(process.communicate()[0], process.returncode) for process in working]
    assert [code for _, code in told] == [0, 0], told
    kept = sorted(name for said, _ in told for name in json.loads(said))
    records = sorted((tmp_path / "lathesim_runs" / LESSON).glob("*.h5"))
    assert len(kept) >= 4
    assert [path.name for path in records] == kept
    assert {load(path).status for path in records} == {"complete"}
    assert StudentBook().entry(LESSON).tries == len(kept)


if __name__ == "__main__":
    print(json.dumps(asyncio.run(run_on(float(sys.argv[1])))))
