"""What a class handed in, graded: runs against goals, answers, diagnoses, who handed nothing in, and what was copied.

A record counts only if it was made on the student's own machine: its copy of the lesson has the values that were drawn for the student.
What is read of a student is small and kept beside the class, so that a grading that was stopped goes on where it was.

The tables are one of its own, and those that Moodle, nbgrader and Gradescope read. Texts of students are written so that no spreadsheet
takes them for formulas. Sources: Moodle Docs, Grade import; nbgrader, the columns of its CSV export plug-in; Gradescope, Autograder
Specifications (results.json).
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
import os
import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

from lathesim.classroom.roster import ClassFolder, Student
from lathesim.classroom.teacher_notes import Weights
from lathesim.cluster import Cluster
from lathesim.errors import LatheSimError
from lathesim.exercises.graded_diagnosis import grade, read_guess
from lathesim.exercises.sealed_answer import ANSWER, file_digest
from lathesim.json_text import digest_of, plain, read_json
from lathesim.lessons.grading import Grade, Yardstick, grade_file, lesson_in, ranked, spreadsheet_cell, yardstick
from lathesim.plugins import Registry
from lathesim.record import Record
from lathesim.units import quantity, split_quantity
from lathesim.whole_file import make_folder, write_text

SCHEMA = "lathesim-class-grade/1"
NOTHING, NO_RECORD, FOREIGN = "nothing handed in", "no record", "another machine"
"""Results beside those of :mod:`lathesim.lessons.grading`."""
MOST_FILES = 40
"""Files of one student that are read."""
_SENT_AT_ONCE = 32
"""Students whose files are on the way to a cluster at the same time: a record may take many megabytes."""
BY_CHANCE = 0.05
"""How often at most a number that is called copied would be another student's by chance."""
_SAME = 1e-3
"""Share by which two people round the same number differently."""
MOST = 100.0
"""Marks of a work without a fault."""
RIGHT, PARTLY, WRONG = "right", "partly right", "wrong"
_SHARES = {RIGHT: 1.0, PARTLY: 0.5}
"""Shares of the marks for a diagnosis."""
_RECORDS = (".h5", ".hdf5")
_PEOPLE = ("student_id", "last_name", "first_name", "email")
GRADES = (*_PEOPLE, "handed_in", "result", "goals_met", "goals", "answers_right", "questions", "diagnosis", "marks", "copied", "notes")
NBGRADER = (
    "assignment", "duedate", "timestamp", "student_id", "last_name", "first_name", "email", "raw_score", "late_submission_penalty", "score",
    "max_score",
)  # fmt: skip


@dataclass(frozen=True)
class StudentGrade:
    """The work of a student: digests of its ``files``, what it reached, and its ``marks`` of 100.

    ``prints`` tell works apart: by file the samples of a record and the machine it was made on, the diagnosis, and the answers.
    """

    student: Student
    files: Mapping[str, str]
    result: str = NOTHING
    goals_met: int = 0
    goals: int = 0
    answers_right: int = 0
    questions: int = 0
    diagnosis: str = ""
    marks: float = 0.0
    notes: tuple[str, ...] = ()
    prints: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


def grade_class(folder: Path, registry: Registry, handed_in: Path | None = None, cluster: Cluster | None = None) -> Iterator[StudentGrade]:
    """Yield the grade of each student of a class, whose work lies in the folder of that name in ``handed_in``.

    With a ``cluster`` they come as its workers end them.
    What was graded before and has not changed since is not read again. Raises :class:`RecordingError` where the folder has no class.
    """
    place = ClassFolder(folder)
    about = place.read()
    weights = Weights(**about["weights"])
    waiting = []
    for student in about["students"]:
        work = (handed_in or place.students) / student.folder
        files = {file.relative_to(work).as_posix(): file_digest(file) for file in _work(work)}
        graded = _kept(place.kept(student, "_grade.json"), student, files)
        if graded is None:
            graded = StudentGrade(student, files)
            if files:
                answer = read_json(place.kept(student, ".json"), ANSWER, "answer", "values")
                given = (graded, work, answer, yardstick(place.kept(student, ".yaml"), registry))
                if cluster is not None:
                    waiting.append(given)
                    continue
                graded = _graded(*given, registry, weights)
            _keep(place, graded)
        yield graded
    for first in range(0, len(waiting), _SENT_AT_ONCE):
        some = waiting[first : first + _SENT_AT_ONCE]
        calls = [(graded, {name: (work / name).read_bytes() for name in graded.files}, *rest) for graded, work, *rest in some]
        assert cluster is not None
        for _, graded in cluster.results(_graded_there, (registry, weights), calls):
            _keep(place, graded)
            yield graded


