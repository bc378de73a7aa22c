"""What a screen shows once a batch of updates ends; lessons chosen in a real terminal on a busy machine."""

from __future__ import annotations

import asyncio
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from textual.app import App
from textual.screen import Screen

from lathesim.lessons.lesson import lesson_files
from tests.tui.driving import PATIENCE, opened, until
from tests.tui.terminal import Terminal, wait

MOST = 1.0
"""Processor time [s] within which a choice is to be drawn."""


async def test_a_screen_that_turned_idle_in_a_batch_is_painted_when_the_batch_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Markdown and the footer hold a batch open over many turns of the event loop, also those of a screen that was left."""
    painted: set[Screen[Any]] = set()
    is_new = asyncio.Event()
    display = App._display

    def watched(app: App[Any], screen: Screen[Any], renderable: Any) -> None:
        if renderable is not None and not app._batch_count:
            painted.add(screen)
            is_new.set()
        display(app, screen, renderable)

    async with opened() as (app, pilot):
        await pilot.press("f6")
        await until(pilot, lambda: app.current_mode == "lessons" and not app._batch_count, "the lessons")
        monkeypatch.setattr(App, "_display", watched)
        with app.batch_update():
            await app.switch_mode("bench")
            await until(pilot, lambda: app._batch_count == 1, "the end of the pause that a change of screens makes")
            assert not painted
        await asyncio.wait_for(is_new.wait(), PATIENCE)  # a pilot that waits would wake the screen
        assert painted == {app.screen}


@contextmanager
def busy(count: int) -> Iterator[None]:
    """Keep ``count`` processes busy."""
    burning = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in burning:
            process.kill()
            process.wait()


def choices(folder: Path, count: int, others: int) -> Iterator[tuple[str, bool, float]]:
    """Choose one lesson after another in an app of its own; yield each, whether it was drawn, and the processor time of the app [s]."""
    names = [path.stem for path in lesson_files()]
    terminal = Terminal(folder, (80, 24))
    try:
        assert terminal.shows("Half section"), terminal.screen()
        process = terminal.pid()
        with busy(others):
            for place in range(1, count + 1):
                terminal.send("F6")
                assert terminal.shows("To try"), terminal.screen()
                name = names[place % len(names)]
                used = _processor_time(process)
                terminal.send("Down", "Enter")
                is_drawn = wait(lambda name=name: _shows_bench(terminal.screen(), name), PATIENCE, 0.02)  # type: ignore[misc]
                yield name, is_drawn, _processor_time(process) - used
    finally:
        terminal.end()


def _shows_bench(screen: str, lesson: str) -> bool:
    return "Half section" in screen and f"lathesim run {lesson}" in screen


def _processor_time(process: int) -> float:
    words = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("tmux") is None or not Path("/proc").is_dir(), reason="needs tmux and /proc")
@pytest.mark.timeout(420)
def test_a_lesson_that_is_chosen_on_a_busy_machine_is_drawn(tmp_path: Path) -> None:
    assert [name for name, is_drawn, used in choices(tmp_path, 10, 6) if not is_drawn or used > MOST] == []
