"""From a lesson and the files of its recordings to what a diagnosis works on, and to a lesson that a recording leads."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np

from lathesim.component import Output
from lathesim.engine.assembly import Assembly, Part, Place, of_part
from lathesim.engine.wiring import Plan, wire
from lathesim.errors import LessonError, RecordingError
from lathesim.identification.replay.controller_rate import clock_beside, decisions_for_each, dividing
from lathesim.identification.replay.experiment import RecordedMachine, build_experiments
from lathesim.identification.replay.measured_motion import velocity_of
from lathesim.identification.roles import closes_a_loop, is_led
from lathesim.identification.signal import grid_spacing, smallest_step
from lathesim.lessons.case import Given
from lathesim.lessons.insertion import Machinery
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import si_value
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry
from lathesim.record import Channel, Record
from lathesim.recordings.mapping import MappedRecording, RecordingMapping, map_recording
from lathesim.recordings.raw_table import ENOUGH_SAMPLES, MOST_COMPARED, MOST_STEPS, SHORTER, Finding, read_recording, too_short
from lathesim.recordings.recording_faults import recording_faults
from lathesim.recordings.sample_grid import row_noise
from lathesim.units import split_quantity

MOST_SAMPLES = 300_000
"""More samples than this, times a few hundred runs of a round of candidates, do not fit the memory of an ordinary computer."""
_RATES = ("reference", "reference_rate", "reference_acceleration")
"""Roles of the reference of a led part and of its derivatives."""
_COARSER = 1.5
"""Ratio of two sample periods above which the one is coarser."""
MORE = "Record longer, or more often; a file that was cut in two is given whole, and its second half judges."
"""The remedy where there are fewer."""


@dataclass(frozen=True)
class Recorded:
    """A recording on its sample grid: its file's name, its channels [SI] and what was found in it."""

    name: str
    record: Record
    findings: tuple[Finding, ...]

    @property
    def faults(self) -> tuple[Finding, ...]:
        """What makes the recording unfit to name physics from."""
        return tuple(finding for finding in self.findings if finding.serious)


@dataclass(frozen=True)
class LoadedCase:
    """A lesson's machine with the recordings held against it."""

    lesson: Lesson
    prepared: Prepared
    machine: RecordedMachine
    recordings: tuple[Recorded, ...]


def load_case(lesson: Lesson, files: list[Path], registry: Registry, *, variant: str | None = None) -> LoadedCase:
    """Load the recordings of a lesson; the first one is fitted, the second one judges.

    Raises :class:`LessonError` where the lesson does not say how the columns map to the machine, and :class:`RecordError` where a file
    cannot be read as it says.
    """
    prepared = prepare(lesson, registry, variant)
    mapping = mapping_of(lesson, prepared.machinery)
    recordings = []
    resolution: dict[str, float] = {}
    noise: dict[str, float] = {}
    for file in files:
        mapped = with_rates(read_mapped(file, registry, mapping, MOST_SAMPLES), prepared.machinery)
        found = [*mapped.findings, *recording_faults(mapped.record, mapping)]
        if len(mapped.record) < ENOUGH_SAMPLES:
            raise too_short(str(file), len(mapped.record), f", and {ENOUGH_SAMPLES} are needed", mapped.findings, MORE)
        if not any(finding.serious for finding in found):
            refuse_still(file, mapped.record, mapping.targets("compare"))
        _refuse_without_overlap(file, mapped, prepared)
        refuse_endless(file, mapped, prepared, mapping)
        found += coarser_than_decided(mapped.record.sample_period, prepared.machinery, mapping.targets("compare"))
        recordings.append(Recorded(file.name, mapped.record, tuple(found)))
        resolution |= mapped.resolution
        noise |= {name: max(size, noise.get(name, 0.0)) for name, size in noise_of_rows(mapped).items()}
    machine = _recorded_machine(prepared.machinery, mapping, [one.record for one in recordings])
    machine = replace(machine, uncertain=uncertainties(lesson, prepared.plan), resolution=resolution, noise=noise)
    return LoadedCase(lesson, prepared, machine, tuple(recordings))


def read_for(prepared: Prepared, file: Path, registry: Registry) -> tuple[RecordedMachine, Recorded]:
    """Return the machine of a prepared case and a recording of it; raises what :func:`load_case` raises, but asks for no uncertainties."""
    mapping = mapping_of(prepared.case.lesson, prepared.machinery)
    mapped = with_rates(read_mapped(file, registry, mapping, MOST_COMPARED), prepared.machinery)
    if len(mapped.record) < ENOUGH_SAMPLES:
        raise too_short(str(file), len(mapped.record), f", and {ENOUGH_SAMPLES} are needed", mapped.findings, MORE)
    _refuse_empty(file, mapped, mapping)
    refuse_endless(file, mapped, prepared, mapping)
    coarse = coarser_than_decided(mapped.record.sample_period, prepared.machinery, mapping.targets("compare"))
    findings = (*mapped.findings, *recording_faults(mapped.record, mapping), *coarse)
    machine = _recorded_machine(prepared.machinery, mapping, [mapped.record])
    machine = replace(machine, resolution=mapped.resolution, noise=noise_of_rows(mapped))
    return machine, Recorded(file.name, mapped.record, tuple(findings))


