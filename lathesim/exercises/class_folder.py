"""A concealed case from its beginning to its end: what is hidden, the recordings, the folder for the class and the seal."""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray
from lathesim.errors import LessonError, RecordingError
from lathesim.exercises.conceal import DRAWS, Concealed, Difficulty, NotSeenError, Situation, conceal
from lathesim.exercises.hidden_effect import HiddenWish, random_wishes, read_wish
from lathesim.exercises.logger import TIME, LoggedColumn, logged_columns, recordings_entry
from lathesim.exercises.sealed_answer import answer_of, seal_of
from lathesim.identification.replay.loading import uncertainties
from lathesim.lessons.changed_lesson import class_lesson, files_beside
from lathesim.lessons.lesson import Lesson, keep_read_lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry
from lathesim.recordings.mapping import map_recording
from lathesim.recordings.raw_table import read_recording
from lathesim.units import si_factor
from lathesim.whole_file import WholeFiles, check_output, folder_lock, make_folder

RECORDINGS = ("recording.csv", "validate.csv")


@dataclass(frozen=True)
class Published:
    """What was written: the files of the folder for the class, the answer's file, and the answer."""

    files: tuple[Path, ...]
    answer_file: Path
    answer: Mapping[str, Any]


def answer_place(folder: Path, wanted: Path | None) -> Path:
    """Return where the answer goes, and refuse (:class:`RecordingError`) a place in the folder for the class or a case that is there."""
    place = wanted or folder.parent / f"{folder.name or 'case'}_answer.json"
    if folder.resolve() in place.resolve().parents:
        remedy = "Choose another place with --answer."
        raise RecordingError("the answer would lie in the folder for the class.", place=str(place), remedy=remedy)
    for taken in (folder / "seal.json", place):
        if taken.exists():
            raise RecordingError("there is a sealed case here already.", place=str(taken), remedy="Choose another place, or take it away.")
    return place


def publish(
    lesson: Lesson,
    concealed: Concealed,
    folder: Path,
    answer_file: Path,
    *,
    seed: int,
    noise: float,
    further: Mapping[str, Any] | None = None,
    with_tasks: bool = False,
) -> Published:
    """Write the folder for the class and the answer, all files or none. Raises :class:`WriteError` if one cannot be written.

    The answer holds ``further`` entries too. With ``with_tasks`` the lesson for the class keeps its variants, goals and questions, and
    a copy stays beside the answer.
    Nothing that is there is replaced (:class:`RecordingError`), also if another process makes a case in the same folder.
    """
    make_folder(folder)
    make_folder(answer_file.parent)
    contents: dict[Path, bytes] = {}
    time_unit = lesson.settings.recordings.time.unit if lesson.settings.recordings is not None else "s"
    for name, time, table in zip(RECORDINGS, concealed.times, concealed.tables, strict=False):
        contents[folder / name] = csv_text(time, _time_name(lesson), time_unit, concealed.columns, table).encode()
    entry = recordings_entry(lesson, list(concealed.columns)) if concealed.columns else {}
    contents[folder / "lesson.yaml"] = class_lesson(lesson, entry, with_tasks=with_tasks).encode()
    contents |= {folder / path.name: path.read_bytes() for path in files_beside(lesson, with_tasks=with_tasks)}
    digests = {file.name: hashlib.sha256(content).hexdigest() for file, content in contents.items()}
    answer = {**answer_of(concealed, lesson.name, digests, seed=seed, noise=noise), **(further or {})}
    with folder_lock(folder), folder_lock(answer_file.parent), WholeFiles() as whole:
        answer_place(folder, answer_file)  # once more: another process may have made a case since then
        for file, content in contents.items():
            if file.exists() and file.read_bytes() != content:
                raise RecordingError(
                    "this file is there already, and it is not replaced.", place=str(file), remedy="Choose another folder."
                )
        whole.write_text(answer_file, json.dumps(answer, indent=2) + "\n")  # first: a sealed case without its answer is lost
        if with_tasks:
            whole.place(answer_file.with_suffix(".yaml")).write_bytes(contents[folder / "lesson.yaml"])
        for file, content in contents.items():
            whole.place(file).write_bytes(content)
        whole.write_text(folder / "seal.json", json.dumps(seal_of(answer), indent=2) + "\n")
    return Published((*contents, folder / "seal.json"), answer_file, answer)


def _time_name(lesson: Lesson) -> str:
    recordings = lesson.settings.recordings
    return recordings.time.column if recordings is not None and recordings.time.column is not None else TIME


def csv_text(time: FloatArray, time_name: str, time_unit: str, columns: tuple[LoggedColumn, ...], table: FloatArray) -> str:
    """Return the recording as text: a header with names and units, one row a sample."""
    header = ",".join([f"{time_name} [{time_unit}]", *[f"{column.name} [{column.unit}]" for column in columns]])
    texts = [[f"{value:.9g}" for value in time / si_factor(time_unit)[0]]]
    for column, row in zip(columns, table, strict=True):
        texts.append(_numbers(column.in_file(row), column.decimals))
    return "\n".join([header, *[",".join(cells) for cells in zip(*texts, strict=True)], ""])


