"""``batch``: many parameter sets of one plan, on all cores, returning only what is asked for.

Every member runs the same compiled module; the runs release the GIL, so threads share the cores without copies of anything but the arrays
a run changes. Where it pays, a thread runs sixteen members side by side in lanes (see :mod:`lathesim.engine.lanes`), with the same
bits. Memory is one scratch record a thread, of one member or sixteen, whatever their number, plus what ``reduce`` gives for each.
"""

from __future__ import annotations

import itertools
import operator
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np

from lathesim.engine.assembly import FloatArray, Timing
from lathesim.engine.failure import check_step
from lathesim.engine.fuse import fuse
from lathesim.engine.lane_text import LANES
from lathesim.engine.lanes import LEAST, Choice, Lanes
from lathesim.engine.machine_code import CompiledMachine
from lathesim.engine.module_cache import compiled_machine
from lathesim.engine.run_arrays import RunArrays, draw_noise, start_arrays, start_memories
from lathesim.engine.wiring import Plan

Reduce = Callable[[FloatArray], Any]
_MAKING = Lock()
"""A machine is made once, however many threads ask for it; and Python's parser is not made for two of them."""


@dataclass(frozen=True)
class Batch:
    """A plan made ready for many runs of the same number of samples.

    ``run`` takes names (``part.parameter`` or ``part.state``) and values of shape (members, names) in SI and gives one result a member:
    what ``reduce`` makes of the recorded values, shape (channels, samples), in the order of ``plan.channels``. A run that ends early, or
    whose numbers grow beyond all bounds, is filled with NaN. With ``noisy`` off every ``Noise`` is zero: the expected run. ``reduce`` must
    not keep the array it is given; it is used again. One that gives a number makes the memory independent of how many members there are.
    ``steps_per_sample`` takes the place of the plan's, where fewer steps will do.

    A caller gets lanes by handing over many members in one call, with the same names each time: a call of one member runs it alone. Lanes
    are compiled once, for the names that vary, when the runs of the plan so far and ahead take longer than the compiler. Names that have
    the plan's value in every member cost nothing.
    """

    plan: Plan
    samples: int
    seed: int = 0
    threads: int = 0
    noisy: bool = True
    steps_per_sample: int = 0

    def run(
        self,
        names: Sequence[str],
        values: FloatArray,
        reduce: Reduce = np.copy,
        tables: Mapping[str, Sequence[FloatArray]] | None = None,
        lengths: Sequence[int] | None = None,
        seeds: Sequence[int] | None = None,
    ) -> list[Any]:
        """Run all members and give their results in order.

        ``tables`` gives ``part.table`` another array for each member, as the paths of many part programs; ``lengths`` how many samples
        each is run: what comes after is NaN; ``seeds`` the noise of each.
        """
        with _MAKING:
            module = compiled_machine(fuse(self.plan))
        members = _Members(self, names, np.atleast_2d(np.asarray(values, dtype=float)), tables or {}, lengths, seeds)
        count = len(members.values)
        results: list[Any] = [None] * count
        turns = iter(range(count))

        def work() -> None:
            for some, records in members.runs(module, turns):
                for turn, record in zip(some, records, strict=False):
                    results[turn] = reduce(record.T)

        threads = min(self.threads or os.cpu_count() or 1, count)
        if threads <= 1:
            work()
            return results
        with ThreadPoolExecutor(threads) as pool:
            tasks = [pool.submit(work) for _ in range(threads)]
            try:
                for task in tasks:
                    task.result()
            except BaseException:
                list(turns)  # leaves nothing for the other threads to begin
                raise
        return results

    def check_step(self, overrides: Mapping[str, float] | None = None) -> None:
        """Refuse a step that is too long for these values (:class:`WiringError`)."""
        check_step(self.plan, start_arrays(self.plan, overrides))


