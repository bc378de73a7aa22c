"""How a person sees that long work goes on, and ends it: on the error stream, and only where someone looks at it."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

_EVERY = 10.0
"""Time between two lines of progress without a terminal [s]."""


@contextmanager
def working(*, shown: bool = True, first: str = "reading the lesson") -> Iterator[Callable[[str], None]]:
    """Return what tells a step; on a terminal the last one stands in one line, elsewhere nothing is written."""
    if not (shown and sys.stderr.isatty()):
        yield lambda text: None
        return
    from rich.console import Console

    with Console(stderr=True).status(first) as status:
        yield lambda text: status.update(text.strip())


def said_beside(as_json: bool) -> Callable[[str], None]:
    """Return what writes a sentence to the error stream, and nothing beside JSON."""
    return lambda sentence: None if as_json else click.echo(sentence, err=True)


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


@contextmanager
def interruptible() -> Iterator[threading.Event]:
    """Yield an event that the first Ctrl-C sets; a second one interrupts as usual."""
    stop = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return
    before = signal.getsignal(signal.SIGINT)

    def wish(number: int, frame: object) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    if before is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, wish)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def time_bar(label: str, seconds: float, steps_per_second: float, *, shown: bool) -> Iterator[Callable[[float], None]]:
    """Yield what takes the time [s] that has passed of ``seconds`` and moves a bar; without ``shown``, nothing is written."""
    if not shown:
        yield lambda time: None
        return
    with click.progressbar(length=max(1, int(steps_per_second * seconds)), label=label, show_pos=False) as bar:
        done = 0

        def told(time: float) -> None:
            nonlocal done
            steps = int(steps_per_second * time)
            if steps > done:
                bar.update(steps - done)
                done = steps

        yield told


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Take a request to terminate (of a batch system, of ``timeout``) for Ctrl-C; only the main thread can."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def steps(*, shown: bool, first: str) -> Iterator[Callable[[str], None]]:
    """Yield what takes the text of each step: a terminal shows the last one, elsewhere it is printed every ten seconds."""
    with working(shown=shown, first=first) if sys.stderr.isatty() or not shown else progress_lines(first=first) as tell:
        yield tell


@contextmanager
def progress_lines(
    waited: Callable[[float], bool] | None = None, *, first: str = "reading the recording"
) -> Iterator[Callable[[str], None]]:
    """Yield a function that takes the text of each step, and print the last text every ten seconds.

    ``waited`` replaces the wait: it takes seconds and returns whether the work was done before they had passed.
    """
    done, last, began = threading.Event(), [""], time.monotonic()

    def write() -> None:
        while not (waited or done.wait)(_EVERY):
            click.echo(f"After {time.monotonic() - began:.0f} s: {last[0] or first}.", err=True)

    writer = threading.Thread(target=write, daemon=True)
    writer.start()
    try:
        yield lambda text: last.__setitem__(0, text.strip())
    finally:
        done.set()
        writer.join()


@contextmanager
def count_bar(name: str, total: int, there: int = 0) -> Iterator[Callable[[], None]]:
    """Yield what takes notice of each of ``total`` things that is done; a bar on the error stream where a person looks at it."""
    if not sys.stderr.isatty():
        yield lambda: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(name, total=total, completed=there)
        yield lambda: bar.advance(task)
