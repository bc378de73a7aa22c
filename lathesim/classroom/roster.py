"""The students of a class, as a list from a spreadsheet names them, and the places of their work.

A list is data: a name becomes a folder only if it consists of letters, digits, ``_`` and ``-``; other names get a digest in its place.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lathesim.errors import RecordingError
from lathesim.json_text import read_json
from lathesim.whole_file import write_text

SCHEMA = "lathesim-class/1"
LARGEST = 1 << 22
"""Bytes of the longest list that is read."""
_HEADINGS = {
    "id": ("id", "student_id", "student id", "id number", "idnumber", "sid", "username", "matriculation number"),
    "last_name": ("last_name", "last name", "surname"),
    "first_name": ("first_name", "first name"),
    "email": ("email", "email address", "e-mail"),
    "name": ("name", "full name"),
}
"""Headings of lists as Moodle, nbgrader, Gradescope and people write them; the first one of a student is the key."""
_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,39}")
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)", re.IGNORECASE)
"""Names that Windows keeps for devices."""


@dataclass(frozen=True)
class Student:
    """A student: the ``id`` by which grades are handed back, and what the list says besides."""

    id: str
    last_name: str = ""
    first_name: str = ""
    email: str = ""

    @property
    def folder(self) -> str:
        """The name of the student's folder: the id, if it is one word; else its letters and a digest."""
        if _PLAIN.fullmatch(self.id) and not _DEVICES.fullmatch(self.id):
            return self.id
        word = re.sub(r"[^A-Za-z0-9]+", "_", self.id).strip("_")[:20]
        return f"{word or 'student'}_{hashlib.sha256(self.id.encode()).hexdigest()[:8]}"


@dataclass(frozen=True)
class ClassFolder:
    """A class on the disk: the folders that students get, and beside them what stays with the teacher."""

    path: Path

    @property
    def file(self) -> Path:
        """The file that says what the class is about and who is in it."""
        return self.path / "class.json"

    @property
    def students(self) -> Path:
        """The folder whose folders are handed out."""
        return self.path / "students"

    def kept(self, student: Student, ending: str) -> Path:
        """Return a file about a student that stays with the teacher."""
        return self.path / "teacher" / f"{student.folder}{ending}"

    def read(self) -> dict[str, Any]:
        """Return what the file of the class says; :class:`RecordingError` where it is none."""
        data = read_json(self.file, SCHEMA, "file of the class", "students")
        return {**data, "students": [Student(**item) for item in data["students"]]}

    def write(self, about: Mapping[str, Any], students: Sequence[Student]) -> None:
        """Write the file of the class."""
        write_text(self.file, json.dumps({"schema": SCHEMA, **about, "students": [asdict(item) for item in students]}, indent=2) + "\n")


def read_students(file: Path) -> list[Student]:
    """Return the students of a CSV file with headings; :class:`RecordingError` where it has no students, or one twice."""
    heads, *rows = _rows(file)
    columns = {key: next((heads.index(name) for name in names if name in heads), None) for key, names in _HEADINGS.items()}
    key = next((name for name in ("id", "email", "name") if columns[name] is not None), None)
    if key is None:
        remedy = "Write them in the first line, for example: id,last_name,first_name,email"
        raise RecordingError("no column is headed 'id', 'email' or 'name'.", place=f"{file}:1", remedy=remedy)
    found: dict[str, Student] = {}
    for line, row in enumerate(rows, 2):
        said = {name: row[place] if place is not None and place < len(row) else "" for name, place in columns.items()}
        student = Student(said[key], said["last_name"] or said["name"], said["first_name"], said["email"])
        if not any(row):
            continue
        if not student.id:
            raise RecordingError("the student has no id.", place=f"{file}:{line}", remedy=f"Write one in the column '{key}'.")
        if found.setdefault(student.folder.casefold(), student) is not student:
            raise RecordingError(f"'{student.id}' is in the list twice.", place=f"{file}:{line}", remedy="Remove one of the lines.")
    if not found:
        raise RecordingError("the list has no students.", place=str(file), remedy="Write a line for each student below the headings.")
    return list(found.values())


def _rows(file: Path) -> list[list[str]]:
    """Return the cells of a CSV file without what steers a terminal: the headings in small letters, then the rows."""
    try:
        if file.stat().st_size > LARGEST:
            raise RecordingError("the list is too long for a class.", place=str(file), remedy="Name the CSV file of the students.")
        text = file.read_text(encoding="utf-8-sig")
        rows = list(csv.reader(io.StringIO(text), delimiter=max(",;\t", key=text.partition("\n")[0].count), strict=True)) or [[]]
    except OSError as error:
        raise RecordingError(f"the list cannot be read: {error.strerror}.", place=str(file)) from None
    except UnicodeDecodeError:
        raise RecordingError("the list is no UTF-8 text.", place=str(file), remedy="Save it as CSV in UTF-8.") from None
    except csv.Error as error:
        raise RecordingError(f"the list is no CSV: {error}.", place=str(file)) from None
    cells = [["".join(letter for letter in cell if letter.isprintable()).strip() for cell in row] for row in rows]
    return [[cell.lower() for cell in cells[0]], *cells[1:]]
