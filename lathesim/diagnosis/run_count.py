"""How many runs of a machine a search has cost, counted by several threads at once."""

from __future__ import annotations

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