def _numbers(values: FloatArray, decimals: int | None) -> list[str]:
    if decimals is None:
        return [f"{value:.10g}" for value in values]
    return [f"{value:.{decimals}f}" for value in np.asarray(values) + 0.0]


Progress = Callable[[str], None]
VALIDATION = "validation"
"""Variant of a lesson that is the situation of its second recording."""


@dataclass(frozen=True)
class Hiding:
    """What is hidden in a machine, and how it is recorded.

    ``asked`` is as ``lathesim conceal --effect`` takes it; empty hides nothing, or what is drawn ``at_random``. ``answer`` is the place of
    the answer, ``drive`` a recording that holds the driven inputs. With ``validate`` there is a second recording. ``noise`` is in steps of
    each sensor's resolution.
    """

    asked: Sequence[str] = ()
    at_random: bool = False
    answer: Path | None = None
    validate: bool = False
    drive: Path | None = None
    noise: float = 1.0
    seed: int | None = None


def conceal_case(
    lesson: Lesson,
    registry: Registry,
    folder: Path,
    hiding: Hiding,
    *,
    tell: Progress = lambda sentence: None,
    wanted: Difficulty | None = None,
    further: Callable[[Concealed], Mapping[str, Any]] = lambda concealed: {},
) -> tuple[Concealed, Published]:
    """Hide effects in the machine of a lesson, record it, and return it with what was written.

    Raises :class:`RecordingError` and :class:`LessonError` where the case cannot be made or written. With ``wanted`` the case is that of a
    student: one effect that is as hard to find, the lesson with its tasks, and ``further`` entries in the answer (:func:`publish`).
    """
    noise, drive = hiding.noise, hiding.drive
    place = answer_place(folder, hiding.answer)
    for file in (folder / "seal.json", folder / RECORDINGS[0], place):
        check_output(file)
    keep_read_lesson(lesson, folder)
    prepared = prepare(lesson, registry)
    seed = secrets.randbits(48) if hiding.seed is None else hiding.seed
    signals = _signals(lesson, prepared, drive, registry) if drive is not None else {}
    columns = logged_columns(lesson, prepared.machinery, signals)
    effects = cast("dict[str, type[Effect]]", registry.effects)
    situations = [_situation(prepared, signals)]
    if hiding.validate:
        second = VALIDATION if VALIDATION in lesson.variants and not signals else None
        situations.append(_situation(prepare(lesson, registry, second), signals))
    made = partial(conceal, situations, columns, uncertain=_uncertain(lesson, prepared, tell), seed=seed, noise=noise, wanted=wanted)
    drawn = partial(_drawn, made, prepared, effects, columns, seed, tell, None if wanted is None else 1)
    concealed = drawn() if hiding.at_random else made([read_wish(text, effects) for text in hiding.asked])
    more = further(concealed)
    return concealed, publish(lesson, concealed, folder, place, seed=seed, noise=noise, further=more, with_tasks=wanted is not None)


def _drawn(
    made: Callable[[list[HiddenWish]], Concealed],
    prepared: Prepared,
    effects: dict[str, type[Effect]],
    columns: list[LoggedColumn],
    seed: int,
    tell: Progress,
    count: int | None,
) -> Concealed:
    """Draw what is hidden, again where what was drawn cannot be seen."""
    compared = [column.target for column in columns if column.role == "compare"]
    for attempt in range(DRAWS):
        wishes = random_wishes(prepared.machinery, effects.values(), compared, np.random.default_rng([seed, 0, attempt]), count)
        try:
            return made(wishes)
        except NotSeenError as error:
            if attempt == DRAWS - 1:
                raise
            tell(f"Drawn again: {error.fact}")
    raise AssertionError("the last attempt gives or raises")


def _situation(prepared: Prepared, signals: dict[str, FloatArray]) -> Situation:
    duration = prepared.duration
    if signals:
        duration = (min(len(values) for values in signals.values()) - 1) * prepared.machinery.sample_period
    return Situation(prepared.machinery, duration, signals)


def _signals(lesson: Lesson, prepared: Prepared, file: Path, registry: Registry) -> dict[str, FloatArray]:
    """Return the driven inputs that a recording holds [SI], one value a sample of the lesson's machine."""
    mapping = mapping_of(lesson, prepared.machinery)
    driven = tuple(signal for signal in mapping.signals if signal.role == "drive")
    if not driven:
        raise LessonError("the lesson drives no input by a recording.", place=str(lesson.path), remedy="Leave --drive out.")
    record = map_recording(read_recording(file, registry.readers.values()), replace(mapping, signals=driven)).record
    times = np.arange(0.0, record.time[-1], prepared.machinery.sample_period)
    return {name: np.interp(times, record.time, record[name]) for name in record}


def _uncertain(lesson: Lesson, prepared: Prepared, tell: Progress) -> dict[str, float]:
    """Return how uncertain the values of the lesson are; without any the machine is as the lesson says, and that is told."""
    if not lesson.settings.uncertain:
        tell("The lesson calls no value uncertain, so the machine has them exactly; 'diagnose' will ask for 'uncertain:'.")
        return {}
    return uncertainties(lesson, prepared.plan)
