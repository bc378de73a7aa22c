"""Which values of a machine an emulation may change, between which bounds, and on which scale.

What recordings tell of the values of a machine, and which combinations of them they cannot tell, in words.

With J the derivatives of all readings by the logarithms of the values, in noise levels, each singular value S of J says how well one
combination is known: its relative standard error is 1/S. Combinations with S = 0 are looked at closely: those that are products of small
powers are run again far away from the given values, and are told as hidden only if no reading moves.

Source: Belsley, Kuh, Welsch, Regression Diagnostics (1980), chapter 3; Brun, Reichert, Kuensch, Water Resour. Res. 37 (2001).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.component import Parameter
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.wiring import Plan
from lathesim.errors import LessonError, listed, nearest
from lathesim.lessons.lesson import Lesson
from lathesim.lessons.part_values import si_of
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
    names = list(dict.fromkeys(named)) or [name for name in lesson.settings.uncertain if name in plan.parameters]
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
    return component.group in _MOVING_GROUPS and isinstance(component.declarations[item], Parameter) and plan.values[name] != 0.0


def _free(lesson: Lesson, plan: Plan, name: str, factor: float) -> FreeValue:
    declared = plan.declaration(name)
    given = plan.values[name]
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
    size = abs(given) * float(number) / 100.0 if written == "%" else si_of(text, unit, place)
    return (size / abs(given) if given else 1.0), size or 1.0


def bounds(free: Sequence[FreeValue]) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds on the scale of the search."""
    return np.array([item.to_scale(item.low) for item in free]), np.array([item.to_scale(item.high) for item in free])


def values_of(free: Sequence[FreeValue], scaled: FloatArray) -> FloatArray:
    """Return values [SI] (..., names) of points on the scale of the search (..., names)."""
    rows = np.asarray(scaled, dtype=float)
    return np.stack([item.from_scale(rows[..., position]) for position, item in enumerate(free)], axis=-1)


KNOWN = 10.0
"""Singular value from which on a combination is known to 10 %."""
_UNSEEN = 1e-3
"""Singular value below which a combination leaves no trace: a change by a factor of e moves the readings by a thousandth of the noise."""
_ROUNDING = 1e-6
"""Share of the largest singular value that the central differences leave where there is nothing."""
_GAP = 5.0
"""Ratio of two singular values from which on there is a gap between them."""
_FAR = 0.2
"""How far along a hidden combination the machine is run again, in units of the logarithm."""
_WHOLE = 0.02
"""A power this near to a whole number is that number."""
_HIGHEST = 3
"""Highest whole power of a combination that is told."""
_STILL = 0.02
"""Noise levels by which readings may move along a combination that is hidden: integration of other numbers, no physics."""


@dataclass(frozen=True)
class HiddenDirection:
    """A combination that leaves no trace: powers by which values may be multiplied together, name -> power, and the sentence about it."""

    powers: dict[str, float]
    sentence: str


@dataclass(frozen=True, eq=False)
class Telling:
    """What recordings tell: singular values, how many combinations are known to 10 %, and what is hidden.

    ``information`` is sum ln(1 + S^2). ``loose`` names the values whose own relative error is above 10 %, with that error.
    """

    names: tuple[str, ...]
    singular: FloatArray
    hidden: tuple[HiddenDirection, ...]
    loose: tuple[tuple[str, float], ...]

    @property
    def known(self) -> int:
        """How many combinations are known to 10 % or better."""
        return int((self.singular > KNOWN).sum())

    @property
    def information(self) -> float:
        """sum ln(1 + S^2)."""
        return float(np.log1p(np.square(self.singular)).sum())


