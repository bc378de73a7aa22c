"""What is known to differ from the plain machine: effects that the lesson inserts, and those that were named while it was watched."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from lathesim.effects.effect import Effect
from lathesim.lessons.insertion import effect_part_name
from lathesim.lessons.simulate import Prepared
from lathesim.plugins import Registry


@dataclass(frozen=True)
class Size:
    """A size of an effect [SI]: what it ``was``, what it ``is``, and the value at which the effect vanishes (``neutral``)."""

    was: float
    now: float
    neutral: float
    unit: str

    def with_more(self, found: float) -> Size:
        """Return the size with what was found besides: what vanishes at 0 adds up, factors multiply, of two limits the lower holds."""
        more = self.now + found if self.neutral == 0.0 else self.now * found if self.neutral == 1.0 else min(self.now, found)
        return Size(self.was, more, self.neutral, self.unit)


@dataclass(frozen=True)
class KnownEffect:
    """An effect at a part: its ``sizes`` by parameter, ``since`` and ``until`` when it grew [s], and whether a diagnosis ``named`` it."""

    effect: str
    at: str
    sizes: Mapping[str, Size]
    since: float
    until: float
    named: bool

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
        plan = prepared.plan
        for entry in prepared.case.lesson.settings.insert:
            part = str(entry.name) or effect_part_name(str(entry.at), str(entry.effect))
            sizes = {}
            for name, neutral in _neutral(registry, str(entry.effect)).items():
                if f"{part}.{name}" in plan.parameters:
                    value = plan.parameter_values[plan.parameters[f"{part}.{name}"]]
                    unit = plan.parts[part].component.declarations[name].unit
                    sizes[name] = Size(value, value, neutral, unit)
            key = _key(str(entry.effect), str(entry.at))
            self._known[key] = KnownEffect(str(entry.effect), str(entry.at), sizes, 0.0, 0.0, False)

    @property
    def changed(self) -> list[KnownEffect]:
        """Return what was named while the machine was watched, and what grew, in the order in which it was found."""
        return [effect for effect in self._known.values() if effect.named]

    def grown(self, answer: Mapping[str, Any], since: float, until: float) -> list[KnownEffect]:
        """Take the effects of a diagnosis (its JSON) of what changed from ``since`` to ``until`` [s]; return those known before."""
        grown = []
        inserted = {_key(str(entry["effect"]), str(entry["at"])) for entry in answer.get("insert", [])}
        for entry in answer.get("effects", []):
            effect, at = str(entry.get("effect", "")), str(entry.get("at", ""))
            if _key(effect, at) not in inserted:
                continue
            known = self._known.get(_key(effect, at))
            found = {name: (float(item["value"]), str(item["unit"])) for name, item in entry.get("parameters", {}).items()}
            if known is None:
                neutral = _neutral(self._registry, effect)
                sizes = {name: Size(neutral[name], value, neutral[name], unit) for name, (value, unit) in found.items() if name in neutral}
                self._known[_key(effect, at)] = KnownEffect(effect, at, sizes, since, until, True)
                continue
            sizes = {name: size.with_more(found[name][0]) if name in found else size for name, size in known.sizes.items()}
            begun = known.since if known.named else since
            self._known[_key(effect, at)] = KnownEffect(known.effect, known.at, sizes, begun, until, True)
            grown.append(self._known[_key(effect, at)])
        return grown


def _key(effect: str, at: str) -> tuple[str, str]:
    return effect, at.partition(".")[0]


def _neutral(registry: Registry, name: str) -> Mapping[str, float]:
    """Return the values at which an effect vanishes."""
    effect = registry.effect(name)
    return effect.neutral if issubclass(effect, Effect) else {}
