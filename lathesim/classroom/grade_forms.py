"""The grades of a class as tables: one of its own, and those that Moodle, nbgrader and Gradescope read.

Texts of students are written so that no spreadsheet takes them for formulas. Sources: Moodle Docs, Grade import; nbgrader, the columns of
its CSV export plug-in; Gradescope, Autograder Specifications (results.json).
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from lathesim.classroom.class_grades import MOST, StudentGrade
from lathesim.lessons.grading import spreadsheet_cell
from lathesim.whole_file import make_folder, write_text

_PEOPLE = ("student_id", "last_name", "first_name", "email")
GRADES = (*_PEOPLE, "handed_in", "result", "goals_met", "goals", "answers_right", "questions", "diagnosis", "marks", "copied", "notes")
NBGRADER = (
    "assignment", "duedate", "timestamp", "student_id", "last_name", "first_name", "email", "raw_score", "late_submission_penalty", "score",
    "max_score",
)  # fmt: skip


def write_forms(folder: Path, lesson: str, grades: Sequence[StudentGrade], copied: Mapping[str, Sequence[str]]) -> list[Path]:
    """Write the tables to ``folder`` and return their files: grades.csv, moodle.csv, nbgrader.csv and gradescope/STUDENT/results.json."""
    own, moodle, nbgrader = [], [], []
    for item in grades:
        person = (item.student.id, item.student.last_name, item.student.first_name, item.student.email)
        remarks = " ".join(copied.get(item.student.id, ())), " ".join(item.notes)
        numbers = (item.result, item.goals_met, item.goals, item.answers_right, item.questions, item.diagnosis, item.marks)
        own.append((*person, "yes" if item.files else "no", *numbers, *remarks))
        feedback = f"Goals {item.goals_met} of {item.goals}, answers {item.answers_right} of {item.questions}. {remarks[1]}".strip()
        moodle.append((item.student.id, item.student.email, item.marks if item.files else "-", feedback if item.files else item.result))
        nbgrader.append((lesson, "", "", *person, item.marks, 0.0, item.marks, MOST))
        tests = [
            {"name": "goals", "status": "passed" if item.goals_met == item.goals else "failed", "output": item.result},
            {"name": "questions", "output": f"{item.answers_right} of {item.questions} right"},
        ]
        place = make_folder(folder / "gradescope" / item.student.folder)
        result = {"score": item.marks, "output": remarks[1], "tests": [{**test, "visibility": "after_published"} for test in tests]}
        write_text(place / "results.json", json.dumps(result, indent=2) + "\n")
    return [
        write_text(folder / "grades.csv", _table(GRADES, own)),
        write_text(folder / "moodle.csv", _table(("ID number", "Email address", f"{lesson} (Real)", f"{lesson} (Feedback)"), moodle)),
        write_text(folder / "nbgrader.csv", _table(NBGRADER, nbgrader)),
        folder / "gradescope",
    ]


def _table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows([spreadsheet_cell(cell) if isinstance(cell, str) and cell != "-" else cell for cell in row] for row in rows)
    return text.getvalue()
