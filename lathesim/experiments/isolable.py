"""``isolable``: a lesson, before anything is recorded, to what a recording of it could tell with these sensors, this rate and this program.

The lesson is run with its sensors, their noise and their steps, and the run stands for the recording. A recording of the machine as it is
gives the command in the place of a program, and what the lesson leaves of it gives the noise in the place of that of its sensors.
"""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.component import Input, Output
from lathesim.diagnosis.candidates.eligibility import without_one_sided
from lathesim.diagnosis.explaining.plausible import with_possible_sizes
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.isolation.answerable import Isolation, isolated
from lathesim.diagnosis.isolation.visible import Looking
from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.reporting.isolation_report import as_json, isolation_lines
from lathesim.engine.assembly import Assembly, Place
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import wire
from lathesim.errors import LessonError, nearest
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution import Progress
from lathesim.identification.replay.controller_rate import decisions_for_each
from lathesim.identification.replay.experiment import Machine, baseline_free, build_experiments
from lathesim.identification.replay.loading import at_period, coarser_than_decided, load_case, uncertainties
from lathesim.identification.roles import readings_of
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared, prepare, run_prepared
from lathesim.plugins import Registry
from lathesim.record import Channel, Record
from lathesim.recordings.raw_table import ENOUGH_SAMPLES, too_short

_MOST_SAMPLES = 60_000
"""Samples of a run that are looked at: a few hundred runs of them fit the memory of an ordinary computer."""


@dataclass(frozen=True)
class Means:
    """With what is recorded: the sensors (empty: those of the lesson), rows a second (0: as the lesson says), another program, and a
    recording of the machine as it is; with ``effects`` (empty: all) only these are asked about."""

    sensors: tuple[str, ...] = ()
    rate: float = 0.0
    program: Path | None = None
    recording: Path | None = None
    effects: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Isolable:
    """What a recording of a lesson could tell, of which sensors, how often and how long [Hz, s]; ``notes`` say what was assumed."""

    lesson: Lesson
    looking: Looking
    found: Isolation
    sensors: tuple[str, ...]
    rate: float
    seconds: float
    notes: tuple[str, ...]
    wall_time: float = 0.0

    def as_json(self) -> dict[str, Any]:
        """Return what was asked and what was found for programs."""
        asked = {"lesson": self.lesson.name, "sensors": self.sensors, "rate_hz": self.rate, "seconds": self.seconds, "notes": self.notes}
        return {**asked, **as_json(self.found), "wall_time_s": self.wall_time}

    def lines(self) -> Iterator[str]:
        """Yield what was asked and what was found as a person reads it at a terminal."""
        yield f"{self.lesson.title}: {', '.join(self.sensors)}, {self.rate:g} rows a second for {self.seconds:.3g} s."
        yield from self.notes
        yield ""
        yield from isolation_lines(self.found)
        yield ""
        seen, pairs = sum(one.is_visible for one in self.found.effects), len(self.found.pairs)
        yield f"{seen} of {len(self.found.effects)} effects would be seen, {pairs} pairs could not be told apart. {self.wall_time:.1f} s."


def isolable(
    lesson: Lesson, registry: Registry, means: Means, variant: str | None = None, tell: Progress = lambda text: None
) -> Isolable:  # fmt: skip
    """Return what a recording of a lesson could tell.

    Raises :class:`LessonError` where the machine lacks a sensor that is named, or where nothing says how it is moved.
    """
    began = clock.perf_counter()
    looking, notes = looking_at(lesson, registry, means, variant, tell)
    experiment = looking.study.estimation
    tell(f"{len(experiment.candidates)} effects at their places, each for itself")
    found, machine = isolated(looking), experiment.machine
    period, spent = machine.assembly.sample_period, clock.perf_counter() - began
    return Isolable(lesson, looking, found, machine.compare, 1.0 / period, period * len(experiment.record), notes, spent)


def looking_at(
    lesson: Lesson, registry: Registry, means: Means, variant: str | None = None, tell: Progress = lambda text: None
) -> tuple[Looking, tuple[str, ...]]:
    """Return a recording of a lesson beside the lesson fitted to it, made or taken, and what was assumed of it."""
    tell("running the lesson")
    machine, record, notes = _recorded(prepare(lesson, registry, variant, program=means.program), registry, means, variant)
    effects: list[Any] = [registry.effect(name) for name in means.effects] or list(registry.effects.values())
    (experiment,) = without_one_sided(build_experiments(machine, [(lesson.name, record)], effects), method=STANDARD)
    tell("fitting the lesson to its own run")
    fitted = fit(experiment.sensed, [*baseline_free(machine), *experiment.start_states(experiment.sensed.plan)], rounds=3)
    return Looking.at(with_possible_sizes(Study(experiment, experiment, STANDARD, tell)), fitted), notes


