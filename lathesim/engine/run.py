"""``run``: a plan to a Record, in blocks, with progress and STOP; what was computed is kept however the run ends."""

from __future__ import annotations

import platform
import threading
import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

import lathesim
from lathesim.engine.assembly import FloatArray
from lathesim.engine.failure import describe_failure
from lathesim.engine.fuse import FusedModule, fuse
from lathesim.engine.module_cache import compiled_module, plain_module
from lathesim.engine.noise import draw_noise
from lathesim.engine.run_arrays import RunArrays, start_arrays
from lathesim.engine.stability import check_step
from lathesim.engine.wiring import Plan
from lathesim.errors import SimulationError
from lathesim.record import Channel, Record

ENGINES = ("auto", "plain", "compiled")
_PLAIN_PATIENCE = 1.0
"""Seconds of plain running after which ``auto`` loads the compiler; loading it and its cached code takes about as long."""
_BLOCK_TIME = 0.1
_LONGEST_WITHOUT_END = 36000.0
"""Simulated seconds after which a run that has neither a duration nor come to its end is ended."""


class Sink(Protocol):
    """Takes the recorded blocks of a long run, so that memory stays bounded."""

    def write(self, time: FloatArray, values: FloatArray) -> None:
        """Take the times (samples,) and values (channels, samples) of the next block."""


@dataclass
class _Progress:
    first: int = 0
    finished: bool = False
    status: str = "complete"
    engine: str = "plain"


def run(
    plan: Plan,
    *,
    duration: float | None = None,
    seed: int = 0,
    engine: str = "auto",
    overrides: Mapping[str, float] | None = None,
    progress: Callable[[float], None] | None = None,
    stop: threading.Event | None = None,
    sink: Sink | None = None,
    check_stability: bool = True,
) -> Record:
    """Run a plan and give its Record.

    ``duration`` [s] bounds the run; without it the run ends when the machine's ``finish`` output rises. ``overrides`` maps
    ``part.parameter`` and ``part.state`` to other values [SI]. ``progress`` is told the simulated time after each block; ``stop`` ends the
    run after the current block, and Ctrl-C does the same. With a ``sink`` the values go there and the Record holds none.

    Raises :class:`SimulationError` when a law breaks, with the data up to then in its ``record``.
    """
    if engine not in ENGINES:
        raise SimulationError(f"there is no engine '{engine}'.", remedy=f"Choose {', '.join(ENGINES)}.")
    if duration is None and not plan.assembly.finish:
        raise SimulationError("the run has no end.", remedy="Give a duration, or name the output that ends it.")
    started = clock.perf_counter()
    arrays = start_arrays(plan, overrides)
    if check_stability:
        check_step(plan, arrays)
    period = plan.assembly.sample_period
    last = round((duration if duration is not None else _LONGEST_WITHOUT_END) / period) + 1
    fused = fuse(plan)
    blocks: list[FloatArray] = []
    state = _Progress(engine="compiled" if engine == "compiled" else "plain")
    failure = ""
    try:
        failure = _advance(plan, fused, arrays, state, last, seed, engine, blocks, progress, stop, sink, started)
    except KeyboardInterrupt:
        state.status = "stopped"
    if not state.finished and state.status == "complete" and duration is None:
        state.status = f"stopped: no end after {_LONGEST_WITHOUT_END:g} s"
    record = _record(plan, blocks, state, seed, clock.perf_counter() - started)
    if failure:
        raise SimulationError(failure, remedy="The data up to then are kept.", record=record)
    return record


def _advance(
    plan: Plan, fused: FusedModule, arrays: RunArrays, state: _Progress, last: int, seed: int, engine: str, blocks: list[FloatArray],
    progress: Callable[[float], None] | None, stop: threading.Event | None, sink: Sink | None, started: float,
) -> str:  # fmt: skip
    """Run block after block; give the sentence about what broke, empty where nothing did."""
    module = compiled_module(fused) if engine == "compiled" else plain_module(fused)
    live = arrays if engine == "compiled" else arrays.as_lists()
    period = plan.assembly.sample_period
    size = min(256, last)
    while state.first < last and not state.finished:
        if stop is not None and stop.is_set():
            state.status = "stopped"
            break
        if engine == "auto" and state.engine == "plain" and clock.perf_counter() - started > _PLAIN_PATIENCE:
            module, live, state.engine = compiled_module(fused), live.as_arrays(), "compiled"
        count = min(size, last - state.first)
        noise = draw_noise(plan.noises, seed, state.first, count)
        before = live.copy()
        begun = clock.perf_counter()
        done, values, broken = _one_block(plan, module, live, state, count, noise)
        if broken or not np.isfinite(values).all():
            sentence, time = describe_failure(plan, state.first, count, before, noise.tolist())
            good = max(0, min(done if not broken else count, int(time / period) - state.first + 1))
            broken_at = np.flatnonzero(~np.isfinite(values).all(axis=0))
            kept = values[:, : min([good, *broken_at[:1]])]
            _keep(kept, state, period, blocks, sink)
            state.status = f"failed: {sentence}"
            return sentence
        _keep(values, state, period, blocks, sink)
        if progress is not None:
            progress(state.first * period)
        spent = clock.perf_counter() - begun
        size = int(min(65536, max(64, size * (2.0 if spent < _BLOCK_TIME / 2 else 1.0 if spent < _BLOCK_TIME * 2 else 0.5))))
    return ""


def _one_block(plan: Plan, module: Any, live: RunArrays, state: _Progress, count: int, noise: FloatArray) -> tuple[int, FloatArray, bool]:
    compiled = state.engine == "compiled"
    channels = max(1, len(plan.channels))
    record: Any = np.zeros((channels, count)) if compiled else [[0.0] * count for _ in range(channels)]
    assembly = plan.assembly
    try:
        done, state.finished = module.run_block(
            state.first, count, assembly.sample_period, assembly.step, plan.steps_per_sample, live.parameters, live.states, live.discrete,
            live.memories, live.tables, noise if compiled else noise.tolist(), record,
        )  # fmt: skip
    except (ArithmeticError, ValueError, TypeError, IndexError):
        return count, np.asarray(record, dtype=float)[: len(plan.channels)], True
    return done, np.asarray(record, dtype=float)[: len(plan.channels), :done], False


def _keep(values: FloatArray, state: _Progress, period: float, blocks: list[FloatArray], sink: Sink | None) -> None:
    count = values.shape[1]
    if sink is not None:
        sink.write((state.first + np.arange(count)) * period, values)
    else:
        blocks.append(values)
    state.first += count


def _record(plan: Plan, blocks: list[FloatArray], state: _Progress, seed: int, wall_time: float) -> Record:
    values = np.concatenate(blocks, axis=1) if blocks else np.zeros((len(plan.channels), 0))
    period = plan.assembly.sample_period
    channels = {
        name: Channel(name, plan.unit(name), np.ascontiguousarray(values[position]), plan.doc(name))
        for position, name in enumerate(plan.channels)
    }
    meta: dict[str, str | float | int] = {
        "seed": seed,
        "engine": state.engine,
        "status": state.status,
        "sample_period": period,
        "step": plan.assembly.step,
        "wall_time": wall_time,
        "lathesim": lathesim.__version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
    }
    return Record(np.arange(values.shape[1], dtype=np.float64) * period, channels, meta)
