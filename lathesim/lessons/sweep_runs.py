"""The runs of a sweep: one compiled machine, run with other values in groups, each run measured at once and then forgotten."""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import lathesim
from lathesim.analysis.metric import Measurements, measure
from lathesim.component import ON
from lathesim.engine.assembly import FloatArray
from lathesim.engine.batch import Batch
from lathesim.engine.failure import check_step
from lathesim.engine.fuse import fuse
from lathesim.engine.run_arrays import start_arrays
from lathesim.errors import LatheSimError
from lathesim.lessons.alarms import AlarmWatch
from lathesim.lessons.simulate import Prepared
from lathesim.record import Channel, Record

Job = tuple[int, tuple[float, ...]]
"""Number and values [SI] of a run."""

MARGIN = 1.5
"""Times the expected length for which room is made at first; a run that is longer is made again with more."""
LONGEST = 16.0
"""Times the first room at which a run that has not come to its end is given up."""


@dataclass(frozen=True)
class Member:
    """What one run of a sweep gave: its number, the metrics in the order asked for (NaN where there is none), and how it ended."""

    number: int
    metrics: tuple[float, ...]
    status: str


@dataclass(frozen=True)
class Members:
    """A prepared case and the metrics that each run is measured by; ``names`` are the parameters and states that are varied."""

    prepared: Prepared
    names: tuple[str, ...]
    metrics: Mapping[str, Any]

    @functools.cached_property
    def samples(self) -> int:
        """Room for one run, in samples."""
        period = self.prepared.plan.assembly.sample_period
        if self.prepared.duration is not None:
            return round(self.prepared.duration / period) + 1
        return math.ceil(MARGIN * (self.prepared.expected_time or 60.0) / period) + 2

    @property
    def bytes_a_run(self) -> int:
        """Memory of a run while it goes on."""
        return 8 * self.samples * (len(self.prepared.plan.channels) + len(self.prepared.plan.arrays.noises))

    def compile(self) -> None:
        """Make the compiled machine ready, so that the first run is as quick as the others."""
        Batch(self.prepared.plan, 1, self.prepared.case.seed, threads=1).run((), np.zeros((1, 0)), lambda values: None)

    def run(self, number: int, values: Sequence[float]) -> Member:
        """Run with other values [SI] and measure."""
        found: list[Member] = []
        self.runs([(number, tuple(values))], found.append)
        return found[0]

    def runs(self, jobs: Sequence[Job], ended: Callable[[Member], None]) -> None:
        """Make a group of runs on one core, side by side where that is quicker, and hand each member over as soon as it is measured."""
        left, samples = list(jobs), self.samples
        longest = samples * (1.0 if self.prepared.duration is not None else LONGEST)
        while left := self._longer(left, samples, ended):
            if samples >= longest:
                why = f"no end after {samples * self.prepared.plan.assembly.sample_period:.4g} s"
                for number, _ in left:
                    ended(self._without(number, why))
                return
            samples *= 2

    def _longer(self, jobs: Sequence[Job], samples: int, ended: Callable[[Member], None]) -> list[Job]:
        """Make runs of at most so many samples; return those that need more room."""
        plan, good, longer = self.prepared.plan, list[Job](), list[Job]()
        for job in jobs:
            try:
                arrays = start_arrays(plan, self._overrides(job), samples * plan.assembly.sample_period)
                key = tuple(job[1][place] for place in self._in_rates)
                if key not in self._good_steps:
                    check_step(plan, arrays)
                    self._good_steps.add(key)
            except LatheSimError as error:
                ended(self._without(job[0], f"refused: {error}"))
            else:
                good.append(job)
        turns = iter(good)  # a batch of one thread reduces its members in order

        def take(values: FloatArray) -> None:
            job = next(turns)
            measured = self._measured(job, values)
            if measured is None:
                longer.append(job)
            else:
                ended(measured)

        if good:
            Batch(plan, samples, self.prepared.case.seed, threads=1).run(self.names, np.array([values for _, values in good]), take)
        return longer

    def _overrides(self, job: Job) -> dict[str, float]:
        return dict(zip(self.names, job[1], strict=True))

    def _without(self, number: int, why: str) -> Member:
        """Return the member of a run that gave no metrics."""
        return Member(number, (math.nan,) * len(self.metrics), why)

    @functools.cached_property
    def _in_rates(self) -> list[int]:
        """Places of the names that the rates of the states depend on: a step is good or not by these alone."""
        plan = self.prepared.plan
        laws = [(part, law) for part in plan.parts.values() for law in part.component.laws if law != "update"]
        read = {f"{part.name}.{item}" for part, law in laws for item in part.component.arguments[law]}
        read |= {plan.feeds[name][1] for name in read if name in plan.feeds}
        return [place for place, name in enumerate(self.names) if name in read or name not in plan.parameters]

    @functools.cached_property
    def _good_steps(self) -> set[tuple[float, ...]]:
        return set()

    @functools.cached_property
    def _alarms(self) -> tuple[list[int], FloatArray, FloatArray]:
        """Rows of the channels that are watched, and their least and largest values, shape (channels, 1)."""
        channels = self.prepared.plan.channels
        watched = [alarm for alarm in self.prepared.alarms if alarm.channel in channels]
        low, high = (np.array(ends)[:, None] for ends in ([alarm.low for alarm in watched], [alarm.high for alarm in watched]))
        return [channels.index(alarm.channel) for alarm in watched], low, high

    @functools.cached_property
    def _channels(self) -> list[Channel]:
        return [self.prepared.plan.channel(name, np.zeros(0)) for name in self.prepared.plan.channels]

    def _measured(self, job: Job, values: FloatArray) -> Member | None:
        """Measure the recorded ``values`` (channels, samples); none where the run needs more room."""
        plan, number = self.prepared.plan, job[0]
        count = _recorded(values)
        rows, low, high = self._alarms
        watched = values[rows, :count]
        if ((watched < low) | (watched > high)).any():
            alarm = AlarmWatch(plan, self.prepared.alarms, self._overrides(job)).look(0, values[:, :count])
            if alarm is not None:
                return self._without(number, f"stopped: {alarm[1]}")
        if not np.isfinite(values[:, :count]).all():
            at = int(np.argmin(np.isfinite(values[:, :count]).all(axis=0)))
            return self._without(number, f"broke down at t = {at * plan.assembly.sample_period:.4g} s")
        if self.prepared.duration is None and not self._finished(values, count):
            return None
        record = Record(
            np.arange(count, dtype=np.float64) * plan.assembly.sample_period,
            {head.name: Channel(head.name, head.unit, values[row, :count], roles=head.roles) for row, head in enumerate(self._channels)},
            {"sample_period": plan.assembly.sample_period, "status": "complete"},
        )
        found: Measurements = measure(record, self.metrics)
        reasons = [f"{name}: {reason}" for name, reason in found.skipped.items()]
        numbers = tuple(found.values[name].value if name in found.values else math.nan for name in self.metrics)
        return Member(number, numbers, "; ".join(reasons) or "complete")

    def _finished(self, values: FloatArray, count: int) -> bool:
        """Return whether the run came to its end: earlier than its room, or at just that sample."""
        plan = self.prepared.plan
        if count < values.shape[1]:
            return True
        finish = plan.assembly.finish
        return finish in plan.channels and bool(values[plan.channels.index(finish), count - 1] > ON)

    @functools.cached_property
    def digest(self) -> str:
        """The fingerprint of everything the numbers depend on: laws, values, path, noise, metrics, version."""
        plan = self.prepared.plan
        arrays = start_arrays(plan)
        text = hashlib.sha256()
        told: list[Any] = [lathesim.__version__, fuse(plan).digest, plan.channels, plan.assembly.sample_period, plan.assembly.step]
        told += [self.prepared.case.seed, self.prepared.duration, plan.assembly.steps_per_sample]
        told += [(name, metric.unit, metric.of_cutting, _source(metric.measure)) for name, metric in self.metrics.items()]
        text.update(json.dumps(told).encode())
        for array in (arrays.parameters, arrays.states, arrays.discrete, *arrays.memories, *arrays.tables):
            text.update(np.ascontiguousarray(array, dtype=float).tobytes())
        return text.hexdigest()[:16]


def _recorded(values: FloatArray) -> int:
    """Return how many samples of ``values`` (channels, samples) were recorded, at least one: all channels are NaN after the last."""
    first = np.flatnonzero(~np.isnan(values[0]))
    count = int(first[-1]) + 1 if len(first) else 0
    if not np.isnan(values[:, count:]).all():
        count = int(np.flatnonzero((~np.isnan(values)).any(axis=0))[-1]) + 1
    return max(count, 1)


def _source(function: Any) -> str:
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return ""
