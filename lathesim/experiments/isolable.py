"""``isolable``: a lesson, before anything is recorded, to what a recording of it could tell with these sensors, this rate and this program.

The lesson is run with its sensors, their noise and their steps, and the run stands for the recording. A recording of the machine as it is
gives the command in the place of a program, and what the lesson leaves of it gives the noise in the place of that of its sensors.
"""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.component import Input, Output
from lathesim.diagnosis.candidates.eligibility import without_one_sided
from lathesim.diagnosis.explaining.study import Study
from lathesim.diagnosis.isolation.answerable import Isolation, isolated
from lathesim.diagnosis.isolation.apart import FittedRival
from lathesim.diagnosis.isolation.visible import Looking
from lathesim.diagnosis.method import STANDARD
from lathesim.diagnosis.reporting.isolation_report import as_json, isolation_lines
from lathesim.diagnosis.verdict import recordable, simulated
from lathesim.engine.assembly import Assembly, FloatArray, Place
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import wire
from lathesim.errors import LatheSimError, LessonError, nearest
from lathesim.experiments.candidate_programs import lay_what_fits, walking_time
from lathesim.experiments.discrimination import Ablation, worths
from lathesim.experiments.families import candidates
from lathesim.experiments.rivals import NamedRival, place_rivals
from lathesim.experiments.room import room_of
from lathesim.experiments.scene import Scene
from lathesim.identification.estimation.least_squares import fit
from lathesim.identification.execution import Progress
from lathesim.identification.replay.controller_rate import decisions_for_each
from lathesim.identification.replay.experiment import RecordedMachine, baseline_free, build_experiments
from lathesim.identification.replay.loading import at_period, coarser_than_decided, load_case, uncertainties
from lathesim.identification.roles import readings_of
from lathesim.identification.signal import channel_floor, root_mean_square
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared, prepare, run_prepared
from lathesim.plugins import Registry
from lathesim.record import Channel, Record
from lathesim.recordings.raw_table import ENOUGH_SAMPLES, too_short

_LONGEST, _PROGRAMS = 10.0, 12
"""How long a program may be recorded that would tell effects apart [s], and how many are tried."""
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


@dataclass(frozen=True)
class SensorThatTells:
    """A channel that is not recorded, and the pairs of effects (rows of the matrix) that it tells apart."""

    channel: str
    pairs: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class ProgramThatTells:
    """A part program, how long it is recorded [s], and the pairs of effects (rows of the matrix) whose run is expected to decide."""

    title: str
    seconds: float
    pairs: tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class Isolable:
    """What a recording of a lesson could tell, of which sensors, how often and how long [Hz, s]; ``notes`` say what was assumed."""

    lesson: Lesson
    found: Isolation
    sensors: tuple[str, ...]
    rate: float
    seconds: float
    notes: tuple[str, ...]
    sensors_that_tell: tuple[SensorThatTells, ...] = ()
    program_that_tells: ProgramThatTells | None = None
    wall_time: float = 0.0

    def as_json(self) -> dict[str, Any]:
        """Return what was asked and what was found for programs."""
        asked = {"lesson": self.lesson.name, "sensors": self.sensors, "rate_hz": self.rate, "seconds": self.seconds, "notes": self.notes}
        told: dict[str, Any] = {
            "sensors_that_tell": [_remedy(one.pairs, self.found, channel=one.channel) for one in self.sensors_that_tell]
        }
        program = self.program_that_tells
        told |= {"program_that_tells": program and _remedy(program.pairs, self.found, title=program.title, seconds=program.seconds)}
        return {**asked, **as_json(self.found), **told, "wall_time_s": self.wall_time}

    def lines(self) -> Iterator[str]:
        """Yield what was asked and what was found as a person reads it at a terminal."""
        yield f"{self.lesson.title}: {', '.join(self.sensors)}, {self.rate:g} rows a second for {self.seconds:.3g} s."
        yield from self.notes
        yield ""
        yield from isolation_lines(self.found)
        yield ""
        for one in self.sensors_that_tell:
            yield f"Record {one.channel} too, and {_in_words(one.pairs, self.found)}."
        if program := self.program_that_tells:
            yield f"Run {program.title} for {program.seconds:.1f} s, and {_in_words(program.pairs, self.found)}."
            yield "'lathesim experiment LESSON --between A@part,B@part' writes such a program."
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
    sensors: tuple[SensorThatTells, ...] = ()
    program = None
    if found.pairs:
        tell("looking for a sensor and a program that would tell")
        sensors = _sensors_that_tell(looking, found)
        program = _program_that_tells(prepare(lesson, registry, variant), looking, found, registry)
    period = machine.assembly.sample_period
    seconds, spent = period * len(experiment.record), clock.perf_counter() - began
    return Isolable(lesson, found, machine.compare, 1.0 / period, seconds, notes, sensors, program, spent)


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
    return Looking.at(Study(experiment, experiment, STANDARD, tell), fitted), notes


def _recorded(prepared: Prepared, registry: Registry, means: Means, variant: str | None) -> tuple[RecordedMachine, Record, tuple[str, ...]]:
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
    if prepared.duration is None and not assembly.finish:
        fact = "nothing says how this machine is moved: a recording drives it, and none is given."
        raise LessonError(fact, place=lesson.name, remedy="Give one of the machine as it is: 'lathesim isolable LESSON RECORDING'.")
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
    return (
        RecordedMachine(at_period(assembly, period), tuple(driven), sensors, uncertain, resolution, decisions=decisions),
        record,
        tuple(notes),
    )


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
    """Return the inputs that a recording would give, with what feeds them: driven by the lesson, else fed by an interpolator."""
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


