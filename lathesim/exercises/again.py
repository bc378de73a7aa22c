"""A concealed machine recorded again, with another lesson on its control: what a remedy has really done."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from lathesim.effects.effect import Effect
from lathesim.effects.remedy import Remedy
from lathesim.engine.assembly import Assembly, FloatArray
from lathesim.errors import LatheSimError, LessonError, RecordingError
from lathesim.exercises.class_folder import csv_text
from lathesim.exercises.conceal import Situation, TrueMachine, logged
from lathesim.exercises.hidden_effect import HiddenWish
from lathesim.exercises.logger import logged_columns
from lathesim.exercises.sealed_answer import ANSWER
from lathesim.identification.position_loops import loops_of
from lathesim.json_text import read_json
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry
from lathesim.whole_file import make_folder, write_text

RESULT = "result.json"
_ANSWER_END, LESSON_FILE = "_answer.json", "lesson.yaml"
SCHEMA = "lathesim-again/1"
_OTHER_NOISE = 7919
"""What is added to the seed, so that the noise is that of another day."""


@dataclass(frozen=True)
class Result:
    """How far each table is from where that of the sound machine is [m]: root mean square without the remedies and with them."""

    before: Mapping[str, float]
    after: Mapping[str, float]
    files: tuple[Path, ...]

    @property
    def removed(self) -> dict[str, float]:
        """Share of what the hidden effects added that the remedies take away; none where they added nothing."""
        return {name: 1.0 - self.after[name] / value for name, value in self.before.items() if value > 0.0}


def record_again(answer_file: Path, lesson: Lesson, registry: Registry, folder: Path) -> Result:
    """Record the machine of a sealed answer with the remedied lesson on its control, and write recording and result to ``folder``.

    Raises :class:`RecordingError` where the answer is none, :class:`LessonError` where the lesson is of another machine.
    """
    answer = read_json(answer_file, ANSWER, "answer", "effects")
    prepared = prepare(lesson, registry)
    columns = logged_columns(lesson, prepared.machinery, {})
    effects = cast("dict[str, type[Effect]]", registry.effects)
    loops = loops_of(prepared.machinery)
    wishes, noise = _wishes(answer, effects), float(answer.get("noise", 1.0))
    # a lesson of one's own is no lesson that a name finds: the folder for the class beside the answer has it
    beside = answer_file.with_name(answer_file.name.removesuffix(_ANSWER_END)) / LESSON_FILE
    first = _original((str(answer.get("lesson", "")), str(beside)), lesson, registry)
    tables = [loop.table for loop in loops]
    try:
        machine = TrueMachine(Situation(prepared.machinery, prepared.duration, {}), columns, wishes, noise, tables)
        own = logged_columns(first.case.lesson, first.machinery, {})
        alone = TrueMachine(Situation(first.machinery, first.duration, {}), own, wishes, noise, tables)
    except LatheSimError as error:
        fact = f"what is hidden cannot be put into this lesson: {error.fact}"
        raise LessonError(fact, place=str(lesson.path), remedy="Give the lesson that was made for this case.") from None
    truth = {name: float(item["true"]) for name, item in dict(answer["true_values"]).items()}
    hidden = {f"{item.part}.{name}": value for item in machine.hidden for name, value in item.values.items()}
    neutral = {name: value for item in machine.hidden for name, value in item.neutral.items()}
    shares = _shares(first.machinery)
    seed = int(answer["seed"]) + _OTHER_NOISE
    columns = machine.with_resolution(columns, truth)
    sound = alone.run({**truth, **neutral, **shares}, seed)
    before = alone.run({**truth, **hidden, **shares}, seed)
    after = machine.run({**truth, **hidden}, seed)
    make_folder(folder)
    table = logged(after, machine, columns, noise, seed)
    recording = folder / "recording.csv"
    recordings = lesson.settings.recordings
    time_name = recordings.time.column if recordings is not None and recordings.time.column else "time"
    write_text(recording, csv_text(after.time, time_name, "s", tuple(columns), table))
    sizes = [{name: _off(run[channel], sound[channel]) for name, channel in machine.extra.items()} for run in (before, after)]
    result = Result(sizes[0], sizes[1], (recording, folder / RESULT))
    _write(result, folder / RESULT, lesson)
    return result


def _original(names: tuple[str, ...], lesson: Lesson, registry: Registry) -> Prepared:
    """Return the lesson that the case was made of, where it is found and moves the same axes; else the one that is given."""
    own = prepare(lesson, registry)
    for name in names:
        try:
            first = prepare(load_lesson(name), registry)
        except LatheSimError:
            continue
        if [loop.table for loop in loops_of(first.machinery)] == [loop.table for loop in loops_of(own.machinery)]:
            return first
    return own


def _wishes(answer: Mapping[str, Any], effects: Mapping[str, type[Effect]]) -> list[HiddenWish]:
    wishes = []
    for item in answer["effects"]:
        effect = effects.get(str(item["effect"]))
        if effect is None:
            raise RecordingError(f"the answer hides {item['effect']}, which is no effect here.", remedy="Load its plug-in with --plugins.")
        values = {
            name: f"{value['value']!r} {value['unit']}" if value["unit"] != "1" else repr(value["value"])
            for name, value in item["parameters"].items()
        }
        wishes.append(HiddenWish(effect, str(item["at"]), values, str(item["effect"])))
    return wishes


def _shares(assembly: Assembly) -> dict[str, float]:
    """Return the values with which no remedy of the lesson acts."""
    found: dict[str, float] = {}
    for part in assembly.parts:
        if issubclass(part.component, Remedy):
            found |= {f"{part.name}.{name}": value for name, value in part.component.neutral.items()}
    return found


def _off(values: FloatArray, sound: FloatArray) -> float:
    count = min(len(values), len(sound))
    return float(np.sqrt(np.mean((values[:count] - sound[:count]) ** 2)))


def _write(result: Result, file: Path, lesson: Lesson) -> None:
    data = {
        "schema": SCHEMA,
        "lesson": lesson.name,
        "rms_deviation": {
            name: {"unit": "m", "before": result.before[name], "after": result.after[name], "removed_share": result.removed.get(name)}
            for name in result.before
        },
    }
    write_text(file, json.dumps(data, indent=2) + "\n")
