"""A concealed case from its beginning to its end: what is hidden, the recordings, the folder for the class and the sealed answer."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import cast

import numpy as np

from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray
from lathesim.errors import LessonError
from lathesim.exercises.class_folder import RECORDINGS, Published, answer_place, publish
from lathesim.exercises.conceal import DRAWS, Concealed, NotSeenError, Situation, conceal
from lathesim.exercises.hidden_effect import HiddenWish, random_wishes, read_wish
from lathesim.exercises.logger import LoggedColumn, logged_columns
from lathesim.identification.replay.loading import uncertainties
from lathesim.lessons.lesson import Lesson, keep_read_lesson
from lathesim.lessons.recording_mapping import mapping_of
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry
from lathesim.recordings.mapping import map_recording
from lathesim.recordings.reading import read_recording
from lathesim.whole_file import check_output

Progress = Callable[[str], None]
VALIDATION = "validation"
"""Variant of a lesson that is the situation of its second recording."""


def conceal_case(
    lesson: Lesson,
    registry: Registry,
    folder: Path,
    *,
    answer: Path | None = None,
    asked: Sequence[str] = (),
    at_random: bool = False,
    validate: bool = False,
    drive: Path | None = None,
    noise: float = 1.0,
    seed: int | None = None,
    tell: Progress = lambda sentence: None,
) -> tuple[Concealed, Published]:
    """Hide what is ``asked`` for (or what is drawn) in the machine of a lesson, record it, and return it with what was written.

    ``asked`` is as ``lathesim conceal --effect`` takes it; empty hides nothing. ``noise`` is in steps of each sensor's resolution. Raises
    :class:`RecordingError` and :class:`LessonError` where the case cannot be made or written.
    """
    place = answer_place(folder, answer)
    for file in (folder / "seal.json", folder / RECORDINGS[0], place):
        check_output(file)
    keep_read_lesson(lesson, folder)
    prepared = prepare(lesson, registry)
    seed = secrets.randbits(48) if seed is None else seed
    signals = _signals(lesson, prepared, drive, registry) if drive is not None else {}
    columns = logged_columns(lesson, prepared.machinery, signals)
    effects = cast("dict[str, type[Effect]]", registry.effects)
    situations = [_situation(prepared, signals)]
    if validate:
        second = VALIDATION if VALIDATION in lesson.variants and not signals else None
        situations.append(_situation(prepare(lesson, registry, second), signals))
    made = partial(conceal, situations, columns, uncertain=_uncertain(lesson, prepared, tell), seed=seed, noise=noise)
    concealed = _drawn(made, prepared, effects, columns, seed, tell) if at_random else made([read_wish(text, effects) for text in asked])
    return concealed, publish(lesson, concealed, folder, place, seed=seed, noise=noise)


def _drawn(
    made: Callable[[list[HiddenWish]], Concealed],
    prepared: Prepared,
    effects: dict[str, type[Effect]],
    columns: list[LoggedColumn],
    seed: int,
    tell: Progress,
) -> Concealed:
    """Draw what is hidden, again where what was drawn cannot be seen."""
    compared = [column.target for column in columns if column.role == "compare"]
    for attempt in range(DRAWS):
        wishes = random_wishes(prepared.machinery, effects.values(), compared, np.random.default_rng([seed, 0, attempt]))
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
