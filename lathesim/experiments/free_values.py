"""Which values of a machine an emulation may change, between which bounds, and on which scale."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.component import Parameter
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.wiring import Plan
from lathesim.errors import LessonError, nearest
from lathesim.lessons.case import Given
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import si_value
from lathesim.units import split_quantity

_USUAL_SPREAD = 0.5
"""Standard deviation of the logarithm of a value about which the lesson says nothing; assumed."""
_MOVING_GROUPS = ("controllers", "axes")


@dataclass(frozen=True)
class FreeValue:
    """A value to be learnt [SI]: where it begins, its bounds, and how far it may be off by what the lesson says.

    A value above zero is searched on the scale of its logarithm: ``to_scale`` gives ln(value/given), in units of one. One that is zero, or
    may be negative or none at all, is searched as (value - given)/``size``.
    """

    name: str
    unit: str
    given: float
    low: float
    high: float
    spread: float
    size: float = 1.0

    @property
    def is_ratio(self) -> bool:
        """Whether it is searched as a ratio to what was given."""
        return self.given > 0.0 and self.low > 0.0

    def to_scale(self, value: float) -> float:
        """Return a value on the scale of the search."""
        return math.log(value / self.given) if self.is_ratio else (value - self.given) / self.size

    def from_scale(self, scaled: FloatArray) -> FloatArray:
        """Return values [SI] of the scale of the search."""
        return self.given * np.exp(scaled) if self.is_ratio else self.given + self.size * scaled


def free_values(lesson: Lesson, plan: Plan, named: Sequence[str], factor: float, place: str = "--free") -> list[FreeValue]:
    """Return what an emulation may change: what was ``named``, else what the lesson calls uncertain, else all of controllers and axes.

    Bounds are ``factor`` times smaller and larger than given, within those of the parameter. Raises :class:`LessonError` for names that
    the machine does not have; ``place`` says where they were given.
    """
    uncertain = lesson.settings.uncertain
    names = list(dict.fromkeys(named)) or [name for name in uncertain if name in plan.parameters]
    if not names:
        names = [name for name in plan.parameters if _is_of_the_loop(plan, name)]
    for name in names:
        if name not in plan.parameters:
            part, item = Place.of(name)
            wired = part in plan.parts and item in plan.parts[part].component.declared(Parameter)
            fact = (
                f"{name} is wired to another value, so it cannot be learnt by itself."
                if wired
                else f"the machine has no parameter '{name}'."
            )
            raise LessonError(fact, place=place, remedy=nearest(name, plan.parameters))
    return [_free(lesson, plan, name, factor) for name in names]


def _is_of_the_loop(plan: Plan, name: str) -> bool:
    """Return whether a parameter belongs to a controller or an axis, and is a size rather than a switch or a limit."""
    part, item = Place.of(name)
    component = plan.parts[part].component
    declared = component.declarations[item]
    if component.group not in _MOVING_GROUPS or not isinstance(declared, Parameter):
        return False
    return plan.parameter_values[plan.parameters[name]] != 0.0


def _free(lesson: Lesson, plan: Plan, name: str, factor: float) -> FreeValue:
    declared = plan.declaration(name)
    given = plan.parameter_values[plan.parameters[name]]
    low, high = (declared.low, declared.high) if isinstance(declared, Parameter) else (-math.inf, math.inf)
    spread, size = _spread(lesson, name, given, declared.unit)
    may_be_none = low <= 0.0 and size * factor > given
    if given > 0.0 and not (_is_absolute(lesson, name) and may_be_none):
        return FreeValue(name, declared.unit, given, max(low, given / factor) or given / factor, min(high, given * factor), spread)
    if given > 0.0:
        return FreeValue(name, declared.unit, given, max(low, given - factor * size), min(high, given + factor * size), 1.0, size)
    if given < 0.0:
        return FreeValue(name, declared.unit, given, max(low, given * factor), min(high, -given * (factor - 1.0)), 1.0, abs(given) * spread)
    return FreeValue(name, declared.unit, given, max(low, -factor * size), min(high, factor * size), 1.0, size)


def _is_absolute(lesson: Lesson, name: str) -> bool:
    """Return whether a lesson tells how far a value may be off as a quantity, not as a share of it."""
    text = lesson.settings.uncertain.get(name)
    return text is not None and split_quantity(text)[1] != "%"


def _spread(lesson: Lesson, name: str, given: float, unit: str) -> tuple[float, float]:
    """Return how far a value may be off, as a ratio and as a size [SI]."""
    text = lesson.settings.uncertain.get(name)
    if text is None:
        return _USUAL_SPREAD, abs(given) * _USUAL_SPREAD or 1.0
    number, written = split_quantity(text)
    place = lesson.source.place(("uncertain", name))
    size = abs(given) * float(number) / 100.0 if written == "%" else si_value(Given(text, place, place), unit)
    return (size / abs(given) if given else 1.0), size or 1.0


def bounds(free: Sequence[FreeValue]) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds on the scale of the search."""
    return np.array([item.to_scale(item.low) for item in free]), np.array([item.to_scale(item.high) for item in free])


def values_of(free: Sequence[FreeValue], scaled: FloatArray) -> FloatArray:
    """Return values [SI] (..., names) of points on the scale of the search (..., names)."""
    rows = np.asarray(scaled, dtype=float)
    return np.stack([item.from_scale(rows[..., position]) for position, item in enumerate(free)], axis=-1)
