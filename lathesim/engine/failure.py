"""Where a run broke, or a law runs on without end."""

from __future__ import annotations

import ast
import ctypes
import functools
import inspect
import math
import threading
import time as clock
import traceback
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from lathesim.component import DiscreteState, State
from lathesim.engine.fuse import fuse
from lathesim.engine.module_cache import plain_module
from lathesim.engine.run_arrays import RunArrays
from lathesim.engine.wiring import Plan


class _LawBrokeError(Exception):
    pass


def describe_failure(plan: Plan, first: int, count: int, arrays: RunArrays, noise: list[list[float]]) -> tuple[str, float]:
    """Return the sentence that names part, law, time and inputs of the first law that broke in the block, and the time [s]."""
    module = plain_module(fuse(plan, checked=True))
    module.check_law = _checker(plan)
    assembly = plan.assembly
    record = np.zeros(count * len(plan.channels))
    given = arrays.as_lists()
    try:
        module.run_block(
            first, count, assembly.sample_period, assembly.step, plan.steps_per_sample, given.parameters, given.states, given.discrete,
            given.memories, given.tables, noise, record,
        )  # fmt: skip
    except _LawBrokeError as broke:
        return str(broke.args[0]), float(broke.args[1])
    names = [name for name, position in plan.states.items() if not math.isfinite(given.states[position])]
    time = (first + count) * assembly.sample_period
    return f"{', '.join(names) or 'The run'} grew beyond all numbers by t = {time:.4g} s.", time


def _checker(plan: Plan) -> Callable[..., Any]:
    kinds = {"derivative": State, "update": DiscreteState}

    def check_law(part: str, law: str, time: float, count: int, thunk: Callable[[], Any], given: tuple[tuple[str, float], ...]) -> Any:
        component = plan.parts[part].component
        names = list(component.declared(kinds[law])) if law in kinds else list(component.output_laws()[law])
        inputs = ", ".join(f"{name} = {value:.6g} {_unit(component, name)}".rstrip() for name, value in given)
        where = f"{component.__name__}.{law} ({_place(component.laws[law])})"
        try:
            result = thunk()
        except Exception as error:
            raise _LawBrokeError(f"{part} failed at t = {time:.4g} s in {where}: {error}; it was given {inputs}.", time) from error
        values = result if isinstance(result, tuple) else (result,)
        if count and len(values) != count:
            raise _LawBrokeError(f"{where} gives {len(values)} values, but {count} are declared: {', '.join(names)}.", time)
        for name, value in zip(names, values, strict=False):
            if not isinstance(value, (int, float)):
                raise _LawBrokeError(f"{where} gives {type(value).__name__} for {name}, a float is due.", time)
            if not math.isfinite(value):
                raise _LawBrokeError(f"{_broken(part, name, component, time)} in {where}; it was given {inputs}.", time)
        return result

    return check_law


def _broken(part: str, name: str, component: Any, time: float) -> str:
    """Return what broke; a part that is known to break somewhere (``breaks_where``) is unstable there, and says why."""
    reason = getattr(component, "breaks_where", "")
    if reason:
        return f"{part} is unstable at t = {time:.4g} s: {reason}. {part}.{name} stopped being a number"
    return f"{part}.{name} stopped being a number at t = {time:.4g} s"


def _unit(component: Any, name: str) -> str:
    item = component.declarations.get(name)
    return item.unit if item is not None and item.unit != "1" else ""


def _place(law: Callable[..., Any]) -> str:
    code = law.__code__
    return f"{inspect.getsourcefile(law) or code.co_filename}:{code.co_firstlineno}"


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


class EndlessLawWatch:
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

    def __enter__(self) -> EndlessLawWatch:
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
