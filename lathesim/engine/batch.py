"""``batch``: many parameter sets of one plan, on all cores, returning only what is asked for.

Every member runs the same compiled module; the runs release the GIL, so threads share the cores without copies of anything but the arrays
a run changes. Memory is one scratch record a thread, whatever the number of members, plus what ``reduce`` gives for each.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.engine.fuse import fuse
from lathesim.engine.module_cache import compiled_module
from lathesim.engine.noise import draw_noise
from lathesim.engine.run_arrays import RunArrays, start_arrays
from lathesim.engine.stability import check_step
from lathesim.engine.wiring import Plan

Reduce = Callable[[FloatArray], Any]


@dataclass(frozen=True)
class Batch:
    """A plan made ready for many runs of the same number of samples.

    ``run`` takes names (``part.parameter`` or ``part.state``) and values of shape (members, names) in SI and gives one result a member:
    what ``reduce`` makes of the recorded values, shape (channels, samples), in the order of ``plan.channels``. A run that ends early, or
    whose numbers grow beyond all bounds, is filled with NaN. With ``noisy`` off every ``Noise`` is zero: the expected run. ``reduce`` must
    not keep the array it is given; it is used again.
    """

    plan: Plan
    samples: int
    seed: int = 0
    threads: int = 0
    noisy: bool = True

    def run(self, names: Sequence[str], values: FloatArray, reduce: Reduce = np.copy) -> list[Any]:
        """Run all members and give their results in order."""
        plan = self.plan
        members = np.atleast_2d(np.asarray(values, dtype=float))
        positions = [plan.settable(name) for name in names]
        base = start_arrays(plan)
        module = compiled_module(fuse_once(plan))
        noise = draw_noise(plan.noises, self.seed, 0, self.samples)
        if not self.noisy:
            noise[:] = 0.0
        scratch = threading.local()
        assembly = plan.assembly

        def one(row: FloatArray) -> Any:
            if not hasattr(scratch, "record"):
                scratch.record = np.zeros((max(1, len(plan.channels)), self.samples))
            record = scratch.record
            live = _member(base, positions, row)
            done, _ = module.run_block(
                0, self.samples, assembly.sample_period, assembly.step, plan.steps_per_sample, live.parameters, live.states, live.discrete,
                live.memories, live.tables, noise, record,
            )  # fmt: skip
            record[:, done:] = np.nan
            return reduce(record[: len(plan.channels)])

        threads = self.threads or os.cpu_count() or 1
        if threads == 1 or len(members) == 1:
            return [one(row) for row in members]
        with ThreadPoolExecutor(threads) as pool:
            return list(pool.map(one, members))

    def check_step(self, overrides: Mapping[str, float] | None = None) -> None:
        """Refuse a step that is too long for these values (:class:`WiringError`)."""
        check_step(self.plan, start_arrays(self.plan, overrides))


_FUSED: dict[int, Any] = {}


def fuse_once(plan: Plan) -> Any:
    """Give the fused module of a plan, made once for each plan object."""
    key = id(plan)
    if key not in _FUSED or _FUSED[key][0] is not plan:
        if len(_FUSED) > 64:
            _FUSED.clear()
        _FUSED[key] = (plan, fuse(plan))
    return _FUSED[key][1]


def _member(base: RunArrays, positions: Sequence[tuple[str, int]], row: FloatArray) -> RunArrays:
    live = RunArrays(
        base.parameters.copy(), base.states.copy(), base.discrete.copy(), tuple(item.copy() for item in base.memories), base.tables
    )
    arrays = {"parameter": live.parameters, "state": live.states, "discrete": live.discrete}
    for (kind, position), value in zip(positions, row, strict=True):
        arrays[kind][position] = value
    return live
