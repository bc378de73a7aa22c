"""Where a run broke: the block in question is run again with every law's result looked at."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from lathesim.component import DiscreteState, State
from lathesim.engine.compiling.module_cache import plain_module
from lathesim.engine.fusing.fuse import fuse
from lathesim.engine.running.run_arrays import RunArrays
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
