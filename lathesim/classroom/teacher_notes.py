"""What a teacher keeps of a lesson in ``teacher/LESSON.yaml`` beside it: answers, a solution, marking weights, and what differs in a class.

Nothing of it goes to the folder of a student. A lesson without notes has none of them, and the usual weights.
"""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import Lesson, lesson_from_text
from lathesim.lessons.schema import FileModel, PartItem, Quantity, Text
from lathesim.lessons.validation import validated
from lathesim.lessons.yaml_source import read_source

FOLDER = "teacher"
COPY_NOTES = "'lathesim init FOLDER --teacher' copies the notes on the lessons that come with lathesim."
"""What helps where a lesson has no notes."""


class AnswerNote(FileModel):
    """The answer to a question. In a class it ``follows`` values of the machine: it is proportional to each to the power given here."""

    answer: Quantity
    follows: dict[PartItem, float] = Field(default_factory=dict)


class SolutionNote(FileModel):
    """A run that meets the goals: a case of the lesson with values, tables, or a part program, of one's own."""

    variant: Text | None = None
    set: dict[PartItem, Quantity] = Field(default_factory=dict)
    tables: dict[PartItem, Text] = Field(default_factory=dict)
    program: Text = ""


class Weights(FileModel):
    """Marks for each kind of work; a kind that the lesson does not have drops out, and the others make up all marks."""

    goals: float = Field(default=60.0, ge=0.0)
    questions: float = Field(default=20.0, ge=0.0)
    diagnosis: float = Field(default=20.0, ge=0.0)


class TeacherNotes(FileModel):
    """The notes of a lesson: answers in the order of its questions, and values that ``vary`` in a class, each by a share of itself.

    A lesson with recordings hides an effect for each student, unless ``hidden`` is false: its recordings may be too coarse to show one.
    """

    answers: list[AnswerNote] = Field(default_factory=list)
    solution: SolutionNote | None = None
    weights: Weights = Weights()
    vary: dict[PartItem, Quantity] = Field(default_factory=dict)
    hidden: bool = True
    notes: Text = ""


def notes_file(lesson: Lesson) -> Path:
    """Return where the notes of a lesson are kept."""
    return lesson.path.parent / FOLDER / f"{lesson.name}.yaml"


def teacher_notes(lesson: Lesson) -> TeacherNotes:
    """Return the notes of a lesson, empty ones where it has none; :class:`LessonError` where they are faulty."""
    file = notes_file(lesson)
    return validated(TeacherNotes, read_source(file, what="teacher's notes")) if file.is_file() else TeacherNotes()


def with_tables(lesson: Lesson, solution: SolutionNote) -> Lesson:
    """Return the lesson with the tables of a solution."""
    if not solution.tables:
        return lesson
    tables = {**lesson.settings.tables, **solution.tables}
    return lesson_from_text(changed_lesson(lesson, [], {}, lesson.path.parent, further={"tables": tables}), lesson.path)
