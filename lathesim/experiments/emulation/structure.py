"""Another structure for a machine that values alone do not make like: effects inserted, the interpolator replaced."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from lathesim.component import Parameter
from lathesim.experiments.emulation.free_values import FreeValue
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.lesson import Lesson, lesson_from_text
from lathesim.lessons.simulate import Prepared
from lathesim.plugins import Registry

_EFFECTS = ("CoulombFriction", "Backlash", "AxialResonance")
"""What way-points at a few hertz can show of an axis; assumed."""
_ACCELERATION = (0.05, 20.0)
"""Path acceleration of machines [m/s^2], between which it is looked for; assumed."""


@dataclass(frozen=True)
class Change:
    """A change of the structure: what it is called, its entries for ``insert:`` and ``replace:``, and the values it brings to be learnt."""

    title: str
    insert: tuple[dict[str, str], ...] = ()
    replace: dict[str, str] = field(default_factory=dict)
    brings: tuple[FreeValue, ...] = ()


def possible_changes(prepared: Prepared, registry: Registry) -> list[Change]:
    """Return the changes that the machine can take: an accelerating interpolator, and one effect at one axis each."""
    found: list[Change] = []
    present = {(item.entry.effect, item.entry.at) for item in prepared.case.insert}
    for part in prepared.machinery.parts:
        if part.component.__name__ == "ConstantVelocityInterpolator":
            low, high = _ACCELERATION
            middle = float(np.sqrt(low * high))
            value = FreeValue(f"{part.name}.acceleration", "m/s^2", middle, low, high, 1.0)
            found.append(Change(f"{part.name} accelerates", replace={part.name: "ConstantAccelerationInterpolator"}, brings=(value,)))
    axes = [part for part in prepared.machinery.parts if part.component.group == "axes" and "flow" in part.component.ports]
    for name in _EFFECTS:
        effect = registry.effects.get(name)
        if effect is None:
            continue
        for part in axes:
            site, typical = getattr(effect, "site", ""), getattr(getattr(effect, "identification", None), "typical", {})
            if site not in part.component.ports or (name, part.name) in present:
                continue
            place = f"{part.name}_{_snake(name)}"
            brings = tuple(_effect_value(effect, place, item, bounds) for item, bounds in typical.items())
            entry = {"effect": name, "at": part.name, "name": place}
            found.append(Change(f"{name} at {part.name}", insert=(entry,), brings=brings))
    return found


def _snake(name: str) -> str:
    return "".join(f"_{letter.lower()}" if letter.isupper() and place else letter.lower() for place, letter in enumerate(name))


def _effect_value(effect: type, part: str, item: str, bounds: tuple[float, float]) -> FreeValue:
    declared = effect.declarations[item]  # type: ignore[attr-defined]
    low, high = bounds
    lowest = declared.low if isinstance(declared, Parameter) else low
    if low > 0.0:
        return FreeValue(f"{part}.{item}", declared.unit, float(np.sqrt(low * high)), max(lowest, low / 30.0), 10.0 * high, 1.5)
    return FreeValue(f"{part}.{item}", declared.unit, 0.0, low, high, 1.0, max(abs(low), abs(high)))


def changed(lesson: Lesson, changes: Sequence[Change]) -> Lesson:
    """Return the lesson with these changes made."""
    insert = [entry for change in changes for entry in change.insert]
    replace = {name: component for change in changes for name, component in change.replace.items()}
    text = changed_lesson(lesson, insert, {}, lesson.path.parent, replace=replace)
    return lesson_from_text(text, Path(lesson.path))
