"""``run``: a plan to a Record, in blocks, with progress and STOP; what was computed is kept however the run ends."""

from __future__ import annotations

import platform
import struct
import threading
import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

import lathesim
from lathesim.engine.assembly import FloatArray
from lathesim.engine.failure import EndlessLawWatch, LawRunsOnError, check_step, describe_failure, may_run_on
from lathesim.engine.fuse import FusedModule, fuse
from lathesim.engine.machine_code import CompiledMachine
from lathesim.engine.module_cache import compile_time, compiled_machine, is_compiled, plain_module, say, wiring_time
from lathesim.engine.run_arrays import RecordedValues, RunArrays, draw_noise, start_arrays
from lathesim.engine.wiring import Plan
from lathesim.errors import SimulationError
from lathesim.record import Record

ENGINES = ("auto", "plain", "compiled")
_WORTH = 1.5
_WORTH_IF_OFTEN = 0.05
"""How many times longer than compiling the rest of a plain run must take for ``auto`` to compile; less where many runs follow."""
_BLOCK_TIME = 0.1
_FIRST_BLOCK = {"plain": 256, "compiled": 4096}
"""Samples of the first block; later ones are made to last about ``_BLOCK_TIME`` seconds."""
_BLOCK_NUMBERS = 2**17
"""Recorded numbers of a block at most: 1 MB, which stays near the processor while the block is looked through and kept."""
_SMALLEST_BLOCK = 64
"""Samples of a block that shrinks because it took long; below, the cost of a call counts."""
_LONGER = 1.5
"""How many times longer than expected a run may last for its memories to hold what grows with the time."""
_LONGEST_WITHOUT_END = 36000.0
"""Simulated seconds after which a run that has neither a duration nor come to its end is ended."""


class BlockSink(Protocol):
    """Takes the recorded blocks of a long run, so that memory stays bounded."""

    def write(self, time: FloatArray, values: FloatArray) -> None:
        """Take the times (samples,) and values (channels, samples) of the next block."""


class AlarmGuard(Protocol):
    """Stops a run if a value leaves the limits of the machine."""

    def look(self, first: int, values: FloatArray) -> tuple[int, str] | None:
        """Return the first sample of a block (channels, samples) outside the limits and the alarm as a sentence, or none."""


@dataclass(frozen=True)
class Attendance:
    """Who attends a run; none of them changes a number.

    ``progress`` is called with the simulated time after each block. ``stop`` ends the run after the current block, or out of a law that
    does not end, as Ctrl-C does. A ``sink`` takes the values, and the Record then holds none; an ``onlooker`` sees each block as well,
    and slows the run where it takes its time. A ``guard`` ends the run at the first sample outside its limits.
    """

    progress: Callable[[float], None] | None = None
    stop: threading.Event | None = None
    sink: BlockSink | None = None
    onlooker: BlockSink | None = None
    guard: AlarmGuard | None = None


@dataclass(frozen=True)
class Hints:
    """What lets a run be quick and changes none of its numbers: about how long it lasts [s], and whether many of the machine follow.

    ``largest_block`` [samples] bounds what is computed at a time.
    """

    expected_time: float | None = None
    often: bool = False
    largest_block: int = _BLOCK_NUMBERS


@dataclass
class _Progress:
    expected: int
    last: int
    hints: Hints
    first: int = 0
    finished: bool = False
    status: str = "complete"
    engine: str = "plain"
    scratch: FloatArray = field(default_factory=lambda: np.empty(0))
    """Room for the record of a block, used again by the next: new memory costs more than what is written to it."""


@dataclass
class _Destination:
    """Where the recorded blocks go: to the sink or else into memory, and past the onlooker."""

    recorded: RecordedValues
    attended: Attendance
    period: float

    def add(self, state: _Progress, values: FloatArray) -> None:
        """Take the next block, shape (channels, samples)."""
        count = values.shape[1]
        if self.attended.sink is None:
            self.recorded.add(values)
        takers = [taker for taker in (self.attended.sink, self.attended.onlooker) if taker is not None]
        if takers:
            time, block = (state.first + np.arange(count)) * self.period, np.array(values, order="C")
            for taker in takers:
                taker.write(time, block)
        state.first += count


