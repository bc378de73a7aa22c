"""The lessons of a course: the files there are, the names they had before, and their order by units."""

from __future__ import annotations

import csv
import functools
import typing
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from lathesim.shipped import shipped_folder

if TYPE_CHECKING:
    from lathesim.lessons.lesson import Lesson


def lesson_files(folder: Path | None = None) -> Iterator[Path]:
    """Return the lesson files in ``./lesson_configs`` and those that came with lathesim, or those in a folder; each name once."""
    seen: set[str] = set()
    for place in [folder] if folder is not None else [Path("lesson_configs"), shipped_folder("lesson_configs")]:
        for path in sorted([*place.glob("*.yaml"), *place.glob("*.yml")]):
            if path.name not in seen:
                seen.add(path.name)
                yield path


@functools.cache
def former_names() -> dict[str, str]:
    """Return the former names of shipped lessons with their present names."""
    with (shipped_folder("lesson_configs") / "tables" / "former_names.csv").open(encoding="utf-8", newline="") as file:
        return {row["former"]: row["present"] for row in csv.DictReader(file)}


def present_name(name: str) -> str:
    """Return the present name of a lesson that is called by its present or a former one."""
    return former_names().get(name, name)


def by_unit(lessons: Iterable[Lesson]) -> dict[str, list[Lesson]]:
    """Return lessons by the units of the course, in its order; those without a unit come last, under an empty name."""
    from lathesim.lessons.schema import CourseUnit

    listed = list(lessons)
    units = {unit: [lesson for lesson in listed if (lesson.settings.unit or "") == unit] for unit in (*typing.get_args(CourseUnit), "")}
    return {unit: found for unit, found in units.items() if found}
