"""The lesson that a class is given: a lesson with another mapping of recordings, and without what would give the case away."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from lathesim.lessons.case import case_of
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_tables import table_file
from lathesim.shipped import shipped_files

_KEPT = (
    "lesson", "text", "try", "machine", "dialect", "tools", "engine", "program", "duration", "sample_period", "step", "add",
    "units", "set", "replace", "wires", "every", "side", "tables", "start_point", "insert", "record", "recordings", "uncertain",
)  # fmt: skip
"""Keys that a class lesson has, in this order; variants, goals and published values stay behind."""


class _Writer(yaml.SafeDumper):
    """Writes text of several lines as it is, and everything in full."""

    def ignore_aliases(self, data: Any) -> bool:
        """Write a value out each time: lessons have no aliases."""
        return True


def _text(writer: yaml.SafeDumper, value: str) -> yaml.ScalarNode:
    return writer.represent_scalar("tag:yaml.org,2002:str", value, style="|" if "\n" in value else None)


_Writer.add_representer(str, _text)


def class_lesson(lesson: Lesson, recordings: Mapping[str, Any]) -> str:
    """Return the YAML text of a lesson for a folder of its own, with ``recordings`` as its mapping.

    A machine template or part program is named by its file alone: it has come with the program or lies beside (:func:`files_beside`).
    """
    data = {**lesson.source.data, "recordings": dict(recordings)}
    data["machine"] = lesson.machine.name
    program = case_of(lesson).program
    if program is not None:
        data["program"] = program.name
    if "tables" in data:
        data["tables"] = {name: Path(file).name for name, file in data["tables"].items()}
    kept = {name: data[name] for name in _KEPT if name in data}
    return str(yaml.dump(kept, Dumper=_Writer, sort_keys=False, allow_unicode=True, width=120))


def files_beside(lesson: Lesson) -> list[Path]:
    """Return the files that must lie beside a class lesson: its machine template and part program where they did not come with lathesim."""
    shipped = {path.resolve() for path in (*shipped_files("lesson_configs", "machines/*.yaml"), *shipped_files("part_programs", "*"))}
    program = case_of(lesson).program
    tables = [table_file(given.value, lesson.path.parent) for given in case_of(lesson).tables.values()]
    files = [path for path in (lesson.machine.path, program) if path is not None and path.resolve() not in shipped]
    return files + list(dict.fromkeys(file for file in tables if file is not None))
