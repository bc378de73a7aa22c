"""What is known to differ from the plain machine: effects and their sizes, and the lesson with which a watch goes on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Place
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.insertion import effect_part_name
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.plugins import Registry
from lathesim.whole_file import write_text


@dataclass(frozen=True)
class FollowedSize:
    """A size of an inserted effect: ``effect`` at ``at``, its ``parameter``, the ``value`` [SI] of the lesson, the ``neutral`` value at
    which the effect vanishes, and its ``unit``."""

    effect: str
    at: str
    parameter: str
    value: float
    neutral: float
    unit: str

    @property
    def scale(self) -> float:
        """Return the scale on which it is followed [SI]: the size itself, or 0 where it has none.

        A smaller one would drown in the quantisation of the sensors, and sensitivities that are noise make a size seem to move less.
        """
        return min(abs(self.value - self.neutral), abs(self.value) or abs(self.neutral))


def followed_sizes(prepared: Prepared, registry: Registry) -> dict[str, FollowedSize]:
    """Return the sizes of the effects that the lesson inserts by their names ``part.parameter``."""
    plan, found = prepared.plan, {}
    for entry in prepared.case.lesson.settings.insert:
        part = str(entry.name) or effect_part_name(str(entry.at), str(entry.effect))
        for name, neutral in neutral_values(registry, str(entry.effect)).items():
            if f"{part}.{name}" in plan.parameters:
                value = plan.values[f"{part}.{name}"]
                unit = plan.parts[part].component.declarations[name].unit
                found[f"{part}.{name}"] = FollowedSize(str(entry.effect), str(entry.at), name, value, neutral, unit)
    return found


def scales(sizes: Mapping[str, FollowedSize]) -> dict[str, float]:
    """Return the scales of those that can be followed: an effect of no size has no sensitivity."""
    return {name: size.scale for name, size in sizes.items() if size.scale > 0.0}


def neutral_values(registry: Registry, name: str) -> Mapping[str, float]:
    """Return the values at which an effect vanishes."""
    effect = registry.effect(name)
    return effect.neutral if issubclass(effect, Effect) else {}


@dataclass(frozen=True)
class MovedSize:
    """A size of an effect [SI]: what it ``was``, what it ``is``, and the value at which the effect vanishes (``neutral``)."""

    was: float
    now: float
    neutral: float
    unit: str

    def with_more(self, found: float) -> MovedSize:
        """Return the size with what was found besides: what vanishes at 0 adds up, factors multiply, of two limits the lower holds."""
        more = self.now + found if self.neutral == 0.0 else self.now * found if self.neutral == 1.0 else min(self.now, found)
        return replace(self, now=more)


@dataclass(frozen=True)
class KnownEffect:
    """An effect at a place: the ``part`` that it is, its ``sizes`` by parameter, ``since`` and ``until`` when it grew [s], and whether it
    was ``found`` while the machine was watched, or to have changed."""

    effect: str
    at: str
    part: str
    sizes: Mapping[str, MovedSize]
    since: float
    until: float
    found: bool

    @property
    def name(self) -> str:
        """Return what it is called in a sentence."""
        return f"{self.effect} at {self.at}"

    def course(self) -> str:
        """Return how its sizes went."""
        return ", ".join(
            f"{name} from {size.was:.4g} to about {size.now:.4g} {size.unit}".rstrip() for name, size in self.sizes.items()
        )  # fmt: skip


class KnownEffects:
    """Keeps what is known. ``grown`` adds what a diagnosis found to it, and returns what was known before and is larger now."""

    def __init__(self, prepared: Prepared, registry: Registry) -> None:
        self._registry = registry
        self._known: dict[tuple[str, str], KnownEffect] = {}
        for name, followed in followed_sizes(prepared, registry).items():
            key = _key(followed.effect, followed.at)
            known = self._known.get(key, KnownEffect(followed.effect, followed.at, Place.of(name).part, {}, 0.0, 0.0, False))
            size = MovedSize(followed.value, followed.value, followed.neutral, followed.unit)
            self._known[key] = replace(known, sizes={**known.sizes, followed.parameter: size})

    def texts(self) -> dict[str, str]:
        """Return the sizes of all effects as a lesson takes them, by their names ``part.parameter``."""
        return {
            f"{known.part}.{name}": f"{size.now:.8g} {size.unit}".removesuffix(" 1").rstrip()
            for known in self._known.values()
            for name, size in known.sizes.items()
        }

    @property
    def changed(self) -> list[KnownEffect]:
        """Return what was named while the machine was watched, and what grew, in the order in which it was found."""
        return [effect for effect in self._known.values() if effect.found]

    @property
    def drift(self) -> bool:
        """Return whether an effect drifts that was found, or that the lesson had."""
        return any(effect.until > effect.since for effect in self.changed)

    def drifting_since(self, followed: FollowedSize) -> float | None:
        """Return since when [s] an effect drifts that was found to do so; None for one that stepped, or that the lesson holds."""
        known = self._known.get(_key(followed.effect, followed.at))
        return known.since if known is not None and known.found and known.until > known.since else None

    def moved(self, followed: FollowedSize, value: float, since: float, until: float) -> KnownEffect:
        """Take the size [SI] of a known effect as it is at ``until`` [s], having moved ``since`` [s]; return the effect."""
        key = _key(followed.effect, followed.at)
        known = self._known[key]
        size = replace(known.sizes[followed.parameter], now=value)
        begun = known.since if known.found else since
        self._known[key] = replace(known, sizes={**known.sizes, followed.parameter: size}, since=begun, until=until, found=True)
        return self._known[key]

    def grown(self, answer: Mapping[str, Any], since: float, until: float) -> list[KnownEffect]:
        """Take the effects of a diagnosis (its JSON) of what changed from ``since`` to ``until`` [s]; return those known before."""
        grown = []
        inserted = {
            _key(str(entry["effect"]), str(entry["at"])): str(entry.get("name") or effect_part_name(str(entry["at"]), str(entry["effect"])))
            for entry in answer.get("insert", [])
        }
        for entry in answer.get("effects", []):
            effect, at = str(entry.get("effect", "")), str(entry.get("at", ""))
            if _key(effect, at) not in inserted:
                continue
            known = self._known.get(_key(effect, at))
            found = {name: (float(item["value"]), str(item["unit"])) for name, item in entry.get("parameters", {}).items()}
            if known is None:
                neutral = neutral_values(self._registry, effect)
                sizes = {
                    name: MovedSize(neutral[name], value, neutral[name], unit) for name, (value, unit) in found.items() if name in neutral
                }
                self._known[_key(effect, at)] = KnownEffect(effect, at, inserted[_key(effect, at)], sizes, since, until, True)
                continue
            sizes = {name: size.with_more(found[name][0]) if name in found else size for name, size in known.sizes.items()}
            begun = known.since if known.found else since
            self._known[_key(effect, at)] = replace(known, sizes=sizes, since=begun, until=until, found=True)
            grown.append(self._known[_key(effect, at)])
        return grown


def _key(effect: str, at: str) -> tuple[str, str]:
    return effect, Place.of(at).part


def with_named(prepared: Prepared, answer: Mapping[str, Any], known: KnownEffects, registry: Registry, place: Path) -> Prepared:
    """Return the lesson's machine with what a diagnosis (its JSON) names, written to ``place`` as a lesson too.

    An effect that stands at its place already gets the size that is ``known`` of it now. Raises what :func:`prepare` raises.
    """
    standing = {(str(entry.effect), str(entry.at)) for entry in prepared.case.lesson.settings.insert}
    new = [dict(entry) for entry in answer.get("insert", []) if (str(entry["effect"]), str(entry["at"])) not in standing]
    write_text(place, changed_lesson(prepared.case.lesson, new, {}, place.parent, variant=prepared.case.variant, sizes=known.texts()))
    return prepare(load_lesson(str(place)), registry)