def run(
    plan: Plan,
    *,
    duration: float | None = None,
    seed: int = 0,
    engine: str = "auto",
    overrides: Mapping[str, float] | None = None,
    check_stability: bool = True,
    hints: Hints = Hints(),
    attended: Attendance = Attendance(),
) -> Record:
    """Run a plan and give its Record.

    ``duration`` [s] bounds the run; without it the run ends when the machine's ``finish`` output rises. ``overrides`` maps
    ``part.parameter`` and ``part.state`` to other values [SI].

    ``engine`` "auto" takes machine code where it is at hand, and compiles only where the rest of the run, judged by the ``hints``, would
    take longer plain. A machine that cannot be compiled runs plain, and the reason is said to whoever listens to the compiler.

    Raises :class:`SimulationError` when a law breaks or the guard ends the run, with the data up to then in its ``record``.
    """
    if engine not in ENGINES:
        raise SimulationError(f"there is no engine '{engine}'.", remedy=f"Choose {', '.join(ENGINES)}.")
    if duration is None and not plan.assembly.finish:
        raise SimulationError("the run has no end.", remedy="Give a duration, or name the output that ends it.")
    started, expected_time = clock.perf_counter(), hints.expected_time or 0.0
    lasts, held = (_LONGEST_WITHOUT_END, _LONGER * expected_time) if duration is None else (duration, duration)
    arrays = start_arrays(plan, overrides, held)
    if check_stability:
        check_step(plan, arrays)
    period = plan.assembly.sample_period
    last = round(lasts / period) + 1
    recorded = RecordedValues(len(plan.channels), 0 if duration is None or attended.sink is not None else last)
    state = _Progress(round(expected_time / period) if duration is None else last, last, hints)
    running = _Running(plan, fuse(plan), seed, state, _Destination(recorded, attended, period))
    failure = ""
    with EndlessLawWatch(plan, attended.stop) as watch:
        try:
            failure = running.advance(arrays, engine, watch)
        except (KeyboardInterrupt, LawRunsOnError) as stopped:
            failure = watch.verdict(stopped, state.first * period)
            state.status = f"failed: {failure}" if failure else "stopped"
    if not state.finished and state.status == "complete" and duration is None:
        state.status = f"stopped: no end after {_LONGEST_WITHOUT_END:g} s"
    record = _record(plan, recorded.values, state, seed, clock.perf_counter() - started)
    if failure:
        raise SimulationError(failure, remedy="The data up to then are kept.", record=record)
    return record


