"""The runs of a sweep: one compiled machine, run with other values, each run measured at once and then forgotten."""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import lathesim
from lathesim.analysis.metrics.metric import Measurements, measure
from lathesim.engine.assembly import FloatArray
from lathesim.engine.fusing.fuse import fuse
from lathesim.engine.running.batch import Batch
from lathesim.engine.running.run_arrays import start_arrays
from lathesim.errors import LatheSimError
from lathesim.lessons.alarms import AlarmWatch
from lathesim.lessons.simulate import Prepared
from lathesim.record import Channel, Record

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
        return 8 * self.samples * (len(self.prepared.plan.channels) + len(self.prepared.plan.noises))

    def compile(self) -> None:
        """Make the compiled machine ready, so that the first run is as quick as the others."""
        plan = self.prepared.plan
        Batch(plan, 1, self.prepared.case.seed, threads=1).run((), np.zeros((1, 0)), lambda values: None)

    def run(self, number: int, values: Sequence[float]) -> Member:
        """Run with other values [SI] and measure."""
        plan = self.prepared.plan
        overrides = dict(zip(self.names, values, strict=True))
        samples, longest = self.samples, self.samples * (1.0 if self.prepared.duration is not None else LONGEST)
        try:
            Batch(plan, 1, threads=1).check_step(overrides)
            while True:
                batch = Batch(plan, samples, self.prepared.case.seed, threads=1)
                (measured,) = batch.run(self.names, np.array([list(values)]), functools.partial(self._measured, overrides))
                if measured is not None or samples >= longest:
                    break
                samples *= 2
        except LatheSimError as error:
            return Member(number, (math.nan,) * len(self.metrics), f"refused: {error}")
        if measured is None:
            return Member(number, (math.nan,) * len(self.metrics), f"no end after {samples * plan.assembly.sample_period:.4g} s")
        values_found, status = measured
        return Member(number, values_found, status)

    def _measured(self, overrides: Mapping[str, float], values: FloatArray) -> tuple[tuple[float, ...], str] | None:
        """Measure the recorded ``values`` (channels, samples); none where the run needs more room."""
        plan = self.prepared.plan
        recorded = np.flatnonzero((~np.isnan(values)).any(axis=0))
        count = int(recorded[-1]) + 1 if len(recorded) else 1
        broken = not np.isfinite(values[:, :count]).all()
        nothing = (math.nan,) * len(self.metrics)
        alarm = AlarmWatch(plan, self.prepared.alarms, overrides).look(0, values[:, :count])
        if alarm is not None:
            return nothing, f"stopped: {alarm[1]}"
        if broken:
            at = int(np.argmin(np.isfinite(values[:, :count]).all(axis=0)))
            return nothing, f"broke down at t = {at * plan.assembly.sample_period:.4g} s"
        if self.prepared.duration is None and not self._finished(values, count):
            return None
        record = Record(
            np.arange(count, dtype=np.float64) * plan.assembly.sample_period,
            {name: Channel(name, plan.unit(name), values[row, :count]) for row, name in enumerate(plan.channels)},
            {"sample_period": plan.assembly.sample_period, "status": "complete"},
        )
        found: Measurements = measure(record, self.metrics)
        reasons = [f"{name}: {reason}" for name, reason in found.skipped.items()]
        numbers = tuple(found.values[name].value if name in found.values else math.nan for name in self.metrics)
        return numbers, "; ".join(reasons) or "complete"

    def _finished(self, values: FloatArray, count: int) -> bool:
        """Return whether the run came to its end: earlier than its room, or at just that sample."""
        plan = self.prepared.plan
        if count < values.shape[1]:
            return True
        finish = plan.assembly.finish
        return finish in plan.channels and bool(values[plan.channels.index(finish), count - 1] > 0.5)

    @functools.cached_property
    def digest(self) -> str:
        """The fingerprint of everything the numbers depend on: laws, values, path, noise, metrics, version."""
        plan = self.prepared.plan
        arrays = start_arrays(plan)
        text = hashlib.sha256()
        told: list[Any] = [lathesim.__version__, fuse(plan).digest, plan.channels, plan.assembly.sample_period, plan.assembly.step]
        told += [self.prepared.case.seed, self.prepared.duration, plan.steps_per_sample]
        told += [(name, metric.unit, metric.of_cutting, _source(metric.measure)) for name, metric in self.metrics.items()]
        text.update(json.dumps(told).encode())
        for array in (arrays.parameters, arrays.states, arrays.discrete, *arrays.memories, *arrays.tables):
            text.update(np.ascontiguousarray(array, dtype=float).tobytes())
        return text.hexdigest()[:16]


def _source(function: Any) -> str:
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return ""
