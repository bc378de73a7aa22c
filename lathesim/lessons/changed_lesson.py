"""A lesson written out again: with effects inserted and values set, or as a class is given it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from lathesim.engine.assembly import of_part
from lathesim.lessons.case import case_of
from lathesim.lessons.insertion import effect_part_name
from lathesim.lessons.lesson import Lesson, find_program
from lathesim.lessons.part_values import table_file
from lathesim.shipped import shipped_files


def changed_lesson(
    lesson: Lesson,
    insert: Sequence[Mapping[str, str]],
    values: Mapping[str, str],
    folder: Path,
    *,
    variant: str | None = None,
    replace: Mapping[str, str] | None = None,
    further: Mapping[str, Any] | None = None,
    sizes: Mapping[str, str] | None = None,
) -> str:
    """Return the YAML text of a lesson with further ``insert:`` entries and ``set:`` values, for a file in ``folder``.

    ``replace`` puts other components into places, and the keys of ``further`` take the place of the lesson's (``program``, ``seed``,
    ``recordings`` ...). ``sizes`` are those of inserted effects, by their names ``part.parameter``.
    With a ``variant`` its changes become the lesson's own and the text has no variants: what runs is that variant with the other changes
    on top.

    A machine template, a part program or a recording that stands with the lesson is named by its way from the new folder, what came with
    lathesim by its name: the new lesson runs where it is written, and after both have moved together. Comments of the lesson are lost.
    """
    data: dict[str, Any] = yaml.safe_load(yaml.safe_dump(_plain(lesson.source.data)))
    if variant is not None:
        _take_variant(data, variant)
    if replace:
        data["replace"] = {**data.get("replace", {}), **replace}
    data |= further or {}
    if insert:
        data["insert"] = [*data.get("insert", []), *[dict(entry) for entry in insert]]
    _take_sizes(data, sizes or {})
    if values:
        data["set"] = {**data.get("set", {}), **values}
    if lesson.machine.path.resolve() not in {path.resolve() for path in shipped_files("lesson_configs/machines", "*.yaml")}:
        data["machine"] = _way(lesson.machine.path, folder)
    recording = data.get("recordings", {})
    if "file" in recording and (lesson.path.parent / recording["file"]).exists():
        recording["file"] = _way(lesson.path.parent / recording["file"], folder)
    shipped = {path.resolve() for path in shipped_files("part_programs", "*")}
    for changes in (data, *data.get("variants", {}).values()):
        for name, file in changes.get("tables", {}).items():
            if (lesson.path.parent / file).is_file():
                changes["tables"][name] = _way(lesson.path.parent / file, folder)
        if "program" in changes:
            found = find_program(changes["program"], lesson.path.parent)
            if found is not None:
                changes["program"] = found.name if found.resolve() in shipped else _way(found, folder)
    return lesson_text(data)


def lesson_text(data: Mapping[str, Any], comments: Sequence[str] = ()) -> str:
    """Return a lesson as YAML, with comments above it."""
    text: str = yaml.safe_dump(dict(data), sort_keys=False, allow_unicode=True, width=120)
    return "".join(f"# {line}\n" for line in comments) + text


def _take_sizes(data: dict[str, Any], sizes: Mapping[str, str]) -> None:
    """Write the sizes of inserted effects to their entries."""
    for entry in data.get("insert", []):
        part = str(entry.get("name", "")) or effect_part_name(str(entry["at"]), str(entry.get("effect", entry.get("remedy"))))
        entry.update(of_part(part, sizes))


def _take_variant(data: dict[str, Any], name: str) -> None:
    """Make the changes of a variant those of the lesson, as running the variant lays them over it, and drop all variants."""
    for key, entries in data.pop("variants", {}).get(name, {}).items():
        if key in ("text", "breaks_down"):
            continue
        before = data.get(key)
        if isinstance(entries, dict):
            data[key] = {**(before or {}), **entries}
        elif isinstance(entries, list):
            data[key] = [*(before or []), *entries]
        else:
            data[key] = entries


def _way(file: Path, folder: Path) -> str:
    """Return the way to a file from a folder, with all links followed, as whoever opens it goes."""
    return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()


def _plain(value: Any) -> Any:
    """Return nested mappings and lists as plain ones."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return str(value) if isinstance(value, str) else value


_KEPT = (
    "lesson", "text", "try", "machine", "dialect", "tools", "engine", "program", "duration", "sample_period", "step", "add",
    "units", "set", "replace", "wires", "every", "side", "tables", "start_point", "insert", "record", "recordings", "uncertain",
)  # fmt: skip
"""Keys that a class lesson has, in this order; variants, goals and published values stay behind."""
_TASKS = (
    "unit",
    "after",
    "minutes",
    "level",
    "learn",
    "seed",
    "plot",
    "read_outs",
    "variants",
    "goals",
    "questions",
    "tool_point",
    "alarms",
)
"""Further keys of the lesson of a student, who runs its cases too."""


class _Writer(yaml.SafeDumper):
    """Writes text of several lines as it is, and everything in full."""

    def ignore_aliases(self, data: Any) -> bool:
        """Write a value out each time: lessons have no aliases."""
        return True


def _text(writer: yaml.SafeDumper, value: str) -> yaml.ScalarNode:
    return writer.represent_scalar("tag:yaml.org,2002:str", value, style="|" if "\n" in value else None)


_Writer.add_representer(str, _text)


def class_lesson(lesson: Lesson, recordings: Mapping[str, Any], *, with_tasks: bool = False) -> str:
    """Return the YAML text of a lesson for a folder of its own, with ``recordings`` as its mapping; ``with_tasks`` also its tasks.

    A machine template or part program is named by its file alone: it has come with the program or lies beside (:func:`files_beside`).
    """
    data: dict[str, Any] = _plain(lesson.source.data)
    data["recordings"], data["machine"] = dict(recordings), lesson.machine.name
    for changes in (data, *data.get("variants", {}).values()):
        changes.pop("published", None)
        if "program" in changes:
            changes["program"] = Path(changes["program"]).name
        if "tables" in changes:
            changes["tables"] = {name: Path(file).name for name, file in changes["tables"].items()}
    keys = (*_KEPT, *_TASKS) if with_tasks else _KEPT
    kept = {name: data[name] for name in keys if data.get(name) not in (None, {})}
    return str(yaml.dump(kept, Dumper=_Writer, sort_keys=False, allow_unicode=True, width=120))


def files_beside(lesson: Lesson, *, with_tasks: bool = False) -> list[Path]:
    """Return the files that must lie beside a class lesson: its machine template, part programs and tables that did not come with lathesim.

    Those of its variants are among them if the lesson is written ``with_tasks``.
    """
    shipped = {path.resolve() for path in (*shipped_files("lesson_configs", "machines/*.yaml"), *shipped_files("part_programs", "*"))}
    cases = [case_of(lesson, variant) for variant in (None, *(lesson.variants if with_tasks else ()))]
    tables = [table_file(given.value, lesson.path.parent) for case in cases for given in case.changed.tables.values()]
    paths = dict.fromkeys((lesson.machine.path, *(case.program for case in cases)))
    files = [path for path in paths if path is not None and path.resolve() not in shipped]
    return files + list(dict.fromkeys(file for file in tables if file is not None))
