"""``lathesim bench --tui``: what the terminal app costs: first paint, an answer to a key during a run and a search, and drawing."""

from __future__ import annotations

import asyncio
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path

from lathesim.cli.speed.bench_rows import Tell, measured_on_line
from lathesim.cli.writing import CommandResult
from tests.benchmarks.held import Held, held_result

SIZE = (120, 36)
"""Columns and rows of the terminal."""
POINTS = 4000
"""Samples of the curve and of the path that are drawn."""
_CASE = "22_what_is_wrong_with_this_machine"
RATE = 10.0
"""Pictures a second."""
_FIRST_PAINT = """\
import sys, time, asyncio
from lathesim.cli.open_app import make_app
app = make_app()
shown, display = [], type(app)._display
def timed(self, screen, renderable):
    display(self, screen, renderable)
    if type(screen).__name__ == "BenchScreen" and not shown:
        shown.append(time.process_time())
type(app)._display = timed
async def main():
    async with app.run_test(size=(120, 36)) as pilot:
        await pilot.pause()
asyncio.run(main())
print(shown[0])
"""


@dataclass(frozen=True)
class Figure(Held):
    """One measured figure, the bar it is held against, and how both are told."""

    name: str
    value: float
    bar: float
    unit: str


def measured(quick: bool, save: Path | None, tell: Tell) -> tuple[CommandResult, list[str]]:
    """Measure the terminal app."""
    figures = tui_figures(1 if quick else 5, tell)
    return held_result("lathesim-bench-tui/1", figures, _lines(figures))


def _lines(figures: Sequence[Figure]) -> Iterator[str]:
    for figure in figures:
        yield f"{figure.name}: {figure.value:.3g} {figure.unit}".strip() + f" (at most {figure.bar:g}: {figure.sign})"
    yield f"\n{measured_on_line()}"


def tui_figures(rounds: int, tell: Tell) -> list[Figure]:
    """Return the figures; the app runs without a terminal, so what a terminal itself takes is left out."""
    tell("first paint ...")
    paints = [_first_paint() for _ in range(rounds)]
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        tell("keys during runs ...")
        answers = asyncio.run(_key_answers(10 * rounds))
        tell("keys during a diagnosis ...")
        searching = asyncio.run(_search_answers(10 * rounds))
        tell("drawing ...")
        share = asyncio.run(_drawing_share(2.0 * rounds))
    return [
        Figure("CPU time to the first paint", statistics.median(paints), 0.8, "s"),
        Figure("answer to a key during a run, median", statistics.median(answers), 0.1, "s"),
        Figure("answer to a key during a run, slowest of ten", _slowest(answers), 0.1, "s"),
        Figure("answer to a key during a diagnosis, median", statistics.median(searching), 0.1, "s"),
        Figure("answer to a key during a diagnosis, slowest of ten", _slowest(searching), 0.1, "s"),
        Figure(f"drawing {POINTS} points and the lathe {RATE:g} times a second, share of a core", share, 0.25, ""),
    ]


def _slowest(answers: Sequence[float]) -> float:
    """Return the answer that nine of ten stay below."""
    return sorted(answers)[int(0.9 * (len(answers) - 1))]


def _first_paint() -> float:
    done = subprocess.run([sys.executable, "-c", _FIRST_PAINT], capture_output=True, text=True, check=True)
    return float(done.stdout.split()[-1])


async def _key_answers(keys: int) -> list[float]:
    """Return for each key the seconds until the picture shows it, with runs going on all the time."""
    from lathesim.cli.open_app import make_app
    from lathesim.tui.widgets.lathe_view import LatheView

    app = make_app("01_contour_error")
    answers = []
    async with app.run_test(size=SIZE) as pilot:
        await pilot.pause(0.5)
        lathe = app.screen.query_one(LatheView)
        for _ in range(keys):
            if app.workbench.live is None:
                app.action_run_or_stop()
            await asyncio.sleep(0.03)
            before, begun = lathe.view, time.perf_counter()
            app.simulate_key("m")
            while lathe.view is before:
                await asyncio.sleep(0)
            answers.append(time.perf_counter() - begun)
        app.stop_run()
    return answers


async def _search_answers(keys: int) -> list[float]:
    """Return for each key the seconds until it is answered, while the diagnosis of a concealed case searches."""
    from lathesim.cli.open_app import make_app
    from lathesim.exercises.class_folder import Hiding, conceal_case
    from lathesim.lessons.lesson import load_lesson
    from lathesim.plugins import load_registry
    from lathesim.tui.model.case_file import Guess
    from lathesim.tui.screens.detective import DetectiveScreen

    conceal_case(load_lesson(_CASE), load_registry(), Path("case"), Hiding(["CoulombFriction@x_axis"], seed=1, validate=True))
    app = make_app(_CASE)
    answers: list[float] = []
    async with app.run_test(size=SIZE) as pilot:
        await pilot.press("f7")
        screen = app.screen
        assert isinstance(screen, DetectiveScreen)
        screen.open(Path("case"))
        while screen.case is None or screen.busy:
            await asyncio.sleep(0.05)
        screen.take_guess(Guess())
        screen.action_diagnose()
        help_shown = False
        for _ in range(keys):
            await asyncio.sleep(0.2)
            begun = time.perf_counter()
            app.simulate_key("f7" if help_shown else "f1")
            wanted = "detective" if help_shown else "help"
            while app.current_mode != wanted:
                await asyncio.sleep(0)
            help_shown = not help_shown
            answers.append(time.perf_counter() - begun)
        screen.stop_search()
        while screen.busy:  # else the search goes on in the background of what is measured next
            await asyncio.sleep(0.05)
    return answers


async def _drawing_share(seconds: float) -> float:
    """Return the share of a core that drawing a run takes, less what the app takes when it stands still."""
    from lathesim.cli.open_app import make_app
    from lathesim.tui.screens.bench_screen import BenchScreen

    _record(Path("run.h5"))
    app = make_app("01_contour_error")
    async with app.run_test(size=SIZE) as pilot:
        await pilot.pause(0.5)
        app.workbench.open_record(Path("run.h5"))
        await pilot.pause(0.5)
        idle = await _cpu_share(seconds / 2.0)
        screen = app.screen
        assert isinstance(screen, BenchScreen)
        app.workbench.pace = POINTS * 0.005 / seconds
        await pilot.press("home")
        screen.action_play(1)
        return await _cpu_share(seconds) - idle


async def _cpu_share(seconds: float) -> float:
    cpu, clock = time.process_time(), time.perf_counter()
    await asyncio.sleep(seconds)
    return (time.process_time() - cpu) / (time.perf_counter() - clock)


def _record(path: Path) -> None:
    """Keep a run of the first lesson, with as many samples as are drawn."""
    from lathesim.lessons.lesson import load_lesson
    from lathesim.lessons.simulate import simulate
    from lathesim.plugins import load_registry
    from lathesim.record_writer import save

    record = simulate(load_lesson("01_contour_error"), load_registry(), "IV")
    save(record.between(0.0, (POINTS - 1) * record.sample_period), path)