def _recorded_machine(assembly: Machinery, mapping: RecordingMapping, records: Sequence[Record]) -> RecordedMachine:
    """Return a machine that takes the inputs of the first recording and is sampled as the last one is, of which nothing is uncertain."""
    period = records[-1].sample_period
    between = {signal.target: signal.between for signal in mapping.signals}
    # what follows from the driven inputs, as a rate, is driven too
    driven = (*mapping.targets("drive"), *(name for name in records[0].channels if name not in between))
    return RecordedMachine(
        at_period(assembly, period), driven, mapping.targets("compare"), {}, {},
        decisions=decisions_for_each(period, assembly), clock=clock_beside(period, assembly), between=between,
    )  # fmt: skip


def read_mapped(file: Path, registry: Registry, mapping: RecordingMapping, most: int) -> MappedRecording:
    """Return a recording on its sample grid. Raises :class:`RecordingError` for more than ``most`` samples, if possible before reading."""
    mapped = map_recording(read_recording(file, registry.readers, most * mapping.mean_of), mapping)
    if len(mapped.record) > most:
        fact = f"the recording has {len(mapped.record):,} samples; at most {most:,} are accepted here.".replace(",", " ")
        raise RecordingError(fact, place=str(file), remedy=SHORTER)
    return mapped


def with_rates(mapped: MappedRecording, assembly: Assembly) -> MappedRecording:
    """Return a recording with the velocity and the acceleration that the recorded reference of a led part has, where the lesson leaves them
    at 0: derivatives of the smoothed reference [m/s, m/s^2]."""
    channels, findings = dict(mapped.record.channels), list(mapped.findings)
    wires = assembly.wired
    for part in (part for part in assembly.parts if is_led(part.component)):
        names = [f"{part.name}.{part.component.ports[role]}" for role in _RATES if role in part.component.ports]
        for place, rate in itertools.pairwise(names):
            given = rate in channels or (rate in wires and (wires[rate].source or wires[rate].constant))
            if place not in channels or given or not np.isfinite(channels[place].values).all():
                continue
            unit = part.component.declarations[Place.of(rate).port].unit
            channels[rate] = Channel(rate, unit, velocity_of(channels[place].values, mapped.record.sample_period))
            findings.append(Finding("derived", rate, "not recorded", f"taken as the derivative of {place}"))
    return replace(mapped, record=replace(mapped.record, channels=channels), findings=tuple(findings))


def noise_of_rows(mapped: MappedRecording) -> dict[str, float]:
    """Return what the rows of each compared channel cannot resolve [SI], where samples lie between rows; else nothing."""
    if mapped.marks is None:
        return {}
    steps = {name: smallest_step(known := values[np.isfinite(values)]) or grid_spacing(known) for name, values in mapped.taken.items()}
    return {name: max(steps[name] / math.sqrt(12.0), row_noise(mapped.marks, values)) for name, values in mapped.taken.items()}


def _refuse_empty(file: Path, mapped: MappedRecording, mapping: RecordingMapping) -> None:
    """Raise :class:`RecordingError` for a recording without values of a driven input or of the compared channels."""
    empty = {name for name in mapped.record.channels if not np.isfinite(mapped.record[name]).any()}
    for signal in mapping.signals:
        if signal.target in empty and (signal.role == "drive" or empty >= set(mapping.targets("compare"))):
            fact = f"column '{signal.column}' holds hardly any numbers, so {signal.target} is not known."
            raise RecordingError(fact, place=signal.place or str(file), remedy="Map another column, or give another recording.")


def _refuse_without_overlap(file: Path, mapped: MappedRecording, prepared: Prepared) -> None:
    """Refuse a recording whose clock begins after the part program of the lesson has ended."""
    begin = float(mapped.record.meta["original_start"])
    end = prepared.duration
    if prepared.case.program is not None and end is not None and begin >= end:
        fact = f"the recording begins at {begin:g} s, and the lesson's program has ended at {end:g} s: they do not overlap."
        raise RecordingError(fact, place=str(file), remedy="Shift the times of the recording, or drive the reference with a recorded one.")


def refuse_endless(file: Path, mapped: MappedRecording, prepared: Prepared, mapping: RecordingMapping) -> None:
    """Refuse a recording that lasts more steps of the lesson than are simulated in about a minute."""
    length, step = len(mapped.record) * mapped.record.sample_period, prepared.machinery.step
    if length > MOST_STEPS * step:
        fact = f"the recording lasts {length:.3g} s, which are {length / step:.2g} steps of {step:g} s; the limit is {MOST_STEPS:.0e}."
        remedy = "Check the rate or the unit of the time, or give a longer 'step'."
        raise RecordingError(fact, place=mapping.time_place or str(file), remedy=remedy)


