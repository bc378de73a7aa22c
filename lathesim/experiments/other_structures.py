"""Other structures for a machine that values alone do not make like: effects inserted, the interpolator replaced, shared values parted."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.component import Component, Parameter
from lathesim.engine.assembly import FloatArray, Part, Place
from lathesim.experiments.free_values import FreeValue
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.lessons.insertion import insert_effect
from lathesim.lessons.lesson import Lesson, lesson_from_text
from lathesim.lessons.simulate import Prepared
from lathesim.plugins import Registry
from lathesim.units import in_unit

_EFFECTS = ("CoulombFriction", "Backlash", "AxialResonance")
"""What way-points at a few hertz can show of an axis; assumed."""
_INTERPOLATOR = "JerkLimitedInterpolator"
_PLAIN_INTERPOLATORS = ("ConstantVelocityInterpolator", "ConstantAccelerationInterpolator")
_ACCELERATION, _PAUSE, _AVERAGING = (0.05, 20.0), (0.0, 0.5), (0.0, 0.5)
"""Path acceleration [m/s^2], rest after a block [s] and averaging of references [s] within which a control is looked for; assumed."""
_CYCLES = (1e-3, 2e-3, 4e-3, 8e-3)
"""Interpolation cycles [s] of a control that are looked for; assumed."""
_USUAL_PAUSE, _USUAL_AVERAGING = 0.01, 0.03
"""Standard deviations of what a control rests and averages [s]; assumed."""
_PARTED = 0.5
"""Standard deviation of the logarithm by which two axes differ in a value that they share in the lesson; assumed."""
_LOOKS = 3
"""Sizes of an effect at which it is first looked at."""


@dataclass(frozen=True)
class Change:
    """A change of the structure: its title, its entries for the lesson, and the values it brings to be learnt.

    With ``neutral`` [SI] values the machine is what it was before. ``probes`` (n, values) [SI] are where a search looks first. What is
    ``held`` [SI] is part of the structure and not learnt; without the change it is zero.
    """

    title: str
    brings: tuple[FreeValue, ...]
    neutral: tuple[float, ...]
    probes: FloatArray
    insert: tuple[dict[str, str], ...] = ()
    replace: dict[str, str] = field(default_factory=dict)
    add: dict[str, Any] = field(default_factory=dict)
    wires: dict[str, str] = field(default_factory=dict)
    held: dict[str, float] = field(default_factory=dict)


def possible_changes(prepared: Prepared, registry: Registry) -> list[Change]:
    """Return what the machine can take: another interpolator, values of two axes parted, one effect at an axis each."""
    return [*_interpolators(prepared), *_parted_values(prepared), *_effects(prepared, registry)]


def _interpolators(prepared: Prepared) -> Iterable[Change]:
    for part in prepared.machinery.parts:
        if part.component.__name__ in _PLAIN_INTERPOLATORS:
            middle = float(np.sqrt(_ACCELERATION[0] * _ACCELERATION[1]))
            brings = (
                FreeValue(f"{part.name}.acceleration", "m/s^2", middle, *_ACCELERATION, 1.5),
                FreeValue(f"{part.name}.pause", "s", 0.0, *_PAUSE, 1.0, _USUAL_PAUSE),
                FreeValue(f"{part.name}.averaging", "s", 0.0, *_AVERAGING, 1.0, _USUAL_AVERAGING),
            )
            grid = np.array(list(itertools.product((0.1, 0.3, 1.0, 4.0, 20.0), (0.0, 0.01, 0.04), (0.0, 0.02, 0.08))))
            neutral, replaced = (_ACCELERATION[1], 0.0, 0.0), {part.name: _INTERPOLATOR}
            yield Change(f"{part.name} accelerates, rests and averages", brings, neutral, grid, replace=replaced)
        elif part.component.__name__ != _INTERPOLATOR or _value(part, "cycle") > 0.0:
            continue
        for cycle in _CYCLES:
            title, held = f"{part.name} counts blocks in cycles of {in_unit(cycle, 'ms', 'g')}", {f"{part.name}.cycle": cycle}
            yield Change(title, (), (), np.zeros((1, 0)), replace={part.name: _INTERPOLATOR}, held=held)


def _parted_values(prepared: Prepared) -> Iterable[Change]:
    """Yield for each value that two controllers of one kind share a change that parts them."""
    parts = {part.name: part for part in prepared.machinery.parts}
    for wire in prepared.machinery.wires:
        target, source = Place.of(wire.target), Place.of(wire.source)
        if not wire.source or source.part not in parts or target.part not in parts:
            continue
        own, other = parts[target.part].component, parts[source.part].component
        declared = own.declarations.get(target.port)
        alike = own is other or own.__name__ == other.__name__
        if not alike or "update" in own.laws or own.group != "controllers" or not isinstance(declared, Parameter):
            continue
        if not isinstance(other.declarations.get(source.port), Parameter) or _value(parts[source.part], source.port) == 0.0:
            continue
        name = f"{target.part}_own_{target.port}"
        added = {name: {"component": "ScaledValue", "units": {"signal": declared.unit}}}
        value = FreeValue(f"{name}.factor", "1", 1.0, 0.2, 5.0, _PARTED)
        yield Change(
            f"{target.part} with its own {target.port}", (value,), (1.0,), np.array([[0.6], [0.8], [1.25], [1.6]]), add=added,
            wires={wire.target: f"{name}.outgoing", f"{name}.incoming": wire.source},
        )  # fmt: skip


def _value(part: Part, item: str) -> float:
    declared = part.component.declarations[item]
    return float(part.parameters.get(item, getattr(declared, "default", 0.0)))


def _effects(prepared: Prepared, registry: Registry) -> Iterable[Change]:
    present = {(item.entry.effect, item.entry.at) for item in prepared.case.insert}
    axes = [part for part in prepared.machinery.parts if part.component.group == "axes" and "flow" in part.component.ports]
    for name in _EFFECTS:
        effect = registry.effects.get(name)
        if effect is None:
            continue
        for part in axes:
            how = getattr(effect, "identification", None)
            site, typical, neutral = getattr(effect, "site", ""), getattr(how, "typical", {}), getattr(effect, "neutral", {})
            at = part.name if site in part.component.ports else f"{part.name}.{part.component.ports.get('displacement', '')}"
            if (site not in part.component.ports and site != "measured") or present & {(name, part.name), (name, at)}:
                continue
            place = f"{part.name}_{_snake(name)}"
            placed = insert_effect(prepared.machinery, effect, at, name=place)
            own = next(each.component for each in placed.parts if each.name == place)  # with the units of its host
            brings = tuple(_effect_value(own, place, item, bounds) for item, bounds in typical.items())
            looks = [
                np.geomspace(low, high, _LOOKS) if item in neutral or item == how.resonance else [value.given]  # type: ignore[union-attr]
                for (item, (low, high)), value in zip(typical.items(), brings, strict=True)
            ]
            idle = tuple(float(neutral.get(item, value.given)) for item, value in zip(typical, brings, strict=True))
            entry = {"effect": name, "at": at, "name": place}
            yield Change(f"{name} at {part.name}", brings, idle, np.array(list(itertools.product(*looks))), insert=(entry,))


def _snake(name: str) -> str:
    return "".join(f"_{letter.lower()}" if letter.isupper() and place else letter.lower() for place, letter in enumerate(name))


def _effect_value(effect: type[Component], part: str, item: str, bounds: tuple[float, float]) -> FreeValue:
    declared = effect.declarations[item]
    low, high = bounds
    lowest = declared.low if isinstance(declared, Parameter) else low
    highest = declared.high if isinstance(declared, Parameter) else high
    if low > 0.0:
        return FreeValue(
            f"{part}.{item}", declared.unit, float(np.sqrt(low * high)), max(lowest, low / 30.0), min(highest, 10.0 * high), 1.5
        )
    return FreeValue(f"{part}.{item}", declared.unit, 0.0, low, high, 1.0, max(abs(low), abs(high)))


def changed(lesson: Lesson, changes: Sequence[Change]) -> Lesson:
    """Return the lesson with these changes made."""
    insert = [entry for change in changes for entry in change.insert]
    replace = {name: component for change in changes for name, component in change.replace.items()}
    further: dict[str, Any] = {}
    for key in ("add", "wires"):
        made = {name: entry for change in changes for name, entry in getattr(change, key).items()}
        if made:
            further[key] = {**(lesson.source.data.get(key) or {}), **made}
    held = {name: f"{value:.9g} s" for change in changes for name, value in change.held.items()}
    text = changed_lesson(lesson, insert, held, lesson.path.parent, replace=replace, further=further)
    return lesson_from_text(text, Path(lesson.path))
