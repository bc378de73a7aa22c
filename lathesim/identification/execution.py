"""What a search may spend: threads, time, and results that are kept."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Hashable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from threading import Lock
from typing import Any, Generic, TypeVar


@dataclass(frozen=True)
class Deadline:
    """A moment [s] of a ``clock`` at which the time is over; by default there is no limit."""

    moment: float = math.inf
    clock: Callable[[], float] = time.perf_counter

    @classmethod
    def after(cls, limit: float, clock: Callable[[], float] = time.perf_counter) -> Deadline:
        """Return the moment ``limit`` [s] from now."""
        return cls(clock() + limit, clock)

    def __reduce__(self) -> tuple[Any, ...]:
        """Take the time that is left to another process, whose clock counts from another moment."""
        return (Deadline.after, (self.moment - self.clock(),)) if self.moment < math.inf else (Deadline, ())

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


Result = TypeVar("Result")


class Remembered(Generic[Result]):
    """Results by what was asked, the ``most`` last ones of them."""

    def __init__(self, most: int) -> None:
        """Remember nothing yet."""
        self._most = most
        self._known: dict[Hashable, Result] = {}
        self._lock = Lock()

    def get(self, asked: Hashable, make: Callable[[], Result]) -> Result:
        """Return the result for ``asked``, made where it is not known; two threads that ask at once may both make it."""
        with self._lock:
            if asked in self._known:
                return self._known[asked]
        result = make()
        with self._lock:
            while len(self._known) >= self._most:
                del self._known[next(iter(self._known))]
            self._known[asked] = result
        return result


Item = TypeVar("Item")


def together(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Return what ``work`` makes of each item, in order, as it is ready; an interruption drops what has not begun."""
    with ThreadPoolExecutor(2) as pool:
        waiting = [pool.submit(work, item) for item in items]
        try:
            for one in waiting:
                yield one.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
