"""The lesson with which a watch goes on after a diagnosis: what was named belongs to the machine from then on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.live.watching.effects.known_effects import KnownEffects
from lathesim.plugins import Registry
from lathesim.whole_file import write_text


def with_named(prepared: Prepared, answer: Mapping[str, Any], known: KnownEffects, registry: Registry, place: Path) -> Prepared:
    """Return the lesson's machine with what a diagnosis (its JSON) names, written to ``place`` as a lesson too.

    An effect that stands at its place already gets the size that is ``known`` of it now. Raises what :func:`prepare` raises.
    """
    standing = {(str(entry.effect), str(entry.at)) for entry in prepared.case.lesson.settings.insert}
    new = [dict(entry) for entry in answer.get("insert", []) if (str(entry["effect"]), str(entry["at"])) not in standing]
    text = changed_lesson(prepared.case.lesson, new, {}, place.parent, variant=prepared.case.variant, sizes=known.texts())
    write_text(place, text)
    return prepare(load_lesson(str(place)), registry)
