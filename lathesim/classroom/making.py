"""A machine of their own for each student of a class: values and a hidden effect are drawn, equally hard for everybody.

All draws of a student follow from the seed of the class and the student's id, so that the same machine comes again, whoever else is in the
class. How hard a machine is:

    with an effect    floors by which the hidden effect moves the channel that shows it best, at ``HIDDEN.floors``
    without           shares of the limits by which the lesson's case misses its goals, in all as the lesson's own machine does

Both lie within ``HIDDEN.within`` of the number that is wanted. On a machine without a hidden
effect the teacher's solution meets the goals.
"""

from __future__ import annotations

import hashlib
import math
import secrets
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.analysis.metric import Measured
from lathesim.classroom.roster import ClassFolder, Student
from lathesim.classroom.teacher_notes import COPY_NOTES, AnswerNote, TeacherNotes, notes_file, teacher_notes, with_tables
from lathesim.component import Parameter
from lathesim.errors import LessonError, RecordingError
from lathesim.exercises.class_folder import VALIDATION, Hiding, conceal_case, publish
from lathesim.exercises.conceal import DRAWS, Concealed, Difficulty
from lathesim.exercises.logger import logged_columns
from lathesim.exercises.sealed_answer import ANSWER
from lathesim.json_text import digest_of, read_json
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.grading import judge
from lathesim.lessons.lesson import Lesson, lesson_from_text
from lathesim.lessons.questions import seal
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.lessons.sweep_executors import run_here
from lathesim.lessons.sweep_runs import Member, Members
from lathesim.lessons.sweep_table import written_unit
from lathesim.plugins import Registry
from lathesim.units import from_si, quantity, split_quantity
from lathesim.whole_file import make_folder, write_text

HIDDEN = Difficulty(floors=100.0)
"""How hard a hidden effect is to find."""
_WITHOUT = "Leave --effect out."
_OF_UNCERTAIN = 2.0
"""Standard deviations of an uncertain value within which the values of students lie."""


@dataclass(frozen=True)
class MadeMachine:
    """The machine of a student: how hard it is, and whether it was made ``before``, by a call that was stopped."""

    student: Student
    difficulty: float
    before: bool = False


@dataclass(frozen=True)
class _Spread:
    """A value of the machine and how far the values of students lie from it [SI], and the ``unit`` in which the lesson writes it."""

    name: str
    given: float
    half_width: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class _Desk:
    """What the machines of a class have in common."""

    lesson: Lesson
    registry: Registry
    notes: TeacherNotes
    spreads: tuple[_Spread, ...]
    folder: ClassFolder
    seed: int
    asked: tuple[str, ...]

    def seed_of(self, student: Student) -> int:
        return int(digest_of({"class": self.seed, "lesson": self.lesson.name, "student": student.id})[:12], 16)

    def values(self, student: Student, attempt: int) -> dict[str, str]:
        """Return the values of a student as the lesson writes them."""
        rng = np.random.default_rng([self.seed_of(student), 3, attempt])
        drawn = {}
        for item in self.spreads:
            value = float(np.clip(item.given + item.half_width * rng.uniform(-1.0, 1.0), item.low, item.high))
            drawn[item.name] = f"{from_si(value, item.unit):.5g} {item.unit}".removesuffix(" 1")
        return drawn

    def si(self, values: Mapping[str, str]) -> tuple[float, ...]:
        """Return the values of a student [SI]."""
        return tuple(quantity(values[item.name], item.unit) for item in self.spreads)


def make_class(
    lesson: Lesson, registry: Registry, students: Sequence[Student], folder: Path, *, asked: Sequence[str] = (), seed: int | None = None
) -> Iterator[MadeMachine]:
    """Make the machines of a class in ``folder``, and yield each as soon as it is there; what an earlier call made comes first.

    ``asked`` are effects of which each student gets one, as ``lathesim conceal --effect`` takes them; without it any usual one is drawn.
    Raises :class:`LessonError` where the lesson has no values to vary, and :class:`RecordingError` where the folder is of another class.
    """
    place, notes = ClassFolder(folder), teacher_notes(lesson)
    about = {"lesson": lesson.name, "digest": hashlib.sha256(lesson.text.encode()).hexdigest(), "asked": list(asked)}
    hiding = hides_effects(lesson, asked)
    prepared = prepare(lesson, registry)
    _check_effects(lesson, prepared, asked if hiding else ())
    before: dict[str, Any] = (
        place.read() if place.file.exists() else {**about, "seed": secrets.randbits(48) if seed is None else seed, "students": []}
    )
    if {key: before[key] for key in about} != about or seed not in (None, before["seed"]):
        raise RecordingError("the folder has another class.", place=str(place.file), remedy="Choose another folder with --out.")
    together = {student.id: student for student in [*before["students"], *students]}
    desk = _Desk(lesson, registry, notes, _spreads(lesson, prepared, notes), place, before["seed"], tuple(asked))
    for part in (folder / "teacher", place.students):
        make_folder(part)
    further = {"seed": desk.seed, "weights": notes.weights.model_dump(), "answers": [note.answer for note in notes.answers]}
    place.write({**about, **further}, list(together.values()))
    left = []
    for student in together.values():
        kept = place.kept(student, ".json")
        if kept.is_file() and (place.students / student.folder / "seal.json").is_file():
            yield MadeMachine(student, read_json(kept, ANSWER, "answer", "difficulty")["difficulty"], before=True)
        else:
            kept.unlink(missing_ok=True)  # the folder of the student was lost or never finished
            left.append(student)
    yield from _hidden(desk, left) if hiding else _shown(desk, left)


