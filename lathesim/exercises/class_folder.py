"""The folder that a class is given: recording, second recording, lesson and seal; and beside it the answer, which it is not given."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.errors import RecordingError
from lathesim.exercises.conceal import Concealed
from lathesim.exercises.logger import TIME, LoggedColumn, recordings_entry
from lathesim.exercises.sealed_answer import answer_of, seal_of
from lathesim.lessons.changed_lesson import class_lesson, files_beside
from lathesim.lessons.lesson import Lesson
from lathesim.units import si_factor
from lathesim.whole_file import WholeFiles, folder_lock, make_folder

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


def publish(lesson: Lesson, concealed: Concealed, folder: Path, answer_file: Path, *, seed: int, noise: float) -> Published:
    """Write the folder for the class and the answer, all files or none. Raises :class:`WriteError` if one cannot be written.

    Nothing that is there is replaced (:class:`RecordingError`), also if another process makes a case in the same folder.
    """
    make_folder(folder)
    make_folder(answer_file.parent)
    contents: dict[Path, bytes] = {}
    time_unit = lesson.settings.recordings.time.unit if lesson.settings.recordings is not None else "s"
    for name, time, table in zip(RECORDINGS, concealed.times, concealed.tables, strict=False):
        contents[folder / name] = csv_text(time, _time_name(lesson), time_unit, concealed.columns, table).encode()
    contents[folder / "lesson.yaml"] = class_lesson(lesson, recordings_entry(lesson, list(concealed.columns))).encode()
    contents |= {folder / path.name: path.read_bytes() for path in files_beside(lesson)}
    digests = {file.name: hashlib.sha256(content).hexdigest() for file, content in contents.items()}
    answer = answer_of(concealed, lesson.name, digests, seed=seed, noise=noise)
    with folder_lock(folder), folder_lock(answer_file.parent), WholeFiles() as whole:
        answer_place(folder, answer_file)  # once more: another process may have made a case since then
        for file, content in contents.items():
            if file.exists() and file.read_bytes() != content:
                raise RecordingError(
                    "this file is there already, and it is not replaced.", place=str(file), remedy="Choose another folder."
                )
        whole.write_text(answer_file, json.dumps(answer, indent=2) + "\n")  # first: a sealed case without its answer is lost
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
