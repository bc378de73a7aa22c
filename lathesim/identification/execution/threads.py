"""Work done two pieces at a time: each waits for simulations now and then, and two of them keep two cores busy.

How many run together does not depend on the machine, so that the same candidates are tried everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

TOGETHER = 2
Item = TypeVar("Item")
Result = TypeVar("Result")


def together(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Return what ``work`` makes of each item, in order, as it is ready; an interruption drops what has not begun."""
    with ThreadPoolExecutor(TOGETHER) as pool:
        waiting = [pool.submit(work, item) for item in items]
        try:
            for one in waiting:
                yield one.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
