"""The last few results of something that takes long and is asked for again soon, by several threads at once."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, TypeVar

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
