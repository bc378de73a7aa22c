"""Goals of a lesson held against what a run reached, and what else a lesson says about its runs.

What a lesson says about its runs beyond the machine: goals, published values, uncertainties and the mapping of recordings.

None of it changes a run, so a slip there would stay unseen; it is held against the machine and the metrics before anything runs.

Grading: the goals of a lesson held against what a run reached, for one record or for those of a whole class.

The goals are those of the lesson a teacher names, or of the lesson of the record's name where none is named; a record brings a copy of the
lesson it was made with, and where that copy differs the grade says so.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lathesim.analysis.failed_run import nothing_cut, unstable_loop
from lathesim.analysis.metric import Measured, Measurements, measure
from lathesim.component import Component, Input, Output, Parameter, State
from lathesim.engine.assembly import Assembly
from lathesim.errors import LatheSimError, LessonError, nearest
from lathesim.lessons.lesson import Lesson, find_lesson, present_name
from lathesim.lessons.part_values import declared_item, placed_at, si_in
from lathesim.lessons.questions import QuestionResult, read_answers, results
from lathesim.lessons.schema import ColumnEntry, DrivingSignal, Goal, LessonSettings
from lathesim.lessons.validation import validated
from lathesim.lessons.yaml_source import Location, YamlFile, read_source, source_of
from lathesim.plugins import Registry
from lathesim.record import Record, load
from lathesim.units import convertible, from_si, is_count, quantity, si_factor, split_quantity


def check_promises(lesson: Lesson, assembly: Assembly, registry: Registry) -> None:
    """Refuse (:class:`LessonError`) goals and published values of no metric, and names or units that the machine does not have."""
    settings = lesson.settings
    check_goals(settings, lesson.source, registry)
    parts = {part.name: part.component for part in assembly.parts}
    for key in ("plot", "read_outs"):
        for position, name in enumerate(getattr(settings, key)):
            declared_item(name, parts, (Output,), "output", lesson.source.place((key, position), key=True))
    for name, text in settings.uncertain.items():
        if name.startswith("tool_point."):
            continue  # of the cut, not of a part
        declared = declared_item(name, parts, (Parameter, State), "parameter", lesson.source.place(("uncertain", name), key=True))
        with placed_at(lesson.source.place(("uncertain", name))):
            share = split_quantity(text)[1] == "%"
        if not share:
            si_in(lesson.source, ("uncertain", name), text, declared.unit)
    _check_recordings(lesson, parts)


def check_goals(settings: LessonSettings, source: YamlFile, registry: Registry) -> None:
    """Refuse (:class:`LessonError`) goals and published values of no metric, or of another unit."""
    for position, goal in enumerate(settings.goals):
        location: Location = ("goals", position)
        unit = _metric_unit(source, goal.metric, (*location, "metric"), registry, key=False)
        for limit in ("at_most", "at_least"):
            if getattr(goal, limit) is not None:
                si_in(source, (*location, limit), getattr(goal, limit), unit)
    for position, question in enumerate(settings.questions):
        if question.choices is not None and question.answer not in (None, *question.choices):
            where = source.place(("questions", position, "answer"))
            raise LessonError(f"'{question.answer}' is not among the choices.", place=where, remedy="Write it as it stands there.")
        for key in ("within", "answer"):
            if question.within is not None and getattr(question, key) is not None:
                si_in(source, ("questions", position, key), getattr(question, key), split_quantity(question.within)[1] or "1")
    published: list[tuple[Mapping[str, str], Location]] = [(settings.published, ("published",))]
    published += [(variant.published, ("variants", name, "published")) for name, variant in settings.variants.items()]
    for entries, place in published:
        for metric, text in entries.items():
            si_in(source, (*place, metric), text, _metric_unit(source, metric, (*place, metric), registry, key=True))


def _check_recordings(lesson: Lesson, parts: Mapping[str, type[Component]]) -> None:
    recordings = lesson.settings.recordings
    if recordings is None:
        return
    if recordings.time.rate is not None:
        si_in(lesson.source, ("recordings", "time", "rate"), recordings.time.rate, "Hz")
    _same_kind(lesson, recordings.time.unit, "s", ("recordings", "time", "unit"))
    for name, signal in recordings.drive.items():
        location: Location = ("recordings", "drive", name)
        declared = declared_item(name, parts, (Input, Parameter), "input", lesson.source.place(location, key=True))
        _check_signal(lesson, signal, declared.unit, location)
    for name, shown in recordings.compare.items():
        location = ("recordings", "compare", name)
        declared = declared_item(name, parts, (Output,), "output", lesson.source.place(location, key=True))
        _check_signal(lesson, shown, declared.unit, location)


def _check_signal(lesson: Lesson, signal: ColumnEntry, unit: str, location: Location) -> None:
    if isinstance(signal, DrivingSignal) and signal.value is not None:
        si_in(lesson.source, (*location, "value"), signal.value, unit)
        with placed_at(lesson.source.place((*location, "unit"))):
            si_factor(signal.unit)
        for name, text in (("above", signal.above), ("until_below", signal.until_below)):
            if text is not None:
                si_in(lesson.source, (*location, name), text, signal.unit)
        if signal.lasting is not None:
            si_in(lesson.source, (*location, "lasting"), signal.lasting, "s")
        return
    if not is_count(signal.unit):  # their size is looked for when the columns are mapped
        _same_kind(lesson, signal.unit, unit, (*location, "unit"))
    if signal.resolution is not None:
        si_in(lesson.source, (*location, "resolution"), signal.resolution, unit)


def _same_kind(lesson: Lesson, given: str, unit: str, location: Location) -> None:
    place = lesson.source.place(location)
    with placed_at(place):
        same = convertible(given, unit)
    if not same:
        raise LessonError(f"the column is given in {given}, and {unit} is wanted.", place=place, remedy=f"Use a unit like {unit}.")


def _metric_unit(source: YamlFile, name: str, location: Location, registry: Registry, *, key: bool) -> str:
    metric: Any = registry.metrics.get(name)
    if metric is None:
        remedy = nearest(name, registry.metrics) or f"There are {', '.join(registry.metrics)}."
        raise LessonError(f"there is no metric '{name}'.", place=source.place(location, key=key), remedy=remedy)
    return str(metric.unit)


REACHED, MISSED, NO_GOALS, UNFINISHED, OTHER, UNREADABLE = "met", "missed", "no goals", "not finished", "another lesson", "unreadable"
_ORDER = (REACHED, MISSED, NO_GOALS, UNFINISHED, OTHER, UNREADABLE)


@dataclass(frozen=True)
class GoalResult:
    """One limit of a goal and what was reached: ``value`` and ``over`` (by how much the limit is missed, 0 where it is met) in ``unit``."""

    metric: str
    sense: str
    """``"at most"`` or ``"at least"``."""
    limit: str
    """The limit as the lesson has it, with its unit."""
    unit: str
    """The unit of the limit as written."""
    value: float
    """NaN where it could not be measured."""
    over: float
    hint: str
    reason: str = ""
    """Why it could not be measured, or is not judged."""
    is_judged: bool = True
    """Whether the run came to its end; a run that was stopped meets no goal."""

    @property
    def met(self) -> bool:
        """Whether the limit is kept."""
        return self.is_judged and self.over == 0.0

    @property
    def share(self) -> float:
        """By how much of the limit it is missed; NaN where the limit is 0 or nothing was measured."""
        limit = split_quantity(self.limit)[0]
        return abs(self.over / limit) if limit != 0.0 else math.nan


@dataclass(frozen=True)
class Yardstick:
    """The lesson that records are held against: its name, and what it says."""

    name: str
    settings: LessonSettings

    @property
    def title(self) -> str:
        """The title of the lesson."""
        return self.settings.lesson


@dataclass(frozen=True)
class Grade:
    """What became of one record: ``result`` is one of the words of this module, ``notes`` are sentences for the teacher."""

    record: str
    result: str
    lesson: str = ""
    variant: str = ""
    status: str = ""
    goals: tuple[GoalResult, ...] = ()
    notes: tuple[str, ...] = ()
    questions: tuple[QuestionResult, ...] = ()

    @property
    def right(self) -> int:
        """How many questions are answered right."""
        return sum(question.right for question in self.questions)

    @property
    def met(self) -> int:
        """How many limits are kept."""
        return sum(goal.met for goal in self.goals)

    @property
    def hints(self) -> tuple[str, ...]:
        """The hints of the goals that are missed, each once."""
        return tuple(dict.fromkeys(goal.hint for goal in self.goals if not goal.met and goal.hint))


@dataclass(frozen=True)
class Judgement:
    """The result of one run: ``result`` is ``REACHED``, ``MISSED``, ``NO_GOALS`` or ``UNFINISHED``."""

    result: str
    goals: tuple[GoalResult, ...]


def judge_run(goals: Sequence[Goal], measurements: Measurements, status: str, unstable: str = "") -> Judgement:
    """Return the judgement of one run. It reaches the goals if it came to its end and met all of them.

    ``unstable`` is a hint on an unstable loop. It replaces the hints of the goals, which are written for stable loops.
    """
    found = judge(goals, measurements.values, measurements.skipped)
    if unstable:
        found = tuple(replace(goal, hint=unstable) for goal in found)
    if status != "complete":
        reason = "the run was not finished"
        return Judgement(UNFINISHED, tuple(replace(goal, is_judged=False, reason=goal.reason or reason) for goal in found))
    if not found:
        return Judgement(NO_GOALS, found)
    return Judgement(REACHED if all(goal.met for goal in found) else MISSED, found)


def judge(goals: Sequence[Goal], metrics: Mapping[str, Measured], skipped: Mapping[str, str] | None = None) -> tuple[GoalResult, ...]:
    """Hold metrics against goals: one result for each limit, in order, with the first step of its hint.

    ``skipped`` gives reasons for metrics that are missing.
    """
    results = []
    for goal in goals:
        measured, hint = metrics.get(goal.metric), next(iter(goal.hint), "")
        for sense, text, sign in (("at most", goal.at_most, 1.0), ("at least", goal.at_least, -1.0)):
            if text is None:
                continue
            unit = split_quantity(text)[1]
            if measured is None or not math.isfinite(measured.value):
                reason = (skipped or {}).get(goal.metric, "not measured in this run" if measured is None else "no finite number")
                results.append(GoalResult(goal.metric, sense, text, unit, math.nan, math.nan, hint, reason))
                continue
            over = max(0.0, sign * (measured.value - quantity(text, measured.unit)))
            results.append(GoalResult(goal.metric, sense, text, unit, from_si(measured.value, unit), from_si(over, unit), hint))
    return tuple(results)


def yardstick(path_or_name: str | Path, registry: Registry) -> Yardstick:
    """Return the lesson a teacher names; :class:`LessonError` where it cannot be read or a goal of it cannot be measured."""
    path = find_lesson(path_or_name)
    return _yardstick(path.stem, read_source(path), registry)


def yardstick_of_record(record: Record, beside: Path, registry: Registry) -> Yardstick:
    """Return the lesson a record names: a file of that name beside it, in the current folder or shipped; else the copy in the record."""
    name = str(record.meta.get("lesson_name", ""))
    if re.fullmatch(r"[\w.-]+", name):
        for folder in (beside.parent, Path(), Path("lesson_configs")):
            if (folder / f"{name}.yaml").is_file():
                return yardstick(folder / f"{name}.yaml", registry)
        try:
            return yardstick(name, registry)
        except LessonError as error:
            if not error.fact.startswith("there is no lesson"):
                raise
    text = str(record.meta.get("lesson", ""))
    if not text.strip():
        raise LessonError("the record holds no lesson.", place=str(beside), remedy="Name the lesson before the records.")
    return _yardstick(name or beside.stem, source_of(text, f"the lesson in {beside}"), registry)


def grade_file(
    path: Path, registry: Registry, given: Yardstick | None = None, look: Callable[[Record], object] = lambda record: None
) -> Grade:
    """Grade the record in a file, and show it to ``look``.

    What cannot be read becomes a grade that says why, so that a class is graded to the end.
    """
    try:
        record = load(path)
        look(record)
        lesson = given or yardstick_of_record(record, path, registry)
        return replace(grade(record, str(path), lesson, registry), questions=results(lesson.settings.questions, read_answers(path)))
    except LatheSimError as error:
        reason = f"{error.fact} {error.remedy}".strip() if error.place == str(path) else str(error)
        return Grade(str(path), UNREADABLE, given.name if given else "", notes=(reason,))


def grade(record: Record, name: str, lesson: Yardstick, registry: Registry) -> Grade:
    """Hold a record against the goals of a lesson."""
    judgement = judge_run(lesson.settings.goals, measure(record, registry.metrics), record.status, unstable_loop(record))
    goals = judgement.goals
    variant = str(record.meta.get("variant", ""))
    ended = record.status
    finished = judgement.result != UNFINISHED
    notes = [] if finished else [f"The run was not finished: {ended.partition('. ')[0].rstrip('.')}."]
    if not _is_of(record, lesson):
        title, own = lesson_title(record), str(record.meta.get("lesson_name", ""))
        named = " ".join(item for item in (f"'{title}'" if title else "", f"({own})" if own else "") if item)
        notes.append(f"The record is of another lesson{f': {named}' if named else ''}.")
        return Grade(name, OTHER, lesson.name, variant, ended, goals, tuple(notes))
    notes += _differences(record, lesson)
    told = nothing_cut(record) if finished else ""
    notes += [f"{told[0].upper()}{told[1:]}"] if told else []
    return Grade(name, judgement.result, lesson.name, variant, ended, goals, tuple(notes))


def ranked(grades: Sequence[Grade]) -> list[Grade]:
    """Return grades with the best first: by lesson, result, number of goals met, then by what the first goal asks for, then by name."""
    return sorted(grades, key=_merit)


def _merit(graded: Grade) -> tuple[str, int, int, float, str]:
    first = 0.0
    if graded.goals and math.isfinite(graded.goals[0].value):
        first = graded.goals[0].value if graded.goals[0].sense == "at most" else -graded.goals[0].value
    return (graded.lesson, _ORDER.index(graded.result), -graded.met, first, graded.record)


def _yardstick(name: str, source: YamlFile, registry: Registry) -> Yardstick:
    settings = validated(LessonSettings, source)
    check_goals(settings, source, registry)
    return Yardstick(name, settings)


def _is_of(record: Record, lesson: Yardstick) -> bool:
    """Return whether a record was made with a lesson, under its present or a former name, or with a copy of it: name or title agree."""
    return present_name(str(record.meta.get("lesson_name"))) == lesson.name or lesson_title(record) == lesson.title


def lesson_title(record: Record) -> str:
    """Return the title of the lesson in a record, or an empty text."""
    settings = lesson_in(record)
    return settings.lesson if settings is not None else ""


def lesson_in(record: Record) -> LessonSettings | None:
    """Return the lesson that a record holds a copy of; none where it holds none that can be read."""
    try:
        return validated(LessonSettings, source_of(str(record.meta.get("lesson", "")), "record"))
    except LatheSimError:
        return None


_FOR_READERS = ("lesson", "text", "try_", "published", "unit", "after", "minutes", "level", "learn", "plot", "read_outs")
"""Keys of a lesson that change neither a run nor what is asked of it."""


def _differences(record: Record, lesson: Yardstick) -> list[str]:
    """Return in what the run differs from the lesson as it stands, as far as the record tells."""
    notes = []
    if record.meta.get("overrides"):
        notes.append(f"Set: {record.meta['overrides']}.")
    own = lesson_in(record)
    if own is None:
        return [*notes, "The record holds no copy of its lesson."]
    changed = [
        field.alias or name
        for name, field in LessonSettings.model_fields.items()
        if name not in _FOR_READERS and getattr(own, name) != getattr(lesson.settings, name)
    ]
    if changed:
        notes.append(f"Its copy of the lesson differs in {', '.join(changed)}.")
    variant = str(record.meta.get("variant", ""))
    chosen = own.variants[variant].program if variant in own.variants else None
    expected, ran = chosen or own.program, str(record.meta.get("program", ""))
    if expected and ran and Path(expected).name != Path(ran).name:
        notes.append(f"Another part program: {Path(ran).name}.")
    return notes


def spreadsheet_cell(text: str) -> str:
    """Return text from a file so that a spreadsheet takes it for text, never for a formula, and a terminal for no command.

    Source: OWASP, CSV Injection.
    """
    plain = "".join(character if character.isprintable() else "?" for character in text)
    return f"'{plain}" if plain.lstrip()[:1] in ("=", "+", "-", "@") else plain
