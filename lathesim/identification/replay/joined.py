"""Several recordings of one machine, fitted together.

Each is simulated by itself, from a start of its own, and their samples stand one behind the other as those of one recording. The few
samples where one ends and the next one begins do not count. One recording alone may leave a mixture of values open that two determine: a
steady speed shows a sum of dry and viscous friction, and a second speed parts them.
Source: L. Ljung, System Identification, 2nd ed., section 14.3 (merging data sets).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.engine.wiring import Plan
from lathesim.identification.records import Free
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.replay.simulator import Simulator
from lathesim.record import Record


@dataclass(frozen=True, eq=False)
class JoinedSimulator(Simulator):
    """Simulators of one machine, one for each recording; ``begun`` says where the states of each start, by their names in all of them.

    A state that starts anew is free under a name of its own: the first recording has the machine's name for it.
    """

    parts: tuple[Simulator, ...] = ()
    begun: tuple[Mapping[str, float], ...] = ()

    @property
    def starts(self) -> tuple[str, ...]:
        """The states of the machine, and those with which the other recordings start."""
        return (*self.plan.states, *(name for begun in self.begun[1:] for name in begun))

    def settable(self, names: Iterable[str]) -> list[str]:
        """Return those of some names that this machine has, or with which a recording of it starts, each once."""
        own = {name for begun in self.begun for name in begun}
        return [name for name in dict.fromkeys(names) if name in own or self.parts[0].settable([name])]

    def given(self, name: str) -> float:
        """Return the value that the machine has for a parameter or a starting state, or a recording of it starts with."""
        starts = {state: start for begun in self.begun[1:] for state, start in begun.items()}
        return starts[name] if name in starts else super().given(name)

    @cached_property
    def seen(self) -> FloatArray:
        """What was recorded, as the residual takes it: each recording has zeros of its own."""
        return np.concatenate([part.seen for part in self.parts], axis=1)

    @cached_property
    def seen_spread(self) -> FloatArray:
        """The standard deviation of :attr:`seen` about the mean of each recording, (channels,): where one begins is no motion of it."""
        return np.asarray(np.sqrt(np.mean([part.seen_spread**2 for part in self.parts], axis=0)))

    def channel(self, names: Sequence[str], values: Sequence[float], position: int) -> FloatArray:
        """Return one recorded output of the plan by its position, shape (samples,)."""
        each = self._of_each(names, np.array([values], dtype=float))
        return np.concatenate([part.channel(own, rows[0].tolist(), position) for part, own, rows in each])

    def _of_each(self, names: Sequence[str], values: FloatArray) -> Iterator[tuple[Simulator, list[str], FloatArray]]:
        """Yield each recording's simulator with the machine's names, and their values (rows, names) there."""
        shared = [place for place, name in enumerate(names) if self.parts[0].settable([name]) and name not in self.begun[0]]
        for part, begun in zip(self.parts, self.begun, strict=True):
            starts = [values[:, names.index(name)] if name in names else np.full(len(values), start) for name, start in begun.items()]
            yield part, [*(names[place] for place in shared), *self.begun[0]], np.column_stack([values[:, shared], *starts])

    def _each(
        self, names: Sequence[str], values: FloatArray, reduce: Callable[[FloatArray], Any], steps: int = 0, threads: int = 0
    ) -> list[Any]:
        outputs = [part._each(own, rows, np.array, steps, threads) for part, own, rows in self._of_each(names, values)]
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

    @cached_property
    def motion(self) -> dict[str, FloatArray]:
        """Where parts were and how fast in each recording: from one to the next they did not move."""
        return _in_each([part.motion for part in self.parts])

    @cached_property
    def unsmoothed(self) -> dict[str, FloatArray]:
        """The motion of parts from row to row of each recording."""
        return _in_each([part.unsmoothed for part in self.parts])

    def start_states(self, plan: Plan) -> list[Free]:
        """Return where each recording starts: its states as free values, those of all but the first under names of their own."""
        found = []
        for number, part in enumerate(self.parts, 1):
            found += [replace(one, name=_in_recording(one.name, number)) for one in part.start_states(plan)]
        return found

    @cached_property
    def begun(self) -> tuple[dict[str, float], ...]:
        """Where the states of each recording start, as it was recorded."""
        starts = [part.start_states(part.sensed.plan) for part in self.parts]
        return tuple({_in_recording(one.name, number): one.start for one in found} for number, found in enumerate(starts, 1))

    def started(self, values: Mapping[str, float]) -> list[dict[str, float]]:
        """Return where each recording starts among ``values`` of all, or as it was recorded: the machine's names of the states -> value."""
        return [{own: values.get(name, begun[name]) for own, name in zip(self.begun[0], begun, strict=True)} for begun in self.begun]

    @property
    def seams(self) -> list[int]:
        """The samples with which a recording behind another one begins."""
        return [int(end) for end in np.cumsum([len(part.record) for part in self.parts[:-1]])]

    def last_with(self, values: Mapping[str, float]) -> tuple[Experiment, Mapping[str, float]]:
        """Return the last of the recordings that this holds, and some values by name with those with which it begins."""
        return self.parts[-1], {**values, **self.started(values)[-1]}

    def _joined(self, parts: Sequence[Simulator]) -> Simulator:
        first = parts[0]
        return JoinedSimulator(
            first.plan, first.channels, np.concatenate([part.recorded for part in parts], axis=1),
            np.max([part.floors for part in parts], axis=0), first.redundant_sensors, self.weights, first.white, first.every,
            first.differenced, first.led, first.output_error, tuple(parts), self.begun,
        )  # fmt: skip


def _in_each(moved: Sequence[Mapping[str, FloatArray]]) -> dict[str, FloatArray]:
    return {name: np.concatenate([one[name] for one in moved]) for name in moved[0]}


def _in_recording(state: str, number: int) -> str:
    return state if number == 1 else f"{state} in recording {number}"


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