def telling(names: Sequence[str], slopes: FloatArray, moved: Callable[[FloatArray], FloatArray]) -> Telling:
    """Return what readings tell of values.

    ``slopes`` (readings, names) are derivatives by the logarithms of the values, in noise levels. ``moved`` takes directions (members,
    names) on that scale, and returns by how many noise levels the readings move at most (members,).
    """
    _, singular, rows = np.linalg.svd(np.linalg.qr(slopes, mode="r") if len(slopes) > len(names) else slopes, full_matrices=True)
    singular = np.concatenate([singular, np.zeros(max(0, len(names) - len(singular)))])[: len(names)]
    hidden = _still(names, singular, rows, moved)
    variance = np.square(rows.T / np.maximum(singular, 1e-9)).sum(axis=1)
    loose = tuple((name, float(np.sqrt(size))) for name, size in zip(names, variance, strict=True) if size > 1.0 / KNOWN**2)
    return Telling(tuple(names), singular, tuple(HiddenDirection(powers, _sentence(powers)) for powers in hidden), loose)


def _still(
    names: Sequence[str], singular: FloatArray, rows: FloatArray, moved: Callable[[FloatArray], FloatArray]
) -> list[dict[str, float]]:
    """Return the combinations along which no reading moves.

    Those that never show and those that hardly show are told apart by a gap between the singular values. Each gap is tried, and the one
    is taken that leaves most combinations of whole powers standing when the machine is run again: physics multiplies by whole powers.
    """
    count = int((singular < max(_UNSEEN, _ROUNDING * float(singular[0]))).sum())
    best: list[dict[str, float]] = []
    for first in range(len(names) - count, len(names)):
        if singular[first] * _GAP > (singular[first - 1] if first else np.inf):
            continue
        found = _combinations(names, rows[first:])
        still = moved(_FAR * np.array([[powers.get(name, 0.0) for name in names] for powers in found])) < _STILL
        standing = [item for item, stays in zip(found, still, strict=True) if stays and _is_whole(item)]
        if len(standing) > len(best):
            best = standing
    return best


def _is_whole(powers: dict[str, float]) -> bool:
    return all(power == round(power) and abs(power) <= _HIGHEST for power in powers.values())


def _combinations(names: Sequence[str], small: FloatArray) -> list[dict[str, float]]:
    """Return a sparse basis of the rows: reduced until each has one value of its own, powers made whole where they nearly are."""
    rows = small.copy()
    found: list[dict[str, float]] = []
    used: list[int] = []
    for number in range(len(rows)):
        place, column = divmod(int(np.argmax(_alone(rows[number:], used))), rows.shape[1])
        rows[[number, number + place]] = rows[[number + place, number]].copy()
        rows[number] /= rows[number, column]
        for other in range(len(rows)):
            if other != number:
                rows[other] -= rows[other, column] * rows[number]
        used.append(int(column))
    for row in rows:
        whole = np.where(np.abs(row - np.round(row)) < _WHOLE, np.round(row), row)
        found.append({name: float(power) for name, power in zip(names, whole, strict=True) if abs(power) > _WHOLE})
    return found


def _alone(rows: FloatArray, used: Sequence[int]) -> FloatArray:
    """Return how fit each entry is as the one a row is told by: large, and in a column that few other rows need."""
    size = np.abs(rows)
    fitness = np.asarray(size / (1e-12 + np.sqrt(np.square(rows).sum(axis=0))) * size)
    fitness[:, list(used)] = 0.0
    return fitness


def _sentence(powers: dict[str, float]) -> str:
    """Return a hidden combination in words."""
    if len(powers) == 1:
        return f"{next(iter(powers))} does not show at all."
    up = [name for name, power in powers.items() if power > 0.0]
    down = [name for name, power in powers.items() if power < 0.0]
    if len(down) == 1 and len(up) > 1:
        up, down = down, up
    if all(abs(power) == abs(next(iter(powers.values()))) for power in powers.values()):
        if not down:
            return f"Only the ratio of {listed(up)} shows." if len(up) == 2 else f"Only the ratios of {listed(up)} show."
        if len(up) == 1 and len(down) == 1:
            return f"Only the product of {listed(list(powers))} shows, and neither of them alone."
        if len(up) == 1:
            return f"Only the products of {up[0]} with each of {listed(down)} show, and none of them alone."
        return f"Only the products of {listed(up)} with {listed(down)} show."
    told = " ".join(f"{name}^{power:+.3g}" for name, power in powers.items())
    return f"Nothing moves along {told}: these values may change together by these powers."
