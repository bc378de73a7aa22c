"""The lesson with which a watch goes on after a diagnosis: what was named belongs to the machine from then on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.insertion import effect_part_name
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry


def with_named(prepared: Prepared, answer: Mapping[str, Any], registry: Registry, place: Path) -> Prepared:
    """Return the lesson's machine with what a diagnosis (its JSON) names, written to ``place`` as a lesson too.

    An effect that stands at its place already gets a part of its own beside it. Raises what :func:`prepare` raises.
    """
    parts = {part.name for part in prepared.machinery.parts}
    entries = []
    for entry in answer.get("insert", []):
        name = plain = str(entry.get("name", "")) or effect_part_name(str(entry["at"]), str(entry["effect"]))
        number = 2
        while name in parts:
            name, number = f"{plain}_{number}", number + 1
        parts.add(name)
        entries.append(dict(entry) if name == plain else {**entry, "name": name})
    text = changed_lesson(prepared.case.lesson, entries, {}, place.parent, variant=prepared.case.variant)
    place.write_text(text, encoding="utf-8")
    return prepare(load_lesson(str(place)), registry)
