"""Sizes of the effects that a lesson inserts, which the watch follows as free values beside the uncertain ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lathesim.effects.effect import Effect
from lathesim.lessons.insertion import effect_part_name
from lathesim.lessons.simulate import Prepared
from lathesim.plugins import Registry


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
                value = plan.parameter_values[plan.parameters[f"{part}.{name}"]]
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