@dataclass(frozen=True)
class _Running:
    """A run that goes on block after block."""

    plan: Plan
    fused: FusedModule
    seed: int
    state: _Progress
    kept: _Destination

    def advance(self, arrays: RunArrays, engine: str, watch: EndlessLawWatch) -> str:
        """Run to the end; return the sentence about what broke, empty where nothing did."""
        fused, state, attended = self.fused, self.state, self.kept.attended
        module, live, may_compile = self._begun(arrays, engine)
        largest = min(max(_SMALLEST_BLOCK, _BLOCK_NUMBERS // max(1, len(self.plan.channels))), state.hints.largest_block)
        size = min(_FIRST_BLOCK[state.engine], state.last, largest)
        begun_at = clock.perf_counter()
        while state.first < state.last and not state.finished:
            if attended.stop is not None and attended.stop.is_set():
                state.status = "stopped"
                break
            if may_compile and state.first and _is_worth_compiling(fused, state, clock.perf_counter() - begun_at):
                module, may_compile = _machine_code(fused, state) or module, False
                live = live.as_arrays() if state.engine == "compiled" else live
            begun = watch.block_begun = clock.perf_counter()
            failure = self._block(module, live, min(size, state.last - state.first))
            if failure:
                state.status = f"failed: {failure}"
                return failure
            if attended.progress is not None:
                attended.progress(state.first * self.kept.period)
            spent = clock.perf_counter() - begun
            growth = 2.0 if spent < _BLOCK_TIME / 2 else 1.0 if spent < _BLOCK_TIME * 2 else 0.5
            size = int(min(largest, max(_SMALLEST_BLOCK, size * growth)))
        return ""

    def _begun(self, arrays: RunArrays, engine: str) -> tuple[Any, RunArrays, bool]:
        """Return the module that runs the first block, its arrays, and whether it may be compiled later."""
        may_compile = engine == "compiled" or (engine == "auto" and not may_run_on(self.plan))
        if may_compile and (engine == "compiled" or is_compiled(self.fused)):
            module, may_compile = _machine_code(self.fused, self.state), False
            if module is not None:
                return module, arrays, False
        return plain_module(self.fused), arrays.as_lists(), may_compile

    def _block(self, module: Any, live: RunArrays, count: int) -> str:
        """Run one block and keep it up to what broke; return the sentence about that, or the alarm of the guard."""
        plan, state, guard = self.plan, self.state, self.kept.attended.guard
        noise = draw_noise(plan.arrays.noises, self.seed, state.first, count)
        before = live.copy()
        done, values, broken = _one_block(plan, module, live, state, count, noise)
        alarm = guard.look(state.first, values) if guard is not None else None
        if alarm is not None:
            self.kept.add(state, values[:, : alarm[0] + 1])
            return alarm[1]
        if broken or not np.isfinite(values).all():
            sentence, time = describe_failure(plan, state.first, count, before, noise.tolist())
            good = max(0, min(done if not broken else count, int(time / self.kept.period) - state.first + 1))
            broken_at = np.flatnonzero(~np.isfinite(values).all(axis=0))
            self.kept.add(state, values[:, : min([good, *broken_at[:1]])])
            return sentence
        self.kept.add(state, values)
        return ""


def _machine_code(fused: FusedModule, state: _Progress) -> CompiledMachine | None:
    """Return the machine compiled; where it cannot be, say so."""
    try:
        machine = compiled_machine(fused)
    except SimulationError as error:
        say(f"{error.fact} The run is plain, some fifty times slower.")
        return None
    state.engine = "compiled"
    return machine


def _is_worth_compiling(fused: FusedModule, state: _Progress, spent: float) -> bool:
    """Hold the rest of a plain run against compiling; a run of unknown length is taken to be half done."""
    rest = spent * (state.expected / state.first - 1.0) if state.expected > state.first else spent
    worth = rest / (_WORTH_IF_OFTEN if state.hints.often else _WORTH)
    return worth > wiring_time(fused) and worth > compile_time(fused)


def _one_block(plan: Plan, module: Any, live: RunArrays, state: _Progress, count: int, noise: FloatArray) -> tuple[int, FloatArray, bool]:
    compiled = state.engine == "compiled"
    size = count * len(plan.channels)
    if len(state.scratch) < size:
        state.scratch = np.empty(size)
    record = state.scratch[:size]
    record[:] = 0.0
    try:
        done = module.run_block(state.first, count, *plan.assembly.timing, *live.in_order, noise if compiled else noise.tolist(), record)
    except (ArithmeticError, ValueError, TypeError, IndexError, struct.error):
        return count, record.reshape(count, -1).T, True
    state.finished, done = done < 0, abs(done)
    return done, record.reshape(count, -1)[:done].T, False


def _record(plan: Plan, values: FloatArray, state: _Progress, seed: int, wall_time: float) -> Record:
    period = plan.assembly.sample_period
    channels = {name: plan.channel(name, row) for name, row in zip(plan.channels, values, strict=True)}
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