def _keep(place: ClassFolder, graded: StudentGrade) -> None:
    write_text(place.kept(graded.student, "_grade.json"), json.dumps({"schema": SCHEMA, "grade": plain(graded)}, indent=2) + "\n")


def _graded_there(
    shared: tuple[Registry, Weights], given: tuple[StudentGrade, Mapping[str, bytes], Mapping[str, Any], Yardstick]
) -> StudentGrade:
    """Return the grade of a work whose files came along, on a worker."""
    graded, files, answer, lesson = given
    with tempfile.TemporaryDirectory(prefix="lathesim-work-") as work:
        for name, content in files.items():
            file = Path(work) / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content)
        return _graded(graded, Path(work), answer, lesson, *shared)


def _work(folder: Path) -> list[Path]:
    """Return the records and JSON files of a student, without links: what they lead to may be the work of others."""
    found = []
    for top, _, names in os.walk(folder):
        paths = [Path(top) / name for name in names if name.lower().endswith((*_RECORDS, ".json")) and name != "seal.json"]
        found += [path for path in paths if path.is_file() and not path.is_symlink()]
    return sorted(found)[:MOST_FILES]


def _kept(file: Path, student: Student, files: Mapping[str, str]) -> StudentGrade | None:
    """Return the grade that was kept of the same files, none where there is none."""
    try:
        data = read_json(file, SCHEMA, "grade", "grade")["grade"]
        found = StudentGrade(**{**data, "student": Student(**data["student"]), "notes": tuple(data["notes"])})
    except (LatheSimError, TypeError, KeyError):
        return None
    return found if (found.student, found.files) == (student, files) else None


def _graded(
    graded: StudentGrade, work: Path, answer: Mapping[str, Any], lesson: Yardstick, registry: Registry, weights: Weights
) -> StudentGrade:
    samples, machines = dict[str, str](), dict[str, str]()
    grades: dict[str, Grade] = {}
    for name in (name for name in graded.files if name.lower().endswith(_RECORDS)):

        def look(record: Record, name: str = name) -> None:
            samples[name], machines[name] = _samples(record), _machine(record, list(answer["values"]))

        grades[name] = grade_file(work / name, registry, lesson, look)
    own = [item for name, item in grades.items() if machines.get(name) == digest_of(answer["values"])]
    best = next(iter(ranked(own) or ranked(list(grades.values()))), Grade("", NO_RECORD))
    questions = max((item.questions for item in grades.values()), key=lambda found: sum(one.right for one in found), default=())
    diagnosis, numbers, notes = _diagnosis(work, list(graded.files), answer)
    notes += [f"Only the first {MOST_FILES} files were read."] if len(graded.files) == MOST_FILES else []
    found = replace(
        graded,
        result=best.result if own or not machines else FOREIGN,
        goals_met=best.met if own else 0,
        goals=len(best.goals),
        answers_right=sum(one.right for one in questions),
        questions=len(lesson.settings.questions),
        diagnosis=diagnosis,
        notes=(*best.notes, *notes),
        prints={
            "true": {one.ask: text for one, text in zip(lesson.settings.questions, answer.get("answers", ()), strict=False) if one.within},
            "samples": samples,
            "machines": machines,
            "diagnosis": {"": numbers} if numbers else {},
            "right": {one.question: one.answer for one in questions if one.right},
            "wrong": {one.question: one.answer for one in questions if one.answer and not one.right},
        },
    )
    return replace(found, marks=_marks(found, lesson, weights, "recording.csv" in answer["files"]))


def _marks(found: StudentGrade, lesson: Yardstick, weights: Weights, is_recorded: bool) -> float:
    """Return the marks of 100; a kind of work that the lesson does not have does not count."""
    shares = (
        (weights.goals * bool(lesson.settings.goals), found.goals_met / max(1, found.goals)),
        (weights.questions * bool(lesson.settings.questions), found.answers_right / max(1, found.questions)),
        (weights.diagnosis * is_recorded, _SHARES.get(found.diagnosis, 0.0)),
    )
    return round(MOST * sum(weight * share for weight, share in shares) / (sum(weight for weight, _ in shares) or 1.0), 2)


