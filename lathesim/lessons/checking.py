"""Check a whole lesson: all its cases, and its own entries that every variant overrides, so that no case contains them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from lathesim.component import Component
from lathesim.engine.assembly import Place
from lathesim.errors import LessonError
from lathesim.lessons.assemble import assemble_case
from lathesim.lessons.case import case_of
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import seconds
from lathesim.lessons.simulate import prepare
from lathesim.plugins import Registry


def check_lesson(lesson: Lesson, registry: Registry) -> dict[str, type[Component]]:
    """Return the parts of all cases by name.

    Raises :class:`LessonError` if a case cannot be prepared, or if an overridden entry of the lesson itself is faulty.
    """
    itself = case_of(lesson)
    prepared = [prepare(lesson, registry, variant) for variant in lesson.variants or (None,)]
    for case in (itself, *(item.case for item in prepared)):
        if case.duration is not None:
            seconds(case.duration)
    for key, name in _always_overridden(lesson):
        given = getattr(itself, key)[name]
        case = case_of(lesson, _without_change(lesson, {Place.of(name).part, Place.of(str(given.value)).part}))
        changed: dict[str, Any] = {key: {**getattr(case, key), name: given}}
        try:
            assemble_case(dataclasses.replace(case, **changed), registry)
        except LessonError as error:
            if error.place in (given.place, given.key_place):
                raise
    return {part.name: part.component for item in prepared for part in item.machinery.parts}


def _always_overridden(lesson: Lesson) -> Iterator[tuple[str, str]]:
    """Yield key and name of the entries of a lesson that all its variants override."""
    variants = lesson.settings.variants.values()
    for key in ("set", "wires", "tables"):
        for name in getattr(lesson.settings, key):
            if variants and all(name in getattr(variant, key) for variant in variants):
                yield key, name


def _without_change(lesson: Lesson, parts: set[str]) -> str | None:
    """Return the name of a variant that leaves ``parts`` unchanged, or none if every variant changes one."""
    return next((name for name, variant in lesson.settings.variants.items() if not parts & {*variant.replace, *variant.units}), None)
