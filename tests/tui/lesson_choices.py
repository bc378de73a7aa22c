"""Lessons chosen (F6, Down, Enter) in a terminal of 80 x 24 while other processes keep the machine busy."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from lathesim.lessons.lesson import lesson_files
from tests.tui.terminal import Terminal, wait

MOST = 1.0
"""Processor time [s] within which a choice is to be drawn."""
_PATIENCE = 30.0


@dataclass(frozen=True)
class Choice:
    """A lesson that was chosen: whether its bench was drawn, after which processor time of the app and which time of the clock [s]."""

    lesson: str
    is_drawn: bool
    processor: float
    clock: float


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


def choices(folder: Path, count: int, others: int) -> Iterator[Choice]:
    """Choose one lesson after another in an app of its own and return how each was drawn."""
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
                began, used = time.monotonic(), _processor_time(process)
                terminal.send("Down", "Enter")
                is_drawn = wait(lambda name=name: _shows_bench(terminal.screen(), name), _PATIENCE, 0.02)  # type: ignore[misc]
                yield Choice(name, is_drawn, _processor_time(process) - used, time.monotonic() - began)
    finally:
        terminal.end()


def _shows_bench(screen: str, lesson: str) -> bool:
    return "Half section" in screen and f"lathesim run {lesson}" in screen


def _processor_time(process: int) -> float:
    words = Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
