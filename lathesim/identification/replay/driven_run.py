"""A lesson led by a recording: its own simulation, as ``compare`` holds it beside the recording, made ready to be run by itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np

from lathesim.engine.assembly import Part, of_part
from lathesim.engine.wiring import Plan, wire
from lathesim.errors import LessonError
from lathesim.identification.replay.controller_rate import at_controllers_rate
from lathesim.identification.replay.experiment import RecordedMachine, build_experiments
from lathesim.identification.replay.loading import Recorded, read_for
from lathesim.lessons.case import Given
from lathesim.lessons.insertion import Machinery
from lathesim.lessons.simulate import Prepared
from lathesim.plugins import Registry


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
    assembly = replace(cast("Machinery", at_controllers_rate(driven, machine.decisions)), finish="")
    starts = _recorded_starts(machine, recorded, wire(assembly))
    for name, given in prepared.case.changed.set.items():
        if given.of_command_line:
            starts.pop(name, None)
    assembly = replace(assembly, parts=tuple(_started(part, starts) for part in assembly.parts))
    length = (len(recorded.record) - 1) * recorded.record.sample_period
    case = replace(prepared.case, duration=Given(length, str(file), str(file)))
    ready = replace(prepared, case=case, machinery=assembly, plan=wire(assembly), recording=str(file))
    return Driven(ready, tuple(str(finding) for finding in recorded.findings))


def _recorded_starts(machine: RecordedMachine, recorded: Recorded, plan: Plan) -> dict[str, float]:
    """Return the starting values that the recorded motion shows."""
    (experiment,) = build_experiments(machine, [(recorded.name, recorded.record)], ())
    return {item.name: item.start for item in experiment.start_states(plan) if np.isfinite(item.uncertainty)}


def _started(part: Part, starts: dict[str, float]) -> Part:
    own = of_part(part.name, starts)
    return replace(part, start={**part.start, **own}) if own else part