def hides_effects(lesson: Lesson, asked: Sequence[str]) -> bool:
    """Return whether the machines of a class hide an effect: those that were ``asked`` for, or any, if the recordings can show one."""
    return bool(asked) or (lesson.settings.recordings is not None and teacher_notes(lesson).hidden)


def _check_effects(lesson: Lesson, prepared: Prepared, asked: Sequence[str]) -> None:
    """Refuse (:class:`LessonError`) effects for a lesson in which nothing can be hidden."""
    if asked and lesson.settings.recordings is None:
        raise LessonError("the lesson has no recordings, so nothing can be hidden in it.", place=str(lesson.path), remedy=_WITHOUT)
    if asked:
        try:
            logged_columns(lesson, prepared.machinery, {})
        except LessonError as error:
            raise LessonError(error.fact, place=str(lesson.path), remedy=_WITHOUT) from None


def _spreads(lesson: Lesson, prepared: Prepared, notes: TeacherNotes) -> tuple[_Spread, ...]:
    """Return the values that vary: those of the teacher's notes, else those that the lesson calls uncertain."""
    plan = prepared.plan
    entries = notes.vary or {name: text for name, text in lesson.settings.uncertain.items() if not name.startswith("tool_point.")}
    if not entries:
        remedy = f"Write them in {notes_file(lesson)}: vary: {{x_axis.mass: 5 %}}. {COPY_NOTES}"
        raise LessonError("nothing says which values differ in a class.", place=str(lesson.path), remedy=remedy)
    found = []
    for name, text in entries.items():
        kind, _ = plan.settable(name)
        declared = plan.declaration(name)
        if kind != "parameter" or not isinstance(declared, Parameter):
            raise LessonError(f"{name} is no parameter, so it cannot differ in a class.", place=str(lesson.path))
        given = plan.values[name]
        number, unit = split_quantity(text)
        width = abs(given * number / 100.0) if unit == "%" else quantity(text, declared.unit)
        width *= 1.0 if notes.vary else _OF_UNCERTAIN
        found.append(_Spread(name, given, width, declared.low, declared.high, written_unit(name, prepared) or declared.unit))
    return tuple(found)


def _hidden(desk: _Desk, students: Sequence[Student]) -> Iterator[MadeMachine]:
    """Make machines that hide an effect in a recording."""
    for student in students:
        values, seed = desk.values(student, 0), desk.seed_of(student)
        own, answers = _own_lesson(desk, values)
        asked = [desk.asked[seed % len(desk.asked)]] if desk.asked else []
        concealed, _ = conceal_case(
            own,
            desk.registry,
            desk.folder.students / student.folder,
            Hiding(asked, not asked, desk.folder.kept(student, ".json"), VALIDATION in own.variants, seed=seed),
            wanted=HIDDEN,
            further=partial(_kept, student, values, answers),
        )
        yield MadeMachine(student, _clearness(concealed))


def _shown(desk: _Desk, students: Sequence[Student]) -> Iterator[MadeMachine]:
    """Make machines whose values stand in the lesson."""
    by_number = dict(enumerate(students))
    for number, values, difficulty in _as_hard(desk, by_number):
        student = by_number[number]
        own, answers = _own_lesson(desk, values)
        nothing = Concealed((), (), (), (), {}, {})
        place, kept = desk.folder.students / student.folder, desk.folder.kept(student, ".json")
        further = _kept(student, values, answers, difficulty)
        publish(own, nothing, place, kept, seed=desk.seed_of(student), noise=0.0, further=further, with_tasks=True)
        yield MadeMachine(student, difficulty)


