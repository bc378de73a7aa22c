"""What is written of a remedy: lesson, JSON, the table of common controls; and its promise held against a recording.

A control that nobody can change is given another part program: its own, with the error of the machine mirrored into its path.

The diagnosed machine is simulated; where its tables are off the sound machine, the way-points go as far to the other side, ahead by the
lag of the loops, in a few rounds (learning on the model). Play and friction become steps at the reversals, pitch errors a slow shift,
deflection under the cut a deeper path. Blocks last whole samples, so a control in continuous-path mode runs them as the machine was asked
to; one that stops at the end of each block cannot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.analysis.turning_metrics import rms
from lathesim.compensation.diagnosed_machine import InsertedRemedy
from lathesim.compensation.lap_response import learning_filter
from lathesim.compensation.laps import Course, course_of
from lathesim.compensation.learn import program_text
from lathesim.compensation.planning import answered
from lathesim.compensation.promise import RECORDED
from lathesim.compensation.remedying import Answer
from lathesim.component import Table
from lathesim.effects.effect import Effect
from lathesim.effects.remedy import Remedy
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.run import Hints, run
from lathesim.engine.wiring import wire
from lathesim.errors import LatheSimError, LessonError, ProgramError
from lathesim.identification.position_loops import loops_of
from lathesim.json_text import eight_digits, read_json, written_json
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import Lesson, lesson_from_text
from lathesim.lessons.program_path import limits_of
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry
from lathesim.program.path import lay_path
from lathesim.program.program_file import load_program
from lathesim.recordings.mapping import map_recording
from lathesim.recordings.raw_table import read_recording
from lathesim.units import in_unit
from lathesim.whole_file import make_folder, write_text

TABLE_FILE = "control_table.txt"
_MOST_ROWS = 400


def write_control_table(answer: Answer, folder: Path) -> Path:
    """Write what is to be typed into a control; return the file."""
    lines = ["Compensation of axes, in mm, um, mm/min, V and ms. Signs: positive towards the positive direction of the axis.", ""]
    if answer.nothing:
        lines.append(answer.nothing)
    for line in answer.lines:
        axis = next((item.loop.axis for item in answer.axes if item.loop.controller == line.at), line.at)
        lines += [f"{axis}: against {', '.join(line.answers)}", *_of(line, answer), ""]
    lines += [f"{item.effect} at {item.at}: {item.why}." for item in answer.not_mended]
    file = folder / TABLE_FILE
    write_text(file, "\n".join(lines) + "\n")
    return file


def _of(line: InsertedRemedy, answer: Answer) -> list[str]:
    value = {name: number * line.share if name in line.one_sided else number for name, number in line.values.items()}
    if line.remedy == "BacklashShift":
        return [
            f"  play                    {in_unit(value['width'], 'um', '10.3f')}",
            f"  taken up within         {in_unit(value['spread'], 'ms', '10.3f')}",
        ]
    if line.remedy == "FrictionFeedforward":
        rows = [
            f"  friction pulse          {in_unit(value.get('level', 0.0), 'mV', '10.3f')}",
            f"  lead                    {in_unit(value.get('lead', 0.0), 'ms', '10.3f')}",
        ]
        return rows + _over_acceleration(value)
    if line.remedy in ("PitchTable", "AcrossTable"):
        columns, points = next(iter(line.tables.values()))
        step = max(1, len(points) // _MOST_ROWS)
        head = "  " + "".join(f"{name + (' [mm]' if place == 0 else ' [um]'):>16}" for place, name in enumerate(columns))
        return [head, *["  " + f"{1e3 * row[0]:16.4f}" + "".join(f"{-1e6 * error:16.4f}" for error in row[1:]) for row in points[::step]]]
    return [f"  {name:<24}{number:.8g} {answer.bench.units(line.name)[name] if answer.bench else ''}" for name, number in value.items()]


def _over_acceleration(value: dict[str, float]) -> list[str]:
    """Return the size of the friction pulse over the acceleration at reversal, as quadrant compensation asks for it."""
    rows = ["  acceleration at reversal [mm/s^2]      pulse [mV]"]
    lag = value.get("inner", 0.0)
    for acceleration in (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0):
        speed = 1e-3 * acceleration * max(lag, 1e-4)
        size = value.get("level", 0.0)
        if value.get("excess"):
            size += value["excess"] * math.exp(-((speed / value["stribeck_velocity"]) ** value.get("shape", 1.0)))
        rows.append(f"  {acceleration:30.0f}{1e3 * size:18.3f}")
    return rows


SCHEMA = "lathesim-remedy/1"
ANSWER_FILE = "remedy.json"


def write_lesson(answer: Answer, folder: Path) -> list[Path]:
    """Write the lesson with its remedies (and without the effects, which the machine has by itself), its tables, and what is pasted."""
    make_folder(folder)
    bench = answer.bench
    units = {line.name: bench.units(line.name) for line in answer.lines} if bench is not None else {}
    text = answer.diagnosed.text(answer.lines, units, folder, with_effects=False)
    lesson = folder / "lesson.yaml"
    write_text(lesson, text)
    tables = [folder / f"{line.name}_{name}.csv" for line in answer.lines for name in line.tables]
    return [lesson, *tables, *(write_text(folder / name, pasted) for name, pasted in answer.texts.items())]


def as_json(answer: Answer, lesson: str, files: list[str], wall_time: float) -> dict[str, Any]:
    """Return the answer as JSON of schema lathesim-remedy/1."""
    return {
        "schema": SCHEMA,
        "lesson": lesson,
        "nothing_to_mend": answer.nothing or None,
        "remedies": [
            {
                "remedy": line.remedy,
                "at": line.at,
                "answers": line.answers,
                "share": line.share,
                "parameters": {name: {"value": value, "unit": answer.bench.units(line.name)[name]} for name, value in line.values.items()},
                "tables": [f"{line.name}_{name}.csv" for name in line.tables],
                "limits": _class(answer, line).limits,
                "cannot": _class(answer, line).cannot,
            }
            for line in answer.lines
            if answer.bench is not None
        ],
        "pasted": answer.texts,
        "not_mended": [{"effect": item.effect, "at": item.at, "why": item.why} for item in answer.not_mended],
        "loop_gains_per_s": [
            {
                "controller": item.controller,
                "gain": eight_digits(item.gain),
                "largest": eight_digits(item.largest),
                "largest_without_effect": eight_digits(item.largest_without),
            }
            for item in answer.gains
        ],
        "cautions": answer.cautions,
        "better_in_share_of_draws": answer.better_in if answer.lines else None,
        "promise": {
            size.name: {
                "unit": size.unit,
                "before": eight_digits(size.before),
                "after": eight_digits(size.after),
                "low": eight_digits(size.low),
                "high": eight_digits(size.high),
                "removed_share": eight_digits(size.removed),
            }
            for size in answer.promise
        },
        "files": files,
        "wall_time_s": round(wall_time, 2),
    }


def _class(answer: Answer, line: InsertedRemedy) -> Any:
    return answer.diagnosed.registry.remedies[line.remedy]


def write_answer(data: dict[str, Any], folder: Path) -> Path:
    """Write the answer beside the lesson, where compare and conceal --again find it."""
    file = folder / ANSWER_FILE
    write_text(file, written_json(data) + "\n")
    return file


@dataclass(frozen=True)
class Kept:
    """A promise and its result [``unit``]."""

    name: str
    unit: str
    before: float
    low: float
    high: float
    result: float

    @property
    def holds(self) -> bool:
        """Whether the result lies in the promised interval."""
        return self.low <= self.result <= self.high

    @property
    def told(self) -> str:
        """One word for the result."""
        if self.holds:
            return "as promised"
        return "better than promised" if self.result < self.low else "worse than promised: diagnose this recording anew"


def promise_beside(lesson: Lesson) -> dict[str, Any] | None:
    """Return the promise that stands beside a remedied lesson, or none; :class:`LessonError` where the file is something else."""
    file = lesson.path.parent / ANSWER_FILE
    if not file.is_file():
        return None
    return read_json(file, SCHEMA, "promise", remedy="Write it with 'lathesim remedy'.", fault=LessonError)


def kept_promises(lesson: Lesson, recording: Path, registry: Registry, promise: dict[str, Any]) -> list[Kept]:
    """Return each promise that the recording can tell: the deviation of the tables from where the sound machine has them."""
    prepared = prepare(lesson, registry)
    machinery = prepared.machinery
    record = map_recording(read_recording(recording, registry.readers.values()), mapping_of(lesson, machinery)).record
    neutral = {
        f"{part.name}.{name}": value
        for part in machinery.parts
        if issubclass(part.component, (Effect, Remedy))
        for name, value in part.component.neutral.items()
    }
    sound = run(wire(replace(machinery, record=None)), duration=prepared.duration, seed=prepared.case.seed, overrides=neutral)
    found = []
    for loop in loops_of(machinery):
        if loop.table not in record:
            continue
        off = record[loop.table] - np.interp(record.time, sound.time, sound[loop.table])
        for kind, result in {"rms_deviation": float(np.sqrt(np.mean(off * off))), "largest_deviation": float(np.max(np.abs(off)))}.items():
            item = promise["promise"].get(f"{RECORDED}{kind} of {loop.table}")
            if isinstance(item, dict) and item.get("low") is not None and item.get("high") is not None:
                found.append(Kept(f"{kind} of {loop.table}", str(item["unit"]), item["before"], item["low"], item["high"], result))
    return found


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
    further = {"program": str(file.resolve()), "dialect": "linuxcnc"}
    values, replaced = dict(diagnosed.values), {walker: CONTINUOUS}
    text = changed_lesson(diagnosed.lesson, [], values, folder, variant=diagnosed.variant, replace=replaced, further=further)
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
        raise LessonError("no part program moves this machine, so none can be changed.", place=place, remedy=remedy)
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
    best, least = None, rms(off)
    for _ in range(_ROUNDS):
        corrections = chosen.applied(corrections, off)
        # a rapid to the first point would cost a sample, and all the others would be late
        corrections[:, 0] = 0.0
        off = sound[:, : course.samples] - course.tables_of(corrections)
        reached = _furthest(off)
        if reached <= furthest and rms(off) < least:
            best, least = corrections, rms(off)
        elif best is not None and rms(off) > _WORSE * least:
            break
    if best is None:
        sizes = f"{in_unit(reached, 'um', '.3g')} off, which gouges: without it the tool is {in_unit(furthest, 'um', '.3g')} off"
        fact = f"the mirrored path would take the tool {sizes}."
        raise LessonError(fact, place=place, remedy="Write the remedy as a lesson, or as a table.")
    return best


def _furthest(off: FloatArray) -> float:
    return float(np.max(np.sqrt(np.sum(off * off, axis=0))))


def _spindle(prepared: Prepared, walker: str) -> FloatArray | None:
    """Return the spindle speed that the program asks for in each sample [rad/s], none where there is no spindle."""
    name = f"{walker}.spindle_reference"
    plan = wire(replace(prepared.machinery, record=None))
    if name not in plan.channels:
        return None
    return np.asarray(run(plan, duration=prepared.duration, seed=prepared.case.seed, hints=Hints(prepared.expected_time))[name])
