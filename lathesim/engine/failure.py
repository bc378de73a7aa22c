"""Where a run broke, or a law runs on without end, and whether the step is short enough to begin with.

RK4 multiplies a mode of eigenvalue L by R(hL) = 1 + hL + (hL)^2/2 + (hL)^3/6 + (hL)^4/24 in each step h; a decaying mode needs
abs(R) <= 1. Source: Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.2. The machine is linearised at its start
with the sampled parts at rest; a part that grows faster while it runs is not seen here.
"""

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
from lathesim.engine.assembly import Place
from lathesim.engine.fuse import fuse
from lathesim.engine.module_cache import plain_module
from lathesim.engine.run_arrays import RunArrays
from lathesim.engine.wiring import Plan
from lathesim.errors import WiringError

_ROUNDING = 1e-9
"""How far above 1 the growth of a mode may be computed that does not grow."""
_KILO = 1e3
_OF_A_JUMP = 3.0
"""Growth of an entry of the Jacobian, from a difference ten times as narrow, above which a jump makes it."""


class _LawBrokeError(Exception):
    pass


def describe_failure(plan: Plan, first: int, count: int, arrays: RunArrays, noise: list[list[float]]) -> tuple[str, float]:
    """Return the sentence that names part, law, time and inputs of the first law that broke in the block, and the time [s]."""
    module = plain_module(fuse(plan, checked=True))
    module.check_law = _checker(plan)
    record, given = np.zeros(count * len(plan.channels)), arrays.as_lists()
    try:
        module.run_block(first, count, *plan.assembly.timing, *given.in_order, noise, record)
    except _LawBrokeError as broke:
        return str(broke.args[0]), float(broke.args[1])
    names = [name for name, position in plan.states.items() if not math.isfinite(given.states[position])]
    time = (first + count) * plan.assembly.sample_period
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
                raise _LawBrokeError(f"{where} gives {type(value).__name__} for {name}, a float is expected.", time)
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
        return any(isinstance(node, ast.While) for node in ast.walk(ast.parse(Path(path).read_text(encoding="utf-8"))))
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


def check_step(plan: Plan, arrays: RunArrays) -> None:
    """Refuse a step that is too long (:class:`WiringError`), naming the part that swings and the largest good step."""
    values_seen = (arrays.parameters.tobytes(), arrays.states.tobytes(), arrays.discrete.tobytes())
    if not plan.states or plan.kept.get("step checked for") == values_seen:
        return
    step = plan.assembly.step
    values, vectors = np.linalg.eig(jacobian(plan, arrays))
    if not _is_short_enough(values, step):
        values, vectors = np.linalg.eig(_without_jumps(plan, arrays))
    if _is_short_enough(values, step):
        plan.kept["step checked for"] = values_seen
        return
    decaying = values.real < 0.0
    worst = int(np.argmax(np.where(decaying, np.abs(amplification(values * step)), 0.0)))
    good = step
    while np.abs(amplification(values[decaying] * good)).max() > 1.0:
        good *= 0.97
    part = Place.of(list(plan.states)[int(np.argmax(np.abs(vectors[:, worst])))]).part
    rate = abs(values[worst])
    text = f"{rate / _KILO:.3g} krad/s" if rate >= _KILO else f"{rate:.3g} rad/s"
    raise WiringError(
        f"The step of {step * 1e6:.4g} us is too long: {part} swings at {text}.", remedy=f"Use {_round_down(good * 1e6)} us or less."
    )


def _is_short_enough(values: np.ndarray, step: float) -> bool:
    """Return whether no mode that decays grows in a step."""
    return bool(np.all(np.abs(amplification(values[values.real < 0.0] * step)) <= 1.0 + _ROUNDING))


def _without_jumps(plan: Plan, arrays: RunArrays) -> np.ndarray:
    """Return the Jacobian without the entries that a jump makes, as of a dry friction that turns round with the velocity: they grow as the
    width of the difference shrinks. A jump is crossed in one step and swings nowhere."""
    wide, narrow = (jacobian(plan, arrays, width) for width in (1e-7, 1e-8))
    return np.where(np.abs(narrow) > _OF_A_JUMP * np.abs(wide), 0.0, wide)


def amplification(product: np.ndarray) -> np.ndarray:
    """Return R(hL) of classical RK4 for the products of step and eigenvalue."""
    return 1.0 + product * (1.0 + product / 2.0 * (1.0 + product / 3.0 * (1.0 + product / 4.0)))


def jacobian(plan: Plan, arrays: RunArrays, share: float = 1e-7) -> np.ndarray:
    """Return the derivative of the rates with respect to the states [1/s, scaled by the states' units], by central differences whose width
    is a ``share`` of a state, or of one."""
    module = plain_module(fuse(plan))
    given = arrays.as_lists()
    count = len(plan.states)
    result = np.zeros((count, count))
    assembly = plan.assembly

    def rates(states: list[float]) -> np.ndarray:
        out = [0.0] * count
        module.rates(
            0.0, assembly.sample_period, assembly.step, given.parameters, states, given.discrete, given.memories, given.tables, out
        )
        return np.array(out)

    for column in range(count):
        width = share * max(1.0, abs(given.states[column]))
        high, low = list(given.states), list(given.states)
        high[column] += width
        low[column] -= width
        result[:, column] = (rates(high) - rates(low)) / (2.0 * width)
    return np.where(np.isfinite(result), result, 0.0)


def _round_down(number: float) -> str:
    digits = 1 - math.floor(math.log10(number))
    return f"{math.floor(number * 10**digits) / 10**digits:g}"
