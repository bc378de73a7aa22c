"""A line that tells how far long work is, on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def working(*, shown: bool = True, first: str = "reading the lesson") -> Iterator[Callable[[str], None]]:
    """Return what tells a step; on a terminal the last one stands in one line, elsewhere nothing is written."""
    if not (shown and sys.stderr.isatty()):
        yield lambda text: None
        return
    from rich.console import Console

    with Console(stderr=True).status(first) as status:
        yield lambda text: status.update(text.strip())
