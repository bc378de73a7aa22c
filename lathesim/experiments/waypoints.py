"""Way-points of a machine: where it was at times that need not be even, and which part program it was running."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.errors import LessonError, RecordingError
from lathesim.lessons.lesson import Lesson, find_program
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry
from lathesim.recordings.finding import Finding
from lathesim.recordings.mapping import rows_as_taken
from lathesim.recordings.reading import read_recording

LEAST_WAYPOINTS = 20
"""Fewer way-points say nothing about a machine; assumed."""
_STILL = 1e-9
"""A channel [SI] that moves less than this stands still."""


@dataclass(frozen=True, eq=False)
class Waypoints:
    """Way-points of one run: ``time`` (n,) [s] since the program began, ``values`` channel -> (n,) [SI], NaN where nothing was written.

    ``prepared`` is the lesson's machine on the program that was run; ``resolution`` [SI] is what the lesson tells of a channel.
    """

    name: str
    file: Path
    prepared: Prepared
    time: FloatArray
    values: dict[str, FloatArray]
    resolution: dict[str, float]
    findings: tuple[Finding, ...]

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels, in the order of the lesson."""
        return tuple(self.values)

    @property
    def duration(self) -> float:
        """Time of the last way-point [s]."""
        return float(self.time[-1])


def read_waypoints(lesson: Lesson, given: str, registry: Registry) -> Waypoints:
    """Return the way-points of ``FILE``, or of ``PROGRAM=FILE`` where PROGRAM is a variant of the lesson or a part program.

    Without ``PROGRAM=`` a file that is called as a variant or as the part program of one is a run of that. Otherwise it is one of the
    lesson's own program. Raises :class:`RecordingError` where the file tells too little, :class:`LessonError` where no program fits.
    """
    named, _, text = given.rpartition("=")
    file = Path(text)
    prepared = _prepared(lesson, named, file, registry)
    findings: list[Finding] = []
    mapping = mapping_of(lesson, prepared.machinery)
    time, values = rows_as_taken(read_recording(file, registry.readers), mapping, findings)
    present = {name: column for name, column in values.items() if np.isfinite(column).any()}
    keep = np.isfinite(time) & np.any([np.isfinite(column) for column in present.values()] or [np.zeros(len(time), bool)], axis=0)
    time, present = time[keep], {name: column[keep] for name, column in present.items()}
    if len(time) < LEAST_WAYPOINTS:
        fact = f"the recording has {len(time)} way-point{'s' if len(time) != 1 else ''}."
        raise RecordingError(fact, place=str(file), remedy=f"Record at least {LEAST_WAYPOINTS}, while the axes move.")
    order = np.argsort(time, kind="stable")
    if (np.diff(order) < 0).any():
        findings.append(Finding("order", "", "rows were out of order in time", "they were sorted"))
        time, present = time[order], {name: column[order] for name, column in present.items()}
    if time[0] < -1e-9 or time[0] > 3600.0:
        findings.append(
            Finding("clock", "", f"the clock begins at {time[0]:.6g} s", "the first way-point is taken as the program's beginning")
        )
        time = time - time[0]
    if all(np.nanmax(column) - np.nanmin(column) < max(_STILL, 0.0) for column in present.values()):
        raise RecordingError("nothing moves in the recording.", place=str(file), remedy="Record a program that moves the axes.")
    resolution = {signal.target: signal.resolution for signal in mapping.signals if signal.resolution}
    name = named if named in lesson.variants else Path(named or file).stem
    return Waypoints(name, file, prepared, time, present, resolution, tuple(findings))


def _prepared(lesson: Lesson, named: str, file: Path, registry: Registry) -> Prepared:
    """Return the lesson's machine on the program that a recording is a run of."""
    if named in lesson.variants:
        return prepare(lesson, registry, named)
    if named:
        program = find_program(named, lesson.path.parent)
        if program is None:
            known = ", ".join(lesson.variants)
            remedy = f"The lesson has the variants {known}." if known else "Write the way to a part program."
            raise LessonError(f"'{named}' is neither a variant of the lesson nor a part program.", place=f"{named}={file}", remedy=remedy)
        return prepare(lesson, registry, program=program)
    for variant in lesson.variants:
        program_named = lesson.settings.variants[variant].program
        if file.stem == variant or (program_named and Path(program_named).stem == file.stem):
            return prepare(lesson, registry, variant)
    beside = file.with_suffix(".nc")
    return prepare(lesson, registry, program=beside) if beside.is_file() else prepare(lesson, registry)