class _Members:
    """What each member of a batch runs with."""

    def __init__(
        self, batch: Batch, names: Sequence[str], values: FloatArray, tables: Mapping[str, Sequence[FloatArray]],
        lengths: Sequence[int] | None, seeds: Sequence[int] | None,
    ) -> None:  # fmt: skip
        self.batch, self.values, self.lengths, self.seeds = batch, values, lengths, seeds
        plan = self.plan = batch.plan
        self.positions = [plan.settable(name) for name in names]
        self.base = start_arrays(plan)
        self.tables = {list(plan.arrays.tables).index(name): given for name, given in tables.items()}
        self.noise = draw_noise(plan.arrays.noises, batch.seed, 0, batch.samples)
        if not batch.noisy:
            self.noise[:], self.seeds = 0.0, None
        period = plan.assembly.sample_period
        steps = batch.steps_per_sample or plan.assembly.steps_per_sample
        self.timing: Timing = (period, period / steps if batch.steps_per_sample else plan.assembly.step, steps)
        self.choice: Choice | None = None
        if len(values) >= LEAST:
            columns = {position: values[:, place] for place, (kind, position) in enumerate(self.positions) if kind == "parameter"}
            moved = [name for name, column in zip(names, values.T, strict=True) if np.any(column != plan.values[name])]
            varied = [*moved, *tables, *(() if self.seeds is None else plan.arrays.noises)]
            self.choice = Choice(plan, varied, self.base.parameters, columns)

    def runs(self, module: CompiledMachine, turns: Iterator[int]) -> Iterator[tuple[list[int], FloatArray]]:
        """Take turns until none is left and give their records, shape (some, samples, channels); sixteen at a time where that pays."""
        record = np.zeros((1, self.batch.samples, len(self.plan.channels)))
        choice, lanes = self.choice, None
        try:
            while ahead := operator.length_hint(turns):
                if choice is not None and (lanes is None or choice.refused) and _MAKING.acquire(blocking=False):
                    try:
                        lanes = choice.lanes(ahead, self.batch.samples)
                    finally:
                        _MAKING.release()
                side_by_side = lanes is not None and choice is not None and choice.pays(ahead)
                some = list(itertools.islice(turns, LANES if side_by_side else 1))
                if not some:  # another thread has taken the last
                    return
                begun = time.thread_time()
                records = self._together(lanes, some) if lanes is not None and side_by_side else self._alone(module, record, some[0])
                if choice is not None:
                    choice.spend(time.thread_time() - begun, len(some), side_by_side)
                yield some, records
        finally:
            if lanes is not None:
                lanes.end()

    def _alone(self, module: CompiledMachine, record: FloatArray, turn: int) -> FloatArray:
        live = self._arrays(turn)
        done = module.run_block(0, self._count(turn), *self.timing, *live.in_order, self._noise(turn), record.reshape(-1))
        record[0, abs(done) :] = np.nan
        return record

    def _together(self, lanes: Lanes, some: Sequence[int]) -> FloatArray:
        counts = [self._count(turn) for turn in some]
        arrays = [self._arrays(turn) for turn in some]
        records, advanced = lanes.run(arrays, max(counts), self.timing, [self._noise(turn) for turn in some])
        for record, done, count in zip(records, advanced, counts, strict=False):
            record[min(done, count) :] = np.nan
        return records

    def _count(self, turn: int) -> int:
        return self.batch.samples if self.lengths is None else min(self.batch.samples, self.lengths[turn])

    def _noise(self, turn: int) -> FloatArray:
        return self.noise if self.seeds is None else draw_noise(self.plan.arrays.noises, self.seeds[turn], 0, self.batch.samples)

    def _arrays(self, turn: int) -> RunArrays:
        live = RunArrays(self.base.parameters.copy(), self.base.states.copy(), self.base.discrete.copy(), (), self.base.tables)
        arrays = {"parameter": live.parameters, "state": live.states, "discrete": live.discrete}
        for (kind, position), value in zip(self.positions, self.values[turn], strict=True):
            arrays[kind][position] = value
        live.memories = start_memories(self.plan, live.parameters, self.batch.samples * self.plan.assembly.sample_period)
        live.tables = tuple(
            np.ascontiguousarray(self.tables[place][turn], dtype=float) if place in self.tables else table
            for place, table in enumerate(live.tables)
        )
        return live