def _as_hard(desk: _Desk, students: Mapping[int, Student]) -> Iterator[tuple[int, dict[str, str], float]]:
    """Yield number, values and difficulty of students whose machines are as hard as the lesson's own, in rounds of draws."""
    solution, goals = desk.notes.solution, desk.lesson.settings.goals
    variant = solution.variant if solution is not None else next(iter(desk.lesson.variants), None)
    metrics = {goal.metric: desk.registry.metric(goal.metric) for goal in goals}
    names = tuple(item.name for item in desk.spreads)

    def difficulty(member: Member) -> float:
        """Return the shares by which a run misses its goals, added up; infinity where one could not be measured."""
        found = zip(metrics.items(), member.metrics, strict=True)
        results = judge(goals, {name: Measured(name, value, metric.unit) for (name, metric), value in found if math.isfinite(value)})
        return sum(math.inf if math.isnan(goal.over) else goal.share for goal in results if not goal.met)

    with tempfile.TemporaryDirectory(prefix="lathesim-class-") as folder:
        case = solved = Members(prepare(desk.lesson, desk.registry, variant), names, metrics)
        if solution is not None:
            program = write_text(Path(folder) / "solution.nc", solution.program) if solution.program else None
            lesson = with_tables(desk.lesson, solution)
            solved = Members(prepare(lesson, desk.registry, variant, dict(solution.set), program=program), names, metrics)
        wanted = difficulty(case.run(0, [item.given for item in desk.spreads]))
        left = dict(students)
        for attempt in range(DRAWS):
            drawn = {number: desk.values(student, attempt) for number, student in left.items()}
            jobs = [(number, desk.si(values)) for number, values in drawn.items()]
            hard = {member.number: difficulty(member) for member in run_here(case, jobs)}
            # two that miss a goal by an unknown share are equally hard
            good = [job for job in jobs if hard[job[0]] == wanted or abs(hard[job[0]] - wanted) <= HIDDEN.within * wanted]
            for member in run_here(solved, good):
                if solution is None or difficulty(member) == 0.0:
                    yield member.number, drawn[member.number], hard[member.number]
                    del left[member.number]
            if not left:
                return
    fact = f"{DRAWS} draws gave no machine for {len(left)} students that is as hard as the lesson's and that the solution solves."
    raise LessonError(fact, place=str(notes_file(desk.lesson)), remedy="Let the values vary less, or mend the solution.")


def _own_lesson(desk: _Desk, values: Mapping[str, str]) -> tuple[Lesson, list[str]]:
    """Return the lesson with the values of a student and sealed answers that follow them, and these answers."""
    given = {item.name: item for item in desk.spreads}
    answers, questions = [], []
    notes = [*desk.notes.answers, *[None] * len(desk.lesson.settings.questions)]
    for question, note in zip(desk.lesson.settings.questions, notes, strict=False):
        note = note or (AnswerNote(answer=question.answer) if question.answer is not None else None)
        answers.append(_followed(note, given, values) if note is not None else "")
        entry: dict[str, Any] = question.model_dump(exclude_none=True, exclude={"answer", "sealed"})
        questions.append({**entry, "sealed": seal(question, answers[-1]) if answers[-1] else question.sealed})
    further: dict[str, Any] = {"questions": questions} if questions else {}
    if "tool_point" in desk.lesson.source.data:
        further["tool_point"] = _repeated(desk.lesson.source.data["tool_point"], given, values)
    return lesson_from_text(changed_lesson(desk.lesson, [], values, desk.lesson.path.parent, further=further), desk.lesson.path), answers


def _repeated(entry: Any, given: Mapping[str, _Spread], values: Mapping[str, str]) -> Any:
    """Return a tool point in which each value that repeats one of the machine is that of the student."""
    if isinstance(entry, list):
        return [_repeated(item, given, values) for item in entry]
    if not isinstance(entry, Mapping):
        return entry

    def own(key: str, item: Any) -> Any:
        alike = (name for name in values if name.endswith(f".{key}") and isinstance(item, str))
        name = next((name for name in alike if math.isclose(quantity(item, given[name].unit), given[name].given)), None)
        return _repeated(item, given, values) if name is None else values[name]

    return {key: own(key, item) for key, item in entry.items()}


def _followed(note: AnswerNote, given: Mapping[str, _Spread], values: Mapping[str, str]) -> str:
    """Return an answer for the values of a student, with five digits where it is a number that follows them."""
    factor = 1.0
    for name, power in note.follows.items():
        if name in values:
            factor *= (quantity(values[name], given[name].unit) / given[name].given) ** power
    if factor == 1.0:
        return note.answer
    number, unit = split_quantity(note.answer)
    return f"{number * factor:.5g} {unit}".strip()


def _clearness(concealed: Concealed) -> float:
    return max(concealed.moves.values(), default=0.0)


def _kept(student: Student, values: Mapping[str, str], answers: Sequence[str], hard: Concealed | float) -> dict[str, Any]:
    """Return what the answer of a student says besides what is hidden."""
    difficulty = _clearness(hard) if isinstance(hard, Concealed) else hard
    return {"student": student.id, "values": dict(values), "answers": list(answers), "difficulty": difficulty}
