"""What a search may spend: runs of the machine, counted by several threads at once, and time."""

from __future__ import annotations

import time
from collections.abc import Callable
from threading import Lock


class RunCount:
    """A number of runs. It depends on what was asked alone, and so a search that ends after so many ends alike on every computer."""

    def __init__(self) -> None:
        """Begin with none."""
        self.total = 0
        self._lock = Lock()

    def add(self, runs: int) -> None:
        """Count further runs."""
        with self._lock:
            self.total += runs


def until(limit: float, tell: Progress) -> Progress:
    """Return what tells each step of a search and interrupts it, once, at the first step after ``limit`` [s] from now."""
    end = time.perf_counter() + limit
    ended = False

    def told(text: str) -> None:
        nonlocal ended
        tell(text)
        if not ended and time.perf_counter() > end:
            ended = True
            raise KeyboardInterrupt

    return told


Progress = Callable[[str], None]
