"""Which effect is hidden in a machine, where, and how large: as it was asked for, the rest drawn."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lathesim.component import Parameter
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import Assembly, Place
from lathesim.errors import LessonError, nearest
from lathesim.identification.catalogue import WIDE_RANGE, insert_candidates
from lathesim.identification.records import Candidate
from lathesim.lessons.insertion import Machinery, effect_part_name, insert_effect
from lathesim.units import quantity

_EXAMPLE = "CoulombFriction:level=20 N@x_axis"


@dataclass(frozen=True)
class HiddenWish:
    """An effect that somebody wants to be hidden: its class, its host where one is named, and values [text] of some of its parameters."""

    effect: type[Effect]
    at: str
    values: Mapping[str, str]
    text: str


@dataclass(frozen=True)
class HiddenEffect:
    """An effect in its place: ``part`` is its name in the machine, ``values`` those of its parameters [SI, in ``units``].

    ``drawn`` maps the parameters that were not given to the ranges they are drawn from.
    """

    effect: type[Effect]
    at: str
    part: str
    values: Mapping[str, float]
    units: Mapping[str, str]
    drawn: Mapping[str, tuple[float, float]]

    @property
    def size_is_drawn(self) -> bool:
        """Whether a size was not given: one that is has not to be seen."""
        return any(name in self.effect.neutral for name in self.drawn)

    @property
    def _sizes(self) -> dict[str, float]:
        """The drawn sizes with the values at which each vanishes."""
        return {name: float(value) for name, value in self.effect.neutral.items() if name in self.drawn and math.isfinite(value)}

    @property
    def largest_share(self) -> float:
        """The share of the drawn sizes at which one of them leaves its usual range."""
        shares = [
            max(abs(end - none) for end in self.drawn[name]) / abs(self.values[name] - none)
            for name, none in self._sizes.items()
            if self.values[name] != none
        ]
        return min(shares, default=1.0)

    def scaled(self, share: float) -> HiddenEffect:
        """Return the effect with a share of its drawn sizes."""
        sizes = {name: _rounded(none + share * (self.values[name] - none)) for name, none in self._sizes.items()}
        return replace(self, values={**self.values, **sizes})

    @property
    def overrides(self) -> dict[str, float]:
        """The values by ``part.parameter``."""
        return {f"{self.part}.{name}": value for name, value in self.values.items()}

    @property
    def neutral(self) -> dict[str, float]:
        """Values by ``part.parameter`` with which it vanishes."""
        return {**self.overrides, **{f"{self.part}.{name}": float(value) for name, value in self.effect.neutral.items()}}


def read_wish(text: str, effects: Mapping[str, type[Effect]]) -> HiddenWish:
    """Read ``NAME[:parameter=quantity,...][@host]``; refused (:class:`LessonError`) with the nearest name."""
    head, _, at = text.partition("@")
    name, _, listed = head.partition(":")
    effect = effects.get(name.strip())
    if effect is None:
        remedy = nearest(name.strip(), effects) or f"Write it as {_EXAMPLE}; 'lathesim effects' lists the names."
        raise LessonError(f"there is no effect '{name.strip()}'.", remedy=remedy)
    values: dict[str, str] = {}
    known = list(effect.declared(Parameter))
    for entry in (piece for piece in listed.split(",") if piece.strip()):
        item, equals, value = (piece.strip() for piece in entry.partition("="))
        if not equals or not value:
            raise LessonError(f"'{entry.strip()}' gives no value.", place=text, remedy=f"Write it as {_EXAMPLE}.")
        if item not in known:
            remedy = nearest(item, known) or f"It has {', '.join(known)}."
            raise LessonError(f"{name} has no parameter '{item}'.", place=text, remedy=remedy)
        values[item] = value
    return HiddenWish(effect, at.strip(), values, text)


def place_wishes(assembly: Assembly, wishes: Sequence[HiddenWish], compared: Collection[str]) -> tuple[Assembly, tuple[HiddenEffect, ...]]:
    """Return the assembly with all wishes in it and where each sits; values that were not given stand at the middle of their range.

    Frictions come last: they answer to the sum of what else pushes. Sensors that show in none of the ``compared`` channels are no hosts
    unless a wish names them.
    """
    ordered = sorted(wishes, key=lambda wish: bool(wish.effect.identification.sticks))
    hidden: list[HiddenEffect] = []
    for wish in ordered:
        candidate = _candidate(assembly, wish, compared)
        at = wish.at or (candidate.at if candidate else "")
        part = effect_part_name(at, wish.effect.__name__)
        assembly = insert_effect(assembly, wish.effect, at, name=part)
        placed = next(item for item in assembly.parts if item.name == part).component
        hidden.append(_with_values(wish, at, part, placed.declared(Parameter), _ranges(candidate)))
    return assembly, tuple(hidden)


def _candidate(assembly: Assembly, wish: HiddenWish, compared: Collection[str]) -> Candidate | None:
    """Return the candidate that a wish means, none where its host is a place only the wish names."""
    _, candidates = insert_candidates(assembly, [wish.effect], compared)
    if wish.at:
        everywhere = [*candidates, *insert_candidates(assembly, [wish.effect], None)[1]]
        return next((candidate for candidate in everywhere if candidate.at == wish.at), None)
    hosts = [candidate.at for candidate in candidates]
    name = wish.effect.__name__
    if len(hosts) > 1:
        raise LessonError(f"{name} could sit at {', '.join(hosts)}.", place=wish.text, remedy=f"Say where: {name}@{hosts[0]}.")
    if not hosts:
        raise LessonError(f"the machine has no place for {name}.", place=wish.text, remedy=f"Name one, as in {name}@part.input.")
    return candidates[0]


def _ranges(candidate: Candidate | None) -> dict[str, tuple[float, float]]:
    """Return the range in which each parameter of a candidate is typical, as its starting values span it."""
    if candidate is None or not len(candidate.points):
        return {}
    names = [Place.of(name).port for name in candidate.parameters]
    lows, highs = candidate.points.min(axis=0), candidate.points.max(axis=0)
    return {name: (float(low), float(high)) for name, low, high in zip(names, lows, highs, strict=True)}


def _with_values(
    wish: HiddenWish, at: str, part: str, declared: Mapping[str, Parameter], ranges: Mapping[str, tuple[float, float]]
) -> HiddenEffect:
    given = {name: _si(wish, text, declared[name]) for name, text in wish.values.items()}
    unknown = [name for name in wish.effect.neutral if name not in given and name not in ranges]
    if unknown and not ranges:
        remedy = f"Give it, as in {wish.effect.__name__}:{unknown[0]}=... {declared[unknown[0]].unit}@{at}."
        raise LessonError(f"nothing says how large {unknown[0]} may be at {at}.", place=wish.text, remedy=remedy)
    drawn = {name: bounds for name, bounds in ranges.items() if name not in given}
    all_values = {**{name: 0.5 * (low + high) for name, (low, high) in drawn.items()}, **given}
    values = {name: all_values[name] for name in declared if name in all_values}
    return HiddenEffect(wish.effect, at, part, values, {name: declared[name].unit for name in values}, drawn)


def _si(wish: HiddenWish, text: str, declared: Parameter) -> float:
    value = quantity(text, declared.unit)
    if not declared.low <= value <= declared.high:
        fact = f"{declared.name} is {value:g} {declared.unit}, outside {declared.low:g} to {declared.high:g} {declared.unit}."
        raise LessonError(fact, place=wish.text, remedy="Choose a value inside.")
    return value


def drawn_values(hidden: HiddenEffect, rng: np.random.Generator) -> HiddenEffect:
    """Return the effect with new values for what was not given: logarithmically even over a wide positive range, else evenly."""
    values = dict(hidden.values)
    for name, (low, high) in hidden.drawn.items():
        share = float(rng.uniform())
        wide = low > 0.0 and high > WIDE_RANGE * low
        values[name] = _rounded(low * (high / low) ** share if wide else low + (high - low) * share)
    return replace(hidden, values=values)


def _rounded(value: float) -> float:
    """Keep three digits: what is hidden shall be told in one line."""
    return 0.0 if value == 0.0 else round(value, 2 - math.floor(math.log10(abs(value))))


def random_wishes(
    machinery: Machinery, effects: Iterable[type[Effect]], compared: Collection[str], rng: np.random.Generator, count: int | None = None
) -> list[HiddenWish]:
    """Draw what is hidden: ``count`` effects of different families; without it nothing (1 in 5), one (3 in 5) or two (1 in 5).

    Left out are effects that only refine another or stand on top of one.
    """
    count = int(rng.choice([0, 1, 2], p=[0.2, 0.6, 0.2])) if count is None else count
    _, candidates = insert_candidates(
        machinery,
        [effect for effect in effects if not effect.identification.prerequisites and not effect.identification.generalises],
        compared,
    )
    chosen: list[Candidate] = []
    for position in rng.permutation(len(candidates)):
        candidate = candidates[int(position)]
        if len(chosen) < count and candidate.family not in {other.family for other in chosen}:
            chosen.append(candidate)
    return [HiddenWish(candidate.effect, candidate.at, {}, f"{candidate.name}@{candidate.at}") for candidate in chosen]
