"""A lesson as a Jupyter notebook: its text, a cell that runs each case, its tasks, and its questions with a place for the answer.

The file is JSON in the notebook format 4.5. Source: Jupyter, "The Notebook file format" (nbformat.readthedocs.io). Solutions are left out.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from lathesim.classroom.sheet import goal_texts
from lathesim.errors import WriteError
from lathesim.lessons.lesson import Lesson, find_lesson
from lathesim.lessons.schema import LessonQuestion
from lathesim.units import split_quantity
from lathesim.whole_file import write_text

ENDING = ".ipynb"


def write_notebook(path: Path, lesson: Lesson) -> None:
    """Write a lesson as a notebook. Raises :class:`WriteError` where the name does not end with ``.ipynb``."""
    if path.suffix.lower() != ENDING:
        raise WriteError(f"a notebook cannot be written as '{path.suffix}'.", place=str(path), remedy=f"Use {ENDING}.")
    write_text(path, notebook_text(_texts(lesson, path.parent)))


def notebook_text(cells: Iterable[tuple[str, str]]) -> str:
    """Return a notebook of cells, each with its kind (``code`` or ``markdown``) and its text, as JSON."""
    metadata = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}, "language_info": {"name": "python"}}
    made = [_cell(number, kind, text) for number, (kind, text) in enumerate(cells)]
    return json.dumps({"cells": made, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}, indent=1) + "\n"


def _cell(number: int, kind: str, text: str) -> dict[str, Any]:
    name = hashlib.sha256(f"{number} {text}".encode()).hexdigest()[:8]
    cell: dict[str, Any] = {"cell_type": kind, "id": name, "metadata": {}, "source": text.strip("\n").splitlines(keepends=True)}
    return cell | ({"execution_count": None, "outputs": []} if kind == "code" else {})


def _texts(lesson: Lesson, folder: Path) -> Iterator[tuple[str, str]]:
    """Yield the kind and the text of each cell."""
    settings = lesson.settings
    yield "markdown", f"# {settings.lesson}\n\n{settings.learn}\n\n{settings.text}"
    yield "code", f"import lathesim as ls\n\nlesson = ls.lesson({_name(lesson, folder)!r})"
    if settings.goals:
        yield "markdown", "\n".join(["## Goals of your run", "", *(f"- {goal}" for goal in goal_texts(lesson))])
    for name in lesson.variants or (None,):
        text = settings.variants[name].text if name else ""
        yield "markdown", f"## Case {name}\n\n{text}" if name else "## A run"
        yield "code", _run(lesson, name, "")
    for number, task in enumerate(settings.try_, 1):
        yield "markdown", f"## Task {number}\n\n{task}"
        yield "code", _run(lesson, next(iter(lesson.variants), None), "set={}")
    for number, question in enumerate(settings.questions, 1):
        yield from _asked(number, question)


def _name(lesson: Lesson, folder: Path) -> str:
    """Return by what a notebook in ``folder`` finds the lesson: its name, or the way to its file."""
    known = find_lesson(lesson.name) if lesson.path.parent.name == "lesson_configs" else None
    return lesson.name if known == lesson.path else Path(os.path.relpath(lesson.path, folder)).as_posix()


def _run(lesson: Lesson, variant: str | None, changed: str) -> str:
    """Return the code that runs a case, measures what its goals ask for, and draws it."""
    call = f"lesson.run({', '.join([*([f'variant={variant!r}'] if variant else []), *([changed] if changed else [])])})"
    note = '  # such as set={"part.value": "5 mm"}' if changed else ""
    runs = [f"record = {call}{note}"]
    if variant and lesson.settings.variants[variant].breaks_down:
        runs = ["try:", f"    record = {call}", "except Exception as error:", "    print(error)", "    record = error.record"]
    metrics = list(dict.fromkeys(goal.metric for goal in lesson.settings.goals))
    measured = ["found = ls.measure(record)", f"print({{name: str(found.get(name)) for name in {metrics}}})"] if metrics else []
    return "\n".join([*runs, *measured, f"record.plot({', '.join(map(repr, lesson.settings.plot))})"])


def _asked(number: int, question: LessonQuestion) -> Iterator[tuple[str, str]]:
    if question.choices is not None:
        choices = "".join(f"\n- {choice}" for choice in question.choices)
        yield "markdown", f"## Question {number}\n\n{question.ask}\n{choices}"
        note = "one of the choices"
    else:
        yield "markdown", f"## Question {number}\n\n{question.ask}"
        note = f"a number with its unit, such as 1.5 {split_quantity(question.within or '1')[1]}".rstrip()
    yield "code", f'answer = ""  # {note}\nif answer:\n    print("Right." if lesson.is_right({number}, answer) else "Not yet right.")'
