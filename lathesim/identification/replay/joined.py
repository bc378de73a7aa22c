"""Several recordings of one machine, fitted together.

Each is simulated by itself, from a start of its own, and their samples stand one behind the other as those of one recording. The few
samples where one ends and the next one begins do not count. One recording alone may leave a mixture of values open that two determine: a
steady speed shows a sum of dry and viscous friction, and a second speed parts them.
Source: L. Ljung, System Identification, 2nd ed., section 14.3 (merging data sets).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.simulator import Simulator
from lathesim.record import Record


@dataclass(frozen=True, eq=False)
class JoinedSimulator(Simulator):
    """Simulators of one machine, one for each recording; ``begun`` has the values with which all but the first begin."""

    parts: tuple[Simulator, ...] = ()
    begun: tuple[Mapping[str, float], ...] = ()

    @cached_property
    def seen(self) -> FloatArray:
        """What was recorded, as the residual takes it: each recording has zeros of its own."""
        return np.concatenate([part.seen for part in self.parts], axis=1)

    def channel(self, names: Sequence[str], values: Sequence[float], position: int) -> FloatArray:
        """Return one recorded output of the plan by its position, shape (samples,)."""
        return np.concatenate([part.channel(names, values, position) for part in self.parts])

    def _each(
        self, names: Sequence[str], values: FloatArray, reduce: Callable[[FloatArray], Any], steps: int = 0, threads: int = 0
    ) -> list[Any]:
        outputs = [self.parts[0]._each(names, values, np.array, steps, threads)]
        for part, begun in zip(self.parts[1:], self.begun, strict=True):
            own = [place for place, name in enumerate(names) if name not in begun]
            rows = np.hstack([values[:, own], np.tile(list(begun.values()), (len(values), 1))])
            outputs.append(part._each([*(names[place] for place in own), *begun], rows, np.array, steps, threads))
        return [reduce(np.concatenate(row, axis=1)) for row in zip(*outputs, strict=True)]


@dataclass(frozen=True)
class JoinedExperiment(Experiment):
    """Recordings of one machine as one; ``parts`` are their experiments."""

    parts: tuple[Experiment, ...] = ()

    @cached_property
    def sensed(self) -> Simulator:
        """Recorded inputs for every part, recorded motion for the effects."""
        return self._joined([part.sensed for part in self.parts])

    @cached_property
    def replayed(self) -> Simulator:
        """Recorded inputs for every part, simulated motion for the effects."""
        return self._joined([part.replayed for part in self.parts])

    @cached_property
    def own(self) -> Simulator:
        """The lesson's own simulation, with its own step and its own sensors."""
        return self._joined([part.own for part in self.parts])

    @property
    def begun(self) -> list[dict[str, float]]:
        """The values with which each recording begins as it was recorded; none of the first, whose start is fitted with the rest."""
        return [{}, *({item.name: item.start for item in one.start_states(one.sensed.plan)} for one in self.parts[1:])]

    def _joined(self, parts: Sequence[Simulator]) -> Simulator:
        first, begun = parts[0], self.begun[1:]
        return JoinedSimulator(
            first.plan, first.channels, np.concatenate([part.recorded for part in parts], axis=1),
            np.max([part.floors for part in parts], axis=0), self.name, first.redundant_sensors, self.weights, first.white, first.every,
            first.differenced, first.led, first.output_error, tuple(parts), tuple(begun),
        )  # fmt: skip


def joined(experiments: Sequence[Experiment]) -> JoinedExperiment:
    """Return experiments of one machine as one, weighed by the error of the simulation: no forces are alike in all of them."""
    parts = tuple(one.by_output_error() for one in experiments)
    first, name = parts[0], " and ".join(one.name for one in parts)
    weights = np.concatenate([_faded(len(one.record)) for one in parts])
    record = _one_behind_the_other([one.record for one in parts])
    return JoinedExperiment(
        first.machine, record, name, first.candidates, first.with_candidates, weights, one_sided=first.one_sided, parts=parts
    )


def _faded(samples: int) -> FloatArray:
    # it fades in and out over a hundredth each
    edge = max(2, samples // 100)
    ramp = np.minimum(np.arange(samples), edge) / edge
    return ramp * ramp[::-1]


def _one_behind_the_other(records: Sequence[Record]) -> Record:
    first = records[0]
    channels = {
        name: replace(channel, values=np.concatenate([one[name] for one in records]))
        for name, channel in first.channels.items()
        if all(name in one for one in records)
    }
    time = first.time[0] + first.sample_period * np.arange(sum(len(one) for one in records))
    return Record(time, channels, dict(first.meta))
