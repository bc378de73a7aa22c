"""Questions of a lesson: whether an answer is right, and the file beside a record that keeps the answers.

A sealed answer is the SHA-256 of question and answer, see :func:`lathesim.json_text.digest_of`. A number is sealed as a whole number of
steps; the step is a twentieth of the tolerance. All steps within the tolerance of what a person wrote are tried, so that

    right  <=>  |written - answer| <= tolerance, to a step

The seal hides an answer from a reader of the file. It does not withstand a program that tries all answers.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lathesim.errors import LatheSimError, LessonError
from lathesim.json_text import digest_of, parsed_json
from lathesim.lessons.schema import LessonQuestion
from lathesim.units import quantity, split_quantity
from lathesim.whole_file import write_text

SCHEMA = "lathesim-answers/1"
_STEPS = 20
"""Steps of a tolerance."""


@dataclass(frozen=True)
class Answered:
    """The last answer to a question as it was written, and how often the question was answered."""

    question: str
    answer: str
    tries: int


@dataclass(frozen=True)
class QuestionResult:
    """A question with its answer: whether it is right, and how often it was answered; an empty answer is none."""

    question: str
    answer: str
    right: bool
    tries: int


def seal(question: LessonQuestion, answer: str) -> str:
    """Return the digest of an answer; raises :class:`LatheSimError` where a number has the wrong unit."""
    return _digest(question, answer if question.within is None else round(_number(question, answer) / _step(question)))


def is_right(question: LessonQuestion, answer: str) -> bool:
    """Return whether an answer is right; raises :class:`LessonError` where it is no answer to the question."""
    sealed = question.sealed if question.sealed is not None else seal(question, question.answer or "")
    if question.choices is not None:
        if answer not in question.choices:
            raise LessonError(f"'{answer}' is not among the choices.", remedy=f"Choose one of: {', '.join(question.choices)}.")
        return _digest(question, answer) == sealed
    place = _number(question, answer) / _step(question)
    return any(_digest(question, step) == sealed for step in range(math.ceil(place) - _STEPS, math.floor(place) + _STEPS + 1))


def results(questions: Sequence[LessonQuestion], answers: Mapping[str, Answered]) -> tuple[QuestionResult, ...]:
    """Return the questions with their answers; one that was not answered, or not in its unit, is not right."""
    found = []
    for question in questions:
        given = answers.get(question.ask, Answered(question.ask, "", 0))
        try:
            right = bool(given.answer) and is_right(question, given.answer)
        except LatheSimError:
            right = False
        found.append(QuestionResult(question.ask, given.answer, right, given.tries))
    return tuple(found)


def answers_file(record: Path) -> Path:
    """Return the file that keeps the answers beside a record."""
    return record.with_suffix(".answers.json")


def read_answers(record: Path) -> dict[str, Answered]:
    """Return the answers beside a record by their questions; none where the file is not there or cannot be read."""
    try:
        data = parsed_json(answers_file(record).read_text(encoding="utf-8"))
        found = [Answered(str(item["question"]), str(item["answer"]), int(item["tries"])) for item in data["answers"]]
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    return {item.question: item for item in found}


def keep_answer(record: Path, lesson: str, answers: Mapping[str, Answered], question: str, answer: str) -> dict[str, Answered]:
    """Write ``answers`` and one more beside a record, and return them; raises :class:`WriteError`."""
    before = answers.get(question)
    together = {**answers, question: Answered(question, answer, 1 + (before.tries if before is not None else 0))}
    data: dict[str, Any] = {"schema": SCHEMA, "lesson": lesson, "answers": [asdict(item) for item in together.values()]}
    write_text(answers_file(record), json.dumps(data, indent=2) + "\n")
    return together


def _digest(question: LessonQuestion, answer: str | int) -> str:
    return digest_of({"question": question.ask, "answer": answer})


def _step(question: LessonQuestion) -> float:
    return _number(question, question.within or "") / _STEPS


def _number(question: LessonQuestion, text: str) -> float:
    """Return the SI value of a text in the unit of the question."""
    return quantity(text, split_quantity(question.within or "")[1] or "1")