def _recorded(prepared: Prepared, registry: Registry, means: Means, variant: str | None) -> tuple[Machine, Record, tuple[str, ...]]:
    """Return the machine of a lesson with a recording of it, made or taken, and what was assumed."""
    lesson, assembly = prepared.case.lesson, prepared.machinery
    sensors = means.sensors or _usual_sensors(lesson, assembly)
    _refuse_unknown(sensors, assembly)
    notes = [] if lesson.settings.uncertain else ["The lesson calls none of its values uncertain: they are taken for exact."]
    if means.recording is not None:
        case = load_case(lesson, [means.recording], registry, variant=variant)
        machine, record = replace(case.machine, compare=sensors), case.recordings[0].record
        if set(sensors) <= set(record.channels):
            return machine, record, (*notes, f"What the lesson leaves of {means.recording.name} is taken for noise.")
        return machine, _along(machine, record, sensors), tuple(notes)
    driven = _driven(lesson, assembly)
    made = run_prepared(replace(prepared, plan=wire(replace(assembly, record=tuple(dict.fromkeys((*sensors, *driven.values())))))))
    every = _every(lesson, assembly, means)
    if len(made.time) > every * _MOST_SAMPLES:
        notes.append(f"Only the first {every * _MOST_SAMPLES * assembly.sample_period:g} s of the run are looked at.")
    rows = slice(0, every * _MOST_SAMPLES, every)
    columns = {name: made.channel(name) for name in sensors} | {name: made.channel(output) for name, output in driven.items()}
    record = Record(made.time[rows], {name: replace(one, name=name, values=one.values[rows]) for name, one in columns.items()})
    if len(record) < ENOUGH_SAMPLES:
        raise too_short(lesson.name, len(record), f", and {ENOUGH_SAMPLES} are needed", (), "Record longer, or more often.")
    period = every * assembly.sample_period
    notes += [str(finding) for finding in coarser_than_decided(period, assembly, sensors)]
    uncertain = uncertainties(lesson, prepared.plan) if lesson.settings.uncertain else {}
    mapped = mapping_of(lesson, assembly).signals if lesson.settings.recordings is not None else ()
    resolution = {signal.target: signal.resolution for signal in mapped if signal.resolution}
    decisions = decisions_for_each(period, assembly)
    return Machine(at_period(assembly, period), tuple(driven), sensors, uncertain, resolution, decisions=decisions), record, tuple(notes)


def _usual_sensors(lesson: Lesson, assembly: Assembly) -> tuple[str, ...]:
    """Return the channels that the lesson compares, else every reading of a sensor."""
    if lesson.settings.recordings is not None:
        return mapping_of(lesson, assembly).targets("compare")
    sensors = [part for part in assembly.parts if "measured" in part.component.ports]
    found = tuple(f"{part.name}.{port}" for part in sensors for port in readings_of(part.component))
    if not found:
        fact = "the machine has no sensor, and the lesson says nothing of recordings."
        raise LessonError(fact, place=str(lesson.path), remedy="Name outputs of the machine with --sensors.")
    return found


def _refuse_unknown(sensors: Sequence[str], assembly: Assembly) -> None:
    outputs = [f"{part.name}.{name}" for part in assembly.parts for name in part.component.declared(Output)]
    for name in sensors:
        if name not in outputs:
            raise LessonError(f"the machine has no output '{name}'.", place="--sensors", remedy=nearest(name, outputs))


def _driven(lesson: Lesson, assembly: Assembly) -> dict[str, str]:
    """Return the inputs that a recording would give, with the outputs that feed them: those that the lesson drives, else what an
    interpolator feeds."""
    walking = {part.name for part in assembly.parts if "path" in part.tables}
    names = lesson.settings.recordings.drive if lesson.settings.recordings is not None else {}
    if names:
        return {name: source for name in names if (source := assembly.sources.get(name, ""))}
    inputs = [f"{part.name}.{name}" for part in assembly.parts if part.name not in walking for name in part.component.declared(Input)]
    return {name: source for name in inputs if Place.of(source := assembly.sources.get(name, "")).part in walking}


def _every(lesson: Lesson, assembly: Assembly, means: Means) -> int:
    """Return how many samples of the machine there are for each row."""
    mapped = mapping_of(lesson, assembly).rate if lesson.settings.recordings is not None else None
    rate = means.rate or mapped or 1.0 / assembly.sample_period
    return max(1, round(1.0 / (rate * assembly.sample_period)))


def _along(machine: Machine, record: Record, sensors: Sequence[str]) -> Record:
    """Return what sensors would read of the lesson's own machine where it is driven as it was in a recording."""
    assembly = machine.driven_by(machine.assembly, record)
    plan = wire(replace(assembly, record=tuple(sensors), finish=""))
    (made,) = Batch(plan, len(record)).run([], np.zeros((1, 0)))
    channels = {name: Channel(name, plan.unit(name), values) for name, values in zip(sensors, made, strict=True)}
    return replace(record, channels={**record.channels, **channels})