def refuse_still(file: Path, record: Record, compared: Collection[str]) -> None:
    """Refuse a recording in which nothing that is compared moves: it tells nothing of a machine."""
    if not any(len(finite := record[name][np.isfinite(record[name])]) and np.ptp(finite) > 0.0 for name in compared):
        fact = f"nothing that is compared moves in it: {', '.join(compared)}."
        raise RecordingError(fact, place=str(file), remedy="Map other columns, or record a motion.")


def coarser_than_decided(period: float, assembly: Assembly, compared: Collection[str]) -> list[Finding]:
    """Return where a controller decides more often than the recording shows. Where that is no whole number of times, or too many, it is
    another one at the recorder's rate, a slower one, and what it decided is known only if that was recorded."""
    found = []
    for part in (part for part in assembly.parts if period > _COARSER * assembly.sample_period and closes_a_loop(part)):
        outputs = {f"{part.name}.{name}" for name in part.component.declared(Output)}
        fact = f"One sample every {period * 1e3:g} ms, and {part.name} decides every {assembly.sample_period * 1e3:g} ms"
        if decisions_for_each(period, assembly) > 1:
            done = "simulated at the controller's rate; in between, what is declared held is held, and the rest is interpolated"
            found.append(Finding("interpolated", "", fact, done))
        else:
            known = bool(outputs & set(compared))
            done = "it is simulated at the recorder's rate, a slower loop than the real one; record as often as it decides"
            if not known:
                done = f"what it did in between cannot be replayed; record as often, or record {next(iter(sorted(outputs)), part.name)} too"
            found.append(Finding("coarse", "", fact, done, serious=not known))
    return found


def at_period(assembly: Assembly, period: float) -> Assembly:
    """Return the assembly sampled as the recording is, with a step that divides the period and is no longer than before."""
    return replace(assembly, sample_period=period, step=dividing(period, assembly.step))


def uncertainties(lesson: Lesson, plan: Plan) -> dict[str, float]:
    """Return one standard deviation [SI] of each value that the lesson calls uncertain; refused where it calls none so."""
    entries = lesson.settings.uncertain
    if not entries:
        raise LessonError(
            "the lesson does not say how sure its values are, so a misfit says nothing.",
            place=str(lesson.path),
            remedy="Add, for example, uncertain: {x_axis.mass: 5 %}.",
        )
    found = {}
    for name, text in entries.items():
        place = lesson.source.place(("uncertain", name))
        number, unit = split_quantity(text)
        given = plan.given(name)
        declared = plan.unit(name)
        found[name] = abs(given) * float(number) / 100.0 if unit == "%" else si_value(Given(text, place, place), declared)
        if found[name] <= 0.0:
            fact = f"{name} is {given:g}, and a share of it is no uncertainty."
            raise LessonError(fact, place=place, remedy="Write a quantity with its unit.")
    return found


@dataclass(frozen=True)
class Driven:
    """A case that lasts as long as its recording, sampled as that is; ``findings`` are sentences about the recording."""

    prepared: Prepared
    findings: tuple[str, ...]


def driven_by(prepared: Prepared, file: Path, registry: Registry) -> Driven:
    """Return a prepared case with its driven inputs as they were recorded.

    Places and speeds start where the recording shows them, those that were set from the command line excepted; no other start is fitted, as
    ``compare`` does. Raises what ``compare`` raises of a recording, and :class:`LessonError` where the lesson lets it drive nothing.
    """
    machine, recorded = read_for(prepared, file, registry)
    lesson = prepared.case.lesson
    if not machine.drive:
        place = lesson.source.place(("recordings",), key=True)
        remedy = "Run it without --recording, or add drive: {x_controller.reference: {...}}."
        raise LessonError("the recording drives nothing in this lesson.", place=place, remedy=remedy)
    driven = machine.driven_by(machine.assembly, recorded.record)
    assembly = replace(cast("Machinery", machine.at_controllers_rate(driven)), finish="")
    starts = _recorded_starts(machine, recorded, wire(assembly))
    for name, given in prepared.case.changed.set.items():
        if given.of_command_line:
            starts.pop(name, None)
    assembly = replace(assembly, parts=tuple(_started(part, starts) for part in assembly.parts))
    case = replace(prepared.case, duration=Given((len(recorded.record) - 1) * recorded.record.sample_period, str(file), str(file)))
    ready = replace(prepared, case=case, machinery=assembly, plan=wire(assembly), recording=str(file))
    return Driven(ready, tuple(str(finding) for finding in recorded.findings))


def _recorded_starts(machine: RecordedMachine, recorded: Recorded, plan: Plan) -> dict[str, float]:
    """Return the starting values that the recorded motion shows."""
    (experiment,) = build_experiments(machine, [(recorded.name, recorded.record)], ())
    return {item.name: item.start for item in experiment.start_states(plan) if np.isfinite(item.uncertainty)}


def _started(part: Part, starts: dict[str, float]) -> Part:
    own = of_part(part.name, starts)
    return replace(part, start={**part.start, **own}) if own else part