def _samples(record: Record) -> str:
    """Return the digest of what a record measured, whatever its file is called and says besides."""
    text = hashlib.sha256(record.time.tobytes())
    for name in sorted(record.channels):
        text.update(name.encode() + record[name].tobytes())
    return text.hexdigest()


def _machine(record: Record, names: Sequence[str]) -> str:
    """Return the digest of the values with which a record was made; empty where the command line changed one."""
    lesson = lesson_in(record)
    changed = set(re.findall(r"([\w.]+)=", str(record.meta.get("overrides", ""))))
    return "" if lesson is None or changed & set(names) else digest_of({name: lesson.set.get(name, "") for name in names})


def _diagnosis(work: Path, files: Sequence[str], answer: Mapping[str, Any]) -> tuple[str, str, list[str]]:
    """Return how right a diagnosis is, the digest of its numbers, and what is to be said of it."""
    found = []
    for name in files:
        try:
            found += [(name, read_guess(work / name))] if name.endswith(".json") and not name.endswith(".answers.json") else []
        except LatheSimError:
            continue
    if not found:
        return "", "", []
    name, guess = found[0]
    graded = grade(answer, guess)
    verdict = RIGHT if graded.right else PARTLY if any(item.named or item.tied for item in graded.effects) else WRONG
    numbers = [[item["effect"], item.get("parameters")] for item in guess["effects"] if item.get("parameters")]
    several = [f"{len(found)} diagnoses were handed in, and {name} counts."] if len(found) > 1 else []
    return verdict, digest_of(numbers) if numbers else "", [*several, graded.sentence]


def copies(folder: Path, grades: Sequence[StudentGrade]) -> dict[str, list[str]]:
    """Return what looks copied, in sentences by the student's id: equal records and diagnoses, and answers for the machine of another."""
    place = ClassFolder(folder)
    book = [split_quantity(text)[0] for text in place.read()["answers"] if re.match(r"[-+.\d]", text)]
    owners = {
        digest_of(read_json(place.kept(item.student, ".json"), ANSWER, "answer", "values")["values"]): item.student.id for item in grades
    }
    found: dict[str, list[str]] = {item.student.id: [] for item in grades}
    for kind, what in (("samples", "record"), ("diagnosis", "diagnosis")):
        together: dict[str, list[str]] = {}
        for item in grades:
            for digest in set(item.prints.get(kind, {}).values()):
                together.setdefault(digest, []).append(item.student.id)
        for members in together.values():
            for one in members if len(members) > 1 else ():
                found[one].append(f"The same {what} as that of {', '.join(other for other in members if other != one)}.")
    for item in grades:
        own = item.student.id
        theirs = {name: owners.get(digest, own) for name, digest in item.prints.get("machines", {}).items()}
        found[own] += [f"{name} was made on the machine of {owner}." for name, owner in theirs.items() if owner != own]
        found[own] += _borrowed(item, grades, book)
    return found


def _borrowed(item: StudentGrade, grades: Sequence[StudentGrade], book: Sequence[float]) -> Iterator[str]:
    """Yield numbers that another student wrote too, and that fit the machine of the other better; not those of the lesson's own machine.

    A number with the last digit r equals one of n numbers that spread over S by chance in about n r/S of all cases.
    """
    for question, own in item.prints.get("true", {}).items():
        text = item.prints["right"].get(question) or item.prints["wrong"].get(question, "")
        answers = {one.student.id: one.prints["true"][question] for one in grades if question in one.prints.get("true", {})}
        try:
            (number, unit), own_unit = split_quantity(text), split_quantity(own)[1]
            true = {name: quantity(answer, own_unit) for name, answer in answers.items()}
            off = {name: abs(value - quantity(text, own_unit)) for name, value in true.items()}
            digit = quantity(f"1e{Decimal(text.strip().removesuffix(unit).strip()).as_tuple().exponent} {unit}", own_unit)
        except (LatheSimError, ArithmeticError):
            continue
        same = [one.student.id for one in grades if one.prints.get("right", {}).get(question) == text]
        source = min(same, key=lambda name: off[name], default=item.student.id)
        spread = max(true.values()) - min(true.values())
        by_chance = len(true) * digit / spread if spread else 1.0
        of_the_book = any(math.isclose(number, known, rel_tol=_SAME) for known in book)
        if off[source] < off[item.student.id] and by_chance <= BY_CHANCE and not of_the_book:
            yield f"The answer {text} is that of {source}, whose machine it fits better. Chance does that in {by_chance:.1%} of all cases."


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
