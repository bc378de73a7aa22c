"""A remedy for a control that nobody can change: the part program itself, with the error of the machine mirrored into its path.

The diagnosed machine is simulated; where its tables are off the sound machine, the way-points go as far to the other side, ahead by the
lag of the loops, in a few rounds (learning on the model). Play and friction become steps at the reversals, pitch errors a slow shift,
deflection under the cut a deeper path. Blocks last whole samples, so a control in continuous-path mode runs them as the machine was asked
to; one that stops at the end of each block cannot.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from lathesim.compensation.lap_response import learning_filter
from lathesim.compensation.laps import Course, course_of
from lathesim.compensation.learn import program_text
from lathesim.compensation.planning import answered
from lathesim.compensation.remedying import Answer
from lathesim.component import Table
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.errors import LatheSimError, LessonError, ProgramError
from lathesim.identification.position_loops import loops_of
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import lesson_from_text
from lathesim.lessons.program_path import limits_of
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.program.path import lay_path
from lathesim.program.program_file import load_program
from lathesim.units import in_unit
from lathesim.whole_file import write_text

_WORSE = 1.5
"""Times the least error so far from which on no further round is tried."""

PROGRAM_FILE, LESSON_FILE = "mirrored.nc", "lesson_program.yaml"
BENT = ("WorkpieceDeflection", "ToolCompliance")
"""Effects that a path takes up beside those with a remedy: what bends under the cut. A recorder's fault or a lost count is none."""
_ROUNDS = 10
_LARGEST_SHIFT = 1e-3
"""Largest shift of a way-point [m]: more would gouge, and is no compensation (assumed)."""
CONTINUOUS = "ConstantVelocityInterpolator"
"""Interpolator that runs from block to block without a stop, as a control in continuous-path mode (G64) does."""


def write_program(answer: Answer, folder: Path) -> list[Path]:
    """Write the changed part program and a lesson that runs it; return their files, none where there is nothing that a path takes up.

    Raises :class:`LessonError` where the mirrored path leaves the travel, where it would shift a point by more than a millimetre, where it
    does not pass its check, or where nothing asks for the path of a program.
    """
    if answer.nothing or answer.bench is None:
        return []
    taken_up = {*answered(answer.diagnosed.registry), *BENT}
    mirrored = tuple(entry for entry in answer.diagnosed.effects if entry["effect"] in taken_up)
    if not mirrored:
        return []
    diagnosed = replace(answer.diagnosed, effects=mirrored)
    text = diagnosed.text([], {}, diagnosed.folder)
    prepared = prepare(lesson_from_text(text, diagnosed.folder / "lesson.yaml"), diagnosed.registry)
    walker = _walker(prepared, str(diagnosed.lesson.path))
    course = course_of(prepared, "reference")
    best = _mirrored(course, answer.bench.table(answer.bench.runs([answer.bench.sound])[0]), str(diagnosed.lesson.path))
    largest = float(np.max(np.abs(best)))
    if largest > _LARGEST_SHIFT:
        fact = f"the mirrored path would shift a point by {in_unit(largest, 'mm', '.3g')}, which gouges."
        raise LessonError(fact, place=str(diagnosed.lesson.path), remedy="Repair the machine; a program does not take up so much.")
    file = folder / PROGRAM_FILE
    write_text(file, program_text(course.references() + best, course.period, course.axes_of_path(), _spindle(prepared, walker)))
    try:
        lay_path(load_program(file, "linuxcnc"), limits_of(diagnosed.lesson.machine))
    except (LatheSimError, ProgramError) as error:
        raise LessonError(f"the mirrored program does not pass its check: {error.fact}", place=str(file), remedy=error.remedy) from None
    changes = {"replace": {walker: CONTINUOUS}, "program": file, "further": {"dialect": "linuxcnc"}}
    text = changed_lesson(diagnosed.lesson, [], dict(diagnosed.values), folder, variant=diagnosed.variant, **changes)  # type: ignore[arg-type]
    lesson = folder / LESSON_FILE
    write_text(lesson, text)
    return [file, lesson]


def _walker(prepared: Prepared, place: str) -> str:
    """Return the part that walks along the path of the program."""
    found = [part.name for part in prepared.machinery.parts if "path" in part.component.declared(Table)]
    asking = {Place.of(loop.reference).part for loop in loops_of(prepared.machinery)}
    walker = next((name for name in found if name in asking), None)
    if walker is None:
        remedy = "Write the remedy as a lesson, or as a table."
        raise LessonError("no part program asks for the path of this machine, so none can be changed.", place=place, remedy=remedy)
    return walker


def _mirrored(course: Course, sound: FloatArray, place: str) -> FloatArray:
    """Return what is added to the references so that the diagnosed machine follows as the sound one: the best of a few rounds.

    A round counts where the tool is nowhere further from that of the sound machine than it is without it. Raises :class:`LessonError` where
    none does.
    """
    chosen = learning_filter(course)
    _, count = course.floors()
    corrections = np.zeros((len(course.loops), course.samples))
    off = sound[:, : course.samples] - course.tables_of(corrections)
    furthest, reached = _furthest(off) + count, 0.0
    best, least = None, _rms(off)
    for _ in range(_ROUNDS):
        corrections = chosen.applied(corrections, off)
        # a rapid to the first point would cost a sample, and all the others would be late
        corrections[:, 0] = 0.0
        off = sound[:, : course.samples] - course.tables_of(corrections)
        reached = _furthest(off)
        if reached <= furthest and _rms(off) < least:
            best, least = corrections, _rms(off)
        elif best is not None and _rms(off) > _WORSE * least:
            break
    if best is None:
        sizes = f"{in_unit(reached, 'um', '.3g')} off, which gouges: without it the tool is {in_unit(furthest, 'um', '.3g')} off"
        fact = f"the mirrored path would take the tool {sizes}."
        raise LessonError(fact, place=place, remedy="Write the remedy as a lesson, or as a table.")
    return best


def _furthest(off: FloatArray) -> float:
    return float(np.max(np.sqrt(np.sum(off * off, axis=0))))


def _rms(off: FloatArray) -> float:
    return float(np.sqrt(np.mean(off * off)))


def _spindle(prepared: Prepared, walker: str) -> FloatArray | None:
    """Return the spindle speed that the program asks for in each sample [rad/s], none where there is no spindle."""
    name = f"{walker}.spindle_reference"
    plan = wire(replace(prepared.machinery, record=None))
    if name not in plan.channels:
        return None
    record = run(plan, duration=prepared.duration, seed=prepared.case.seed, expected_time=prepared.expected_time)
    return np.asarray(record[name])
