"""Quantities of a lesson to the SI values of a part, each fault with the place where it was written."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

from lathesim.component import Component, Declaration, Input, Parameter, State
from lathesim.errors import LatheSimError, LessonError, nearest
from lathesim.lessons.case import Given
from lathesim.units import quantity


@contextmanager
def placed_at(place: str) -> Iterator[None]:
    """Return errors from inside the place where their cause was written."""
    try:
        yield
    except LatheSimError as error:
        fact = f"{error.place}: {error.fact}" if error.place else error.fact
        raise LessonError(fact, place=place, remedy=error.remedy) from None


def si_value(given: Given, unit: str) -> float:
    """Return the SI value of an entry that must measure the same kind of thing as ``unit``."""
    if not isinstance(given.value, str):
        return float(given.value)
    with placed_at(given.place):
        return quantity(given.value, unit)


def seconds(given: Given) -> float:
    """Return a duration [s]. Raises :class:`LessonError` if it is not above zero."""
    value = si_value(given, "s")
    if not (value > 0.0 and math.isfinite(value)):
        raise LessonError(f"the time is {value:g} s, and it must be above zero.", place=given.place)
    return value


def take_value(
    part: str, component: type[Component], item: str, given: Given, parameters: dict[str, float], start: dict[str, float]
) -> None:
    """Put the value of a parameter into ``parameters`` and that of a state into ``start``."""
    declared = component.declarations.get(item)
    if isinstance(declared, Parameter):
        value = si_value(given, declared.unit)
        if not declared.low <= value <= declared.high:
            unit = "" if declared.unit == "1" else f" {declared.unit}"
            fact = f"{part}.{item} is {value:g}{unit}, outside {declared.low:g} to {declared.high:g}{unit}."
            raise LessonError(fact, place=given.place, remedy="Choose a value inside.")
        parameters[item] = value
    elif isinstance(declared, State):
        start[item] = si_value(given, declared.unit)
    else:
        raise no_item(part, component, item, (Parameter, State), "parameter", given.key_place)


def no_item(part: str, component: type[Component], item: str, kinds: tuple[type[Declaration], ...], word: str, place: str) -> LessonError:
    """Return the error for a name that a part does not have, or has as something else."""
    declared = component.declarations.get(item)
    if declared is not None:
        remedy = "Feed it with a wire, under 'wires:'." if isinstance(declared, Input) else ""
        return LessonError(f"{part}.{item} is {_with_article(declared.kind)}, not {_with_article(word)}.", place=place, remedy=remedy)
    known = [name for name, other in component.declarations.items() if isinstance(other, kinds)]
    remedy = nearest(item, known) or (f"It has {', '.join(known)}." if known else "It has none.")
    return LessonError(f"{part} has no {word} '{item}'.", place=place, remedy=remedy)


def _with_article(word: str) -> str:
    return f"an {word}" if word[0] in "aeiou" else f"a {word}"
