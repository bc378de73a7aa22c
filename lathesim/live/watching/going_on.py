"""The lesson with which a watch goes on after a diagnosis: what was named belongs to the machine from then on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.insertion import effect_part_name
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.live.watching.effects.known_effects import KnownEffects
from lathesim.plugins import Registry


def with_named(prepared: Prepared, answer: Mapping[str, Any], known: KnownEffects, registry: Registry, place: Path) -> Prepared:
    """Return the lesson's machine with what a diagnosis (its JSON) names, written to ``place`` as a lesson too.

    An effect that stands at its place already gets the size that is ``known`` of it now. Raises what :func:`prepare` raises.
    """
    standing = {(str(entry.effect), str(entry.at)) for entry in prepared.case.lesson.settings.insert}
    new = [dict(entry) for entry in answer.get("insert", []) if (str(entry["effect"]), str(entry["at"])) not in standing]
    text = changed_lesson(prepared.case.lesson, new, {}, place.parent, variant=prepared.case.variant)
    place.write_text(with_sizes(text, known.texts()), encoding="utf-8")
    return prepare(load_lesson(str(place)), registry)


def with_sizes(text: str, sizes: Mapping[str, str]) -> str:
    """Return the text of a lesson whose inserted effects have other ``sizes``, by their names ``part.parameter``."""
    data = yaml.safe_load(text)
    for entry in data.get("insert", []):
        part = str(entry.get("name", "")) or effect_part_name(str(entry["at"]), str(entry.get("effect", entry.get("remedy"))))
        entry.update({name.rpartition(".")[2]: value for name, value in sizes.items() if name.rpartition(".")[0] == part})
    return yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=120)
