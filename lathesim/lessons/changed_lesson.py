"""A lesson written out again with effects inserted and values set: what a diagnosis found, ready to run."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from lathesim.lessons.lesson import Lesson, find_program
from lathesim.shipped import shipped_files


def changed_lesson(lesson: Lesson, insert: Sequence[Mapping[str, str]], values: Mapping[str, str], folder: Path) -> str:
    """Give the YAML text of a lesson with further ``insert:`` entries and ``set:`` values, for a file in ``folder``.

    A machine template or part program beside the lesson is named by its way from the new folder, a part program that came with lathesim by
    its name. Comments of the lesson are lost.
    """
    data: dict[str, Any] = yaml.safe_load(yaml.safe_dump(_plain(lesson.source.data)))
    if insert:
        data["insert"] = [*data.get("insert", []), *[dict(entry) for entry in insert]]
    if values:
        data["set"] = {**data.get("set", {}), **values}
    if Path(str(data["machine"])).suffix in (".yaml", ".yml"):
        data["machine"] = os.path.relpath(lesson.machine.path, folder)
    shipped = {path.resolve() for path in shipped_files("part_programs", "*")}
    for changes in (data, *data.get("variants", {}).values()):
        if "program" in changes:
            found = find_program(changes["program"], lesson.path.parent)
            if found is not None:
                changes["program"] = found.name if found.resolve() in shipped else os.path.relpath(found, folder)
    text: str = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=120)
    return text


def _plain(value: Any) -> Any:
    """Give nested mappings and lists as plain ones."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return str(value) if isinstance(value, str) else value
