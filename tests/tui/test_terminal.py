"""The app in a real terminal, without colours, with the mouse alone, and when the terminal goes away."""

from __future__ import annotations

import os
import re
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from textual.widgets import Button, Input

from lathesim.record import load
from tests.tui.driving import opened, run_to_end, setup_of, until
from tests.tui.lathe_moments import GOLDENS
from tests.tui.pictures import SNAPSHOTS, shown
from tests.tui.screen_words import words_of
from tests.tui.terminal import Terminal, wait

RUNNING = re.compile(r"Time +(?!0\.00)\d+\.\d+ s")
"""The time on the bench, once it goes on."""


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    if shutil.which("tmux") is None:
        pytest.skip("there is no tmux on this machine")
    found = Terminal(tmp_path)
    yield found
    found.end()


@pytest.mark.timeout(420)
def test_a_lesson_runs_in_a_real_terminal_though_its_key_is_pressed_before_it_is_read(terminal: Terminal) -> None:
    assert terminal.shows("Half section"), terminal.screen()
    terminal.send("F5")
    assert terminal.shows("largest contour error"), terminal.screen()
    terminal.send("F4")
    assert terminal.shows("interpolator"), terminal.screen()
    terminal.send("C-q")
    assert terminal.shows("LEFT 0"), terminal.screen()


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="asks /proc for the process in the terminal")
@pytest.mark.timeout(420)
def test_nothing_is_lost_when_the_terminal_goes_away(terminal: Terminal, tmp_path: Path) -> None:
    assert terminal.shows("Half section"), terminal.screen()
    terminal.send("p")
    assert terminal.shows("pace x1"), terminal.screen()
    terminal.send("F5")
    assert wait(lambda: "● pace x1" in terminal.screen() and RUNNING.search(terminal.screen()) is not None), terminal.screen()
    os.kill(terminal.pid(), signal.SIGHUP)
    path = tmp_path / "lathesim_runs" / "01_contour_error" / "001.h5"
    assert wait(path.exists)
    kept = load(path)
    assert kept.status == "stopped"
    assert len(kept) > 1


@pytest.mark.parametrize("screen", SNAPSHOTS)
async def test_a_screen_looks_as_it_did(screen: str) -> None:
    """``python -m tests.tui.pictures`` draws the snapshots again; look at them before they are kept."""
    assert words_of(await shown(screen)) == (GOLDENS / f"{screen}.txt").read_text(encoding="utf-8")


@pytest.mark.slow
async def test_every_screen_is_drawn_without_colours_on_a_dark_and_a_light_theme(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    async with opened(size=(80, 24)) as (app, pilot):
        await run_to_end(app, pilot)
        for theme in ("textual-dark", "textual-light"):
            app.theme = theme
            for key in ("f1", "f2", "f3", "f4", "f6", "f7", "f8"):
                await pilot.press(key)
                await until(pilot, lambda: len(words_of(app.export_screenshot()).split()) > 10, f"{key} in {theme}")


async def test_a_lesson_is_opened_run_and_its_results_seen_with_the_mouse_alone() -> None:
    async with opened() as (app, pilot):
        await pilot.click("#go-lessons")
        await until(pilot, lambda: app.current_mode == "lessons", "the lessons")
        await pilot.pause(0.3)
        await pilot.click("#lessons", offset=(5, 8))
        await pilot.pause(0.3)
        await pilot.click(Button)
        await until(pilot, lambda: app.current_mode == "bench", "the bench")
        opened_lesson = setup_of(app).lesson.name
        assert opened_lesson != "01_contour_error"
        await pilot.click("#go-run")
        await until(pilot, lambda: bool(app.workbench.runs) and app.workbench.live is None, "the end of the run")
        await pilot.pause(0.3)
        await pilot.click("#slider", offset=(10, 0))
        await pilot.click("#go-results")
        await until(pilot, lambda: app.current_mode == "results", "the results")
        assert app.workbench.runs[0].path.parent.name == opened_lesson


@pytest.mark.slow
async def test_a_screen_survives_a_tiny_terminal_and_comes_back() -> None:
    async with opened(size=(80, 24)) as (app, pilot):
        for key in ("f1", "f3", "f4", "f6", "f7", "f8"):
            await pilot.press(key)
            await pilot.resize_terminal(20, 5)
            await pilot.pause()
            await pilot.resize_terminal(80, 24)
            await pilot.pause()
            assert len(words_of(app.export_screenshot()).split()) > 10, key


async def test_a_full_disk_is_told_and_the_run_is_still_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    from lathesim.errors import RecordError
    from lathesim.lessons import kept_run

    def full(record: object, path: Path) -> None:
        raise RecordError("the disk is full.", place=str(path), remedy="Make room, then run again.")

    monkeypatch.setattr(kept_run, "save", full)
    async with opened() as (app, pilot):
        await pilot.press("f5")
        await until(pilot, lambda: bool(app.workbench.runs) and app.workbench.live is None, "the end of the run")
        await pilot.pause(0.5)
        assert "the disk is full" in words_of(app.export_screenshot()).replace("\n", " ")
        await pilot.press("space", "f4")
        await pilot.pause(0.2)
        assert app.screen.query_one("#value", Input)
