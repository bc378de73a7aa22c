"""A search that ends in time: after a limit its next step stops it as Ctrl-C does, and what is known is kept."""

from __future__ import annotations

import time

from lathesim.diagnosis.trial import Tell


def until(limit: float, tell: Tell) -> Tell:
    """Give what tells each step of a search and interrupts it, once, at the first step after ``limit`` [s] from now."""
    end = time.perf_counter() + limit
    ended = False

    def told(text: str) -> None:
        nonlocal ended
        tell(text)
        if not ended and time.perf_counter() > end:
            ended = True
            raise KeyboardInterrupt

    return told
