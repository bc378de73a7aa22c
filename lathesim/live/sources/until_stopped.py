"""A loop that Ctrl-C, or a request to terminate, ends within a moment."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

Answer = TypeVar("Answer")


def run_until_stopped(work: Callable[[asyncio.Event], Coroutine[Any, Any, Answer]]) -> tuple[Answer, bool]:
    """Run a coroutine that ends soon after the event it is given is set; Ctrl-C and a request to terminate set it.

    Return its answer and whether it was stopped.
    """

    async def guarded() -> tuple[Answer, bool]:
        stop = asyncio.Event()
        loop = asyncio.get_running_loop()
        for kind in (signal.SIGINT, signal.SIGTERM):
            try:
                loop.add_signal_handler(kind, stop.set)
            except (NotImplementedError, RuntimeError, ValueError):
                break  # not in the main thread, or not on this system: Ctrl-C then ends the loop as it does any program
        return await work(stop), stop.is_set()

    return asyncio.run(guarded())
