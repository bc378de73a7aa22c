"""A law that runs on without end: kept out of machine code, which nothing can stop, and named when STOP or Ctrl-C has to end it."""

from __future__ import annotations

import ast
import ctypes
import functools
import inspect
import threading
import time as clock
import traceback
from pathlib import Path
from types import TracebackType
from typing import Any

from lathesim.engine.wiring import Plan

PATIENCE = 3.0
"""Seconds a block may last after STOP, or before Ctrl-C, before a law counts as endless; blocks are cut to a tenth of a second."""


class LawRunsOnError(BaseException):
    """Raised out of an endless law from another thread; no ``except Exception`` on the way takes it for the law's own."""


def may_run_on(plan: Plan) -> bool:
    """Return whether a part from outside this package has a ``while`` in its file; stock parts are tested to end."""
    guests = {part.component for part in plan.parts.values() if part.component.__module__.partition(".")[0] != "lathesim"}
    return any(_has_while(inspect.getsourcefile(component) or "") for component in guests)


@functools.lru_cache(maxsize=256)
def _has_while(path: str) -> bool:
    try:
        text = Path(path).read_text(encoding="utf-8")
        return any(isinstance(node, ast.While) for node in ast.walk(ast.parse(text)))
    except (OSError, SyntaxError, UnicodeDecodeError):
        return True


class Watch:
    """Watches a run in this thread: when ``stop`` is set and the block under way does not end, it raises :class:`LawRunsOnError` in it.

    Only where a part may run on, and only plain Python can be left that way.
    """

    def __init__(self, plan: Plan, stop: threading.Event | None) -> None:
        self.plan = plan
        self.stop = stop if stop is not None and may_run_on(plan) else None
        self._thread = ctypes.c_ulong(threading.get_ident())
        self._lock = threading.Lock()
        self._over = threading.Event()
        self.block_begun = clock.perf_counter()

    def __enter__(self) -> Watch:
        if self.stop is not None:
            threading.Thread(target=self._wait, args=(self.stop,), daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._over.set()
            if self.stop is not None:
                ctypes.pythonapi.PyThreadState_SetAsyncExc(self._thread, None)

    def _wait(self, stop: threading.Event) -> None:
        while not self._over.is_set() and not stop.wait(0.5):
            pass
        self._over.wait(PATIENCE)
        with self._lock:
            if not self._over.is_set():
                ctypes.pythonapi.PyThreadState_SetAsyncExc(self._thread, ctypes.py_object(LawRunsOnError))

    def verdict(self, stopped: BaseException, time: float) -> str:
        """Return the sentence about the law that did not end, empty where the run was merely stopped."""
        if isinstance(stopped, KeyboardInterrupt) and clock.perf_counter() - self.block_begun < PATIENCE:
            return ""
        found = _law_in(stopped.__traceback__, self.plan)
        return f"{found} runs on without end after t = {time:.4g} s. Let every loop end." if found else ""


def _law_in(trace: TracebackType | None, plan: Plan) -> str:
    """Return part, law and ``file:line`` of the innermost law of a traceback."""
    laws: dict[str, Any] = {}
    for part in plan.parts.values():
        for law, function in part.component.laws.items():
            laws[f"{part.component.__name__}_{law}"] = (f"{part.name}: {part.component.__name__}.{law}", function)
    for frame in reversed(traceback.extract_tb(trace)):
        name = frame.name if frame.name in laws else frame.name.rstrip("0123456789").rstrip("_")
        if name in laws:
            told, function = laws[name]
            return f"{told} ({inspect.getsourcefile(function)}:{function.__code__.co_firstlineno})"
    return ""
