"""The progress bar of a run, on the error stream and only where a person looks at it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_bar(name: str, expected: float | None, *, shown: bool) -> Iterator[Callable[[float], None] | None]:
    """Return what is told the simulated time [s] while a run goes on; ``expected`` is about how long it lasts."""
    if not (shown and sys.stderr.isatty()):
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[simulated]:.1f} s simulated"), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=expected, simulated=0.0)

        def told(time: float) -> None:
            bar.update(task, completed=min(time, expected) if expected else time, simulated=time)

        yield told
