"""``batch``: many parameter sets of one plan, on all cores, returning only what is asked for.

Every member runs the same compiled module; the runs release the GIL, so threads share the cores without copies of anything but the arrays
a run changes. Memory is one scratch record a thread, whatever the number of members, plus what ``reduce`` gives for each.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.engine.compiling.module_cache import compiled_machine
from lathesim.engine.fusing.fuse import fuse
from lathesim.engine.running.noise import draw_noise
from lathesim.engine.running.run_arrays import RunArrays, start_arrays, start_memories
from lathesim.engine.running.stability import check_step
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
    ) -> list[Any]:
        """Run all members and give their results in order.

        ``tables`` gives ``part.table`` another array for each member, as the paths of many part programs; ``lengths`` how many samples
        each is run: what comes after is NaN.
        """
        plan = self.plan
        members = np.atleast_2d(np.asarray(values, dtype=float))
        positions = [plan.settable(name) for name in names]
        base = start_arrays(plan)
        duration = self.samples * plan.assembly.sample_period
        with _MAKING:
            module = compiled_machine(fuse(plan))
        noise = draw_noise(plan.noises, self.seed, 0, self.samples)
        if not self.noisy:
            noise[:] = 0.0
        period = plan.assembly.sample_period
        steps = self.steps_per_sample or plan.steps_per_sample
        step = period / steps if self.steps_per_sample else plan.assembly.step
        places = {list(plan.tables).index(name): given for name, given in (tables or {}).items()}
        results: list[Any] = [None] * len(members)
        turns = iter(range(len(members)))

        def work() -> None:
            """Take member after member until none is left, with one scratch record for all."""
            record = np.zeros((self.samples, len(plan.channels)))
            for turn in turns:
                live = _member(plan, base, positions, members[turn], duration)
                count = self.samples if lengths is None else min(self.samples, lengths[turn])
                own = tuple(
                    np.ascontiguousarray(places[place][turn], dtype=float) if place in places else table
                    for place, table in enumerate(live.tables)
                )
                done = module.run_block(
                    0, count, period, step, steps, live.parameters, live.states, live.discrete, live.memories, own, noise,
                    record.reshape(-1),
                )  # fmt: skip
                record[abs(done) :] = np.nan
                results[turn] = reduce(record.T)

        threads = min(self.threads or os.cpu_count() or 1, len(members))
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


def _member(plan: Plan, base: RunArrays, positions: Sequence[tuple[str, int]], row: FloatArray, duration: float) -> RunArrays:
    live = RunArrays(base.parameters.copy(), base.states.copy(), base.discrete.copy(), base.memories, base.tables)
    arrays = {"parameter": live.parameters, "state": live.states, "discrete": live.discrete}
    for (kind, position), value in zip(positions, row, strict=True):
        arrays[kind][position] = value
    live.memories = start_memories(plan, live.parameters, duration)
    return live
