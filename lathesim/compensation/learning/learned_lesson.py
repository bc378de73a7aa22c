"""What was learned as files: the lesson with the corrections, one table an axis."""

from __future__ import annotations

from pathlib import Path

from lathesim.compensation.learning.laps import Course
from lathesim.compensation.learning.learn import Learning
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.part_tables import table_text
from lathesim.lessons.simulate import Prepared
from lathesim.whole_file import WholeFiles, make_folder


def write_learned(prepared: Prepared, course: Course, learning: Learning, folder: Path) -> list[Path]:
    """Write the lesson with the learned corrections and its tables, all or none, and return the files."""
    make_folder(folder)
    contents: dict[Path, str] = {}
    tables, insert = {}, []
    for place, (loop, table) in enumerate(zip(course.loops, course.tables, strict=True)):
        part = table.partition(".")[0]
        file = folder / f"{part}.csv"
        unit = next(item for item in course.machinery.parts if item.name == part).component.declarations["samples"].unit
        contents[file] = table_text(("correction",), learning.corrections[place][:, None], unit)
        controller = next(item for item in course.machinery.parts if item.name == loop.controller)
        port = controller.component.ports["reading" if course.what == "voltage" else "drive"]
        insert.append({"remedy": "LearnedCorrection", "at": f"{loop.controller}.{port}", "name": part})
        tables[table] = file.name
    case = prepared.case
    lesson = case.lesson
    values = {name: str(given.value) for name, given in case.set.items() if given.place.startswith("--set")}
    before = dict(lesson.source.data.get("tables", {}))
    text = changed_lesson(lesson, insert, values, folder, variant=case.variant, further={"tables": {**before, **tables}})
    with WholeFiles() as whole:
        for file, content in [*contents.items(), (folder / "lesson.yaml", text)]:
            whole.write_text(file, content)
    return [folder / "lesson.yaml", *contents]
