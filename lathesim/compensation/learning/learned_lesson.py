"""What was learned as files: the lesson with the corrections, one table an axis."""

from __future__ import annotations

from pathlib import Path

from lathesim.compensation.learning.laps import Course
from lathesim.compensation.learning.learn import Learning
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.part_tables import write_table
from lathesim.lessons.simulate import Prepared


def write_learned(prepared: Prepared, course: Course, learning: Learning, folder: Path) -> list[Path]:
    """Write the lesson that runs with what was learned, and its tables; return the files."""
    folder.mkdir(parents=True, exist_ok=True)
    files, tables, insert = [], {}, []
    for place, (loop, table) in enumerate(zip(course.loops, course.tables, strict=True)):
        part = table.partition(".")[0]
        file = folder / f"{part}.csv"
        write_table(file, ("correction",), learning.corrections[place][:, None])
        controller = next(item for item in course.machinery.parts if item.name == loop.controller)
        port = controller.component.ports["reading" if course.what == "voltage" else "drive"]
        insert.append({"remedy": "LearnedCorrection", "at": f"{loop.controller}.{port}", "name": part})
        tables[table] = file.name
        files.append(file)
    case = prepared.case
    lesson = case.lesson
    values = {name: str(given.value) for name, given in case.set.items() if given.place.startswith("--set")}
    before = dict(lesson.source.data.get("tables", {}))
    text = changed_lesson(lesson, insert, values, folder, variant=case.variant, further={"tables": {**before, **tables}})
    written = folder / "lesson.yaml"
    written.write_text(text, encoding="utf-8")
    return [written, *files]