def _along(machine: RecordedMachine, record: Record, sensors: Sequence[str]) -> Record:
    """Return what sensors would read of the lesson's own machine where it is driven as it was in a recording."""
    plan = wire(replace(machine.driven_by(machine.assembly, record), record=tuple(sensors), finish=""))
    (made,) = Batch(plan, len(record)).run([], np.zeros((1, 0)))
    channels = {name: Channel(name, plan.unit(name), values) for name, values in zip(sensors, made, strict=True)}
    return replace(record, channels={**record.channels, **channels})


def _remedy(pairs: Sequence[tuple[int, int]], found: Isolation, **what: Any) -> dict[str, Any]:
    return {**what, "tells": [[found.effects[row].name for row in pair] for pair in pairs]}


def _in_words(pairs: Sequence[tuple[int, int]], found: Isolation) -> str:
    names = [" from ".join(found.effects[row].name for row in pair) for pair in pairs]
    return f"{len(names)} of {len(found.pairs)} pairs can be told apart: {', '.join(names)}"


def _sensors_that_tell(looking: Looking, found: Isolation) -> tuple[SensorThatTells, ...]:
    """Return the channels, the easiest to log first, that tell pairs apart which no channel before them tells.

    The lesson's own simulation has one effect or the other: they are told where the channel differs between them by more than a little of
    what the first does there, and by more than rounding.
    """
    experiment, method = looking.study.estimation, looking.study.method
    channels = recordable(experiment)
    ties = {(row, column): rival for row, column, rival in _ties(found)}
    if not channels or not ties:
        return ()
    values: list[Mapping[str, float]] = [looking.fitted.by_name]
    for (row, _), rival in ties.items():
        change = found.changes[row]
        assert change is not None
        truth = dict(zip(change.candidate.parameters, change.values.tolist(), strict=True))
        values += [{**looking.fitted.by_name, **truth}, rival.values]
    sound, *runs = simulated(experiment, channels, values)
    told: dict[tuple[int, int], FloatArray] = {}
    for pair, one, other in zip(ties, runs[::2], runs[1::2], strict=True):
        apart, does = (np.array([root_mean_square(line) for line in lines]) for lines in (one - other, one - sound))
        least = np.array([channel_floor(line) for line in sound])
        told[_once(pair)] = told.get(_once(pair), np.ones(len(channels), dtype=bool)) & (apart > np.maximum(method.little * does, least))
    left, found_channels = list(told), []
    for place, channel in enumerate(channels):
        if pairs := tuple(pair for pair in left if told[pair][place]):
            found_channels.append(SensorThatTells(channel, pairs))
            left = [pair for pair in left if pair not in pairs]
    return tuple(found_channels)


def _once(pair: tuple[int, int]) -> tuple[int, int]:
    return (min(pair), max(pair))


def _ties(found: Isolation) -> Iterator[tuple[int, int, FittedRival]]:
    """Yield the rows and columns of the matrix that are tied, with the rival that was fitted."""
    places = {change.candidate.part: row for row, change in enumerate(found.changes) if change is not None}
    for row, rivals in enumerate(found.rivals):
        yield from ((row, places[one.candidate.part], one) for one in rivals if one.is_tied and one.candidate.part in places)


def _program_that_tells(prepared: Prepared, looking: Looking, found: Isolation, registry: Registry) -> ProgramThatTells | None:
    """Return the program that is expected to decide most of the tied pairs, of those that decide as many the shortest; none where no
    program moves the machine, or none decides any.

    The candidates are those of a design of experiments, and so is what they are worth (:mod:`lathesim.experiments.discrimination`).
    """
    rows = sorted({row for row, _, _ in _ties(found)} | {column for _, column, _ in _ties(found)})
    pairs = list(dict.fromkeys(_once((row, column)) for row, column, _ in _ties(found)))
    machine, changes = looking.study.estimation.machine, [found.changes[row] for row in rows]
    named = [
        NamedRival(one.candidate.name, one.candidate.at, {name: (value, value) for name, value in one.by_name.items()})
        for one in changes
        if one is not None
    ]
    try:
        room = room_of(prepared)
        assembly, rivals = place_rivals(named, prepared.machinery, machine.compare, registry, 1, 0, "--sensors")
    except LatheSimError:
        return None
    laid = lay_what_fits(candidates(room, walking_time(_LONGEST), _PROGRAMS, 0), room, _LONGEST)
    if not laid or len(named) != len(rows):
        return None
    scene = Scene(assembly, rivals, machine.compare, dict(machine.uncertain), room, dict(machine.resolution), 1.1 * _LONGEST + 1.0)
    floors = np.max([scene.floors(program) for program in laid], axis=0)
    best: ProgramThatTells | None = None
    for program, worth in zip(laid, worths(scene, laid, floors, 1, Ablation()), strict=True):
        told = tuple(pair for pair in pairs if worth.decided_pair(rows.index(pair[0]), rows.index(pair[1])) > STANDARD.larger_part)
        if told and (best is None or (-len(told), program.seconds) < (-len(best.pairs), best.seconds)):
            best = ProgramThatTells(program.candidate.title, program.seconds, told)
    return best
