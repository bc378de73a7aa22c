"""Work on the workers of a Dask scheduler: calls and what they share as they are here, with the plug-ins as their source.

A worker runs what the user who asks chose to run. The scheduler makes the work of a worker that stops again on the others.
Source: Dask.distributed documentation, Resilience. Left out: files that only the workers have.
"""

from __future__ import annotations

import functools
import importlib.util
import logging
import pickle
import platform
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from lathesim.errors import LatheSimError

_POLL = 0.5
"""Seconds between two looks at the workers while nothing ends."""
_FEWEST_LOOKS = 60
"""Looks without any worker after which the work is given up."""


class Cluster:
    """A Dask scheduler at ``tcp://host:port``, with the plug-ins that its workers load first; ``say`` tells once that a worker stopped.

    Raises :class:`LatheSimError` where ``distributed`` is not installed, no scheduler answers, or it has no workers.
    """

    def __init__(self, address: str, plugins: Sequence[str] = (), say: Callable[[str], None] = lambda text: None) -> None:
        distributed = _distributed()
        place = address.partition("://")[2]
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        try:
            self._client = distributed.Client(f"tcp://{place}", timeout="10s")
        except (OSError, ValueError):
            raise LatheSimError(f"no Dask scheduler answers at {place}.", remedy="Start one with: dask scheduler") from None
        self._say, self._lost = say, False
        self._workers = self._now()
        if not self._workers:
            self._client.close()
            raise LatheSimError(f"the scheduler at {place} has no workers.", remedy=f"Start some with: dask worker {place}")
        files = {str(Path(name).absolute()) for name in plugins}
        self._plugins = tuple(
            (name, Path(module.__file__).read_text(encoding="utf-8"))
            for name, module in list(sys.modules.items())
            if getattr(module, "__file__", None) in files and module.__file__ is not None
        )

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *given: object) -> None:
        self._client.close()

    def results(
        self, function: Callable[[Any, Any], Any], shared: Any, calls: Sequence[Any], stop: threading.Event | None = None
    ) -> Iterator[tuple[int, Any]]:
        """Yield the number and the result of ``function(shared, call)`` for each call, as they end.

        An error of a call is raised here, and ``KeyboardInterrupt`` where ``stop`` is set. What has not begun is then given up.
        """
        import cloudpickle

        held = cloudpickle.dumps((function, shared))
        numbers = {
            self._client.submit(run_on_worker, _version(), self._plugins, held, cloudpickle.dumps(call), pure=False): number
            for number, call in enumerate(calls)
        }
        try:
            while numbers:
                for future in self._ended(list(numbers), stop):
                    yield numbers.pop(future), _result(future)
        finally:
            self._client.cancel(list(numbers))

    def in_order(
        self, function: Callable[[Any, Any], Any], shared: Any, calls: Sequence[Any], stop: threading.Event | None = None
    ) -> list[Any]:
        """Return the results of all calls, in their order."""
        found = dict(self.results(function, shared, calls, stop))
        return [found[number] for number in range(len(calls))]

    def _ended(self, futures: list[Any], stop: threading.Event | None) -> set[Any]:
        """Return what has ended, as soon as something has; look at the workers meanwhile."""
        distributed = _distributed()
        empty = 0
        while True:
            if stop is not None and stop.is_set():
                raise KeyboardInterrupt
            try:
                done: set[Any] = distributed.wait(futures, timeout=_POLL, return_when="FIRST_COMPLETED").done
            except TimeoutError:
                done = set()
            there = self._now()
            if self._workers - there and not self._lost:
                self._lost = True
                self._say("A worker stopped: its work is made again by the others.")
            if done:
                return done
            empty = 0 if there else empty + 1
            if empty >= _FEWEST_LOOKS:
                raise LatheSimError("the scheduler has no workers left.", remedy="Start some, and give the same command again.")

    def _now(self) -> set[str]:
        return set(self._client.nthreads())


def run_on_worker(version: str, plugins: tuple[tuple[str, str], ...], held: bytes, call: bytes) -> Any:
    """Return what a call gives on a worker; :class:`LatheSimError` where it has another version."""
    if version != _version():
        raise LatheSimError(f"a worker has {_version()}, and here is {version}.", remedy="Install the same versions on all workers.")
    function, shared = _held(plugins, held)
    return function(shared, pickle.loads(call))  # noqa: S301  # from the user who asks, as every task of Dask


_FOLDERS: list[tempfile.TemporaryDirectory[str]] = []
"""Folders of plug-ins, kept until the worker ends."""


@functools.lru_cache(maxsize=8)
def _held(plugins: tuple[tuple[str, str], ...], held: bytes) -> tuple[Callable[[Any, Any], Any], Any]:
    """Return a function and what its calls share, once for all of them, with the plug-ins under the names of their modules."""
    _FOLDERS.append(tempfile.TemporaryDirectory(prefix="lathesim-plugins-"))
    for name, text in plugins:
        path = Path(_FOLDERS[-1].name) / f"{name}.py"
        path.write_text(text, encoding="utf-8")
        spec = importlib.util.spec_from_file_location(name, path)
        if name not in sys.modules and spec is not None and spec.loader is not None:
            sys.modules[name] = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(sys.modules[name])
    found: tuple[Callable[[Any, Any], Any], Any] = pickle.loads(held)  # noqa: S301  # as above
    return found


def _version() -> str:
    import lathesim

    return f"lathesim {lathesim.__version__} with Python {'.'.join(platform.python_version_tuple()[:2])}"


def _result(future: Any) -> Any:
    """Return a result; an error of the call is raised, and one of the workers is said in a sentence."""
    try:
        return future.result()
    except _distributed().scheduler.KilledWorker:
        raise LatheSimError("a piece of the work stopped every worker that began it.", remedy="Give the workers more memory.") from None


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        fact = "a cluster needs the package 'distributed', which is not installed."
        raise LatheSimError(fact, remedy="python -m pip install 'lathesim[cluster]'") from None
    return distributed
