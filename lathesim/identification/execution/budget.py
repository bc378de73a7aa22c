"""What a search may spend: runs of the machine, counted by several threads at once, and time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
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


@dataclass(frozen=True)
class Deadline:
    """A moment [s] of a ``clock`` at which the time is over; by default there is no limit."""

    moment: float = math.inf
    clock: Callable[[], float] = time.perf_counter

    @classmethod
    def after(cls, limit: float, clock: Callable[[], float] = time.perf_counter) -> Deadline:
        """Return the moment ``limit`` [s] from now."""
        return cls(clock() + limit, clock)

    @property
    def is_over(self) -> bool:
        """Whether the moment has come."""
        return self.clock() >= self.moment

    def share(self, part: float) -> Deadline:
        """Return the moment at which ``part`` of the time from now on will be over."""
        now = self.clock()
        return replace(self, moment=now + part * (self.moment - now)) if self.moment > now else self


def until(deadline: Deadline, tell: Progress) -> Progress:
    """Return a progress function that passes on each step of a search, and interrupts it once at the first step after the deadline."""
    ended = False

    def told(text: str) -> None:
        nonlocal ended
        tell(text)
        if not ended and deadline.is_over:
            ended = True
            raise KeyboardInterrupt

    return told


Progress = Callable[[str], None]
