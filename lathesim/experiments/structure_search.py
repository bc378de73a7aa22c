"""Which changes of the structure a machine needs: looked at on one machine that holds all of them, judged on what was not fitted.

Other structures for a machine that values alone do not make like: effects inserted, the interpolator replaced, shared values parted.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.component import Component, Parameter
from lathesim.engine.assembly import FloatArray, Place
from lathesim.experiments.free_values import FreeValue, bounds, values_of
from lathesim.experiments.left_out import gained, is_noise, left_out
from lathesim.experiments.objective import Objective, descend
from lathesim.experiments.replica import Replica, given_values
from lathesim.experiments.waypoints import Wandering
from lathesim.identification.catalogue import snake
from lathesim.identification.estimation.fit import fit_linear
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
        elif part.component.__name__ != _INTERPOLATOR or part.value("cycle") > 0.0:
            continue
        for cycle in _CYCLES:
            title, held = f"{part.name} counts blocks in cycles of {in_unit(cycle, 'ms', 'g')}", {f"{part.name}.cycle": cycle}
            yield Change(title, (), (), np.zeros((1, 0)), replace={part.name: _INTERPOLATOR}, held=held)


def _parted_values(prepared: Prepared) -> Iterable[Change]:
    """Yield for each value that two controllers of one kind share a change that parts them."""
    parts = prepared.machinery.by_name
    for wire in prepared.machinery.wires:
        target, source = Place.of(wire.target), Place.of(wire.source)
        if not wire.source or source.part not in parts or target.part not in parts:
            continue
        own, other = parts[target.part].component, parts[source.part].component
        declared = own.declarations.get(target.port)
        alike = own is other or own.__name__ == other.__name__
        if not alike or "update" in own.laws or own.group != "controllers" or not isinstance(declared, Parameter):
            continue
        if not isinstance(other.declarations.get(source.port), Parameter) or parts[source.part].value(source.port) == 0.0:
            continue
        name = f"{target.part}_own_{target.port}"
        added = {name: {"component": "ScaledValue", "units": {"signal": declared.unit}}}
        value = FreeValue(f"{name}.factor", "1", 1.0, 0.2, 5.0, _PARTED)
        yield Change(
            f"{target.part} with its own {target.port}", (value,), (1.0,), np.array([[0.6], [0.8], [1.25], [1.6]]), add=added,
            wires={wire.target: f"{name}.outgoing", f"{name}.incoming": wire.source},
        )  # fmt: skip


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
            place = f"{part.name}_{snake(name)}"
            placed = insert_effect(prepared.machinery, effect, at, name=place)
            own = placed.by_name[place].component  # with the units of its host
            brings = tuple(_effect_value(own, place, item, bounds) for item, bounds in typical.items())
            looks = [
                np.geomspace(low, high, _LOOKS) if item in neutral or item == how.resonance else [value.given]  # type: ignore[union-attr]
                for (item, (low, high)), value in zip(typical.items(), brings, strict=True)
            ]
            idle = tuple(float(neutral.get(item, value.given)) for item, value in zip(typical, brings, strict=True))
            entry = {"effect": name, "at": at, "name": place}
            yield Change(f"{name} at {part.name}", brings, idle, np.array(list(itertools.product(*looks))), insert=(entry,))


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
    return lesson_from_text(changed_lesson(lesson, insert, held, lesson.path.parent, replace=replace, further=further), Path(lesson.path))


_MOST_CHANGES = 8
_TRIED = 3
"""Changes of each round that are fitted in full, after a first look at all of them."""
SURE = 2.0
"""Standard errors by which a change must better what was not fitted."""
_RUNS = 10
"""Descents of a trial, each with its set of derivatives."""

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Chosen:
    """The changes that were kept, and the point of base values and what the changes bring."""

    changes: tuple[Change, ...]
    point: FloatArray
    stopped: bool = False


class StructureSearch:
    """A machine that holds all changes, each neutral until it is chosen."""

    def __init__(
        self, replica: Replica, free: Sequence[FreeValue], changes: Sequence[Change], before: Objective, say: Say
    ) -> None:  # fmt: skip
        self.replica, self.free, self.changes, self.recorded = replica, list(free), list(changes), before.recorded
        self.weight, self.say = before.weight, say
        self.floor, self.least = before.floor, before.least
        self.wandering: Wandering | None = before.wandering
        self.neutral = given_values(replica.plan, replica.names)
        for change in changes:
            for value, idle in zip(change.brings, change.neutral, strict=True):
                self.neutral[replica.names.index(value.name)] = idle
            self.neutral[[replica.names.index(name) for name in change.held]] = 0.0

    def objective(self, chosen: Sequence[Change]) -> Objective:
        """Return the objective of the machine with these changes: its base values and what they bring are free."""
        free = [*self.free, *(value for change in chosen for value in change.brings)]
        found = Objective(self.replica, free, self.recorded, self.weight, self.floor, self._idle(chosen))
        found.wandering = self.wandering
        return found

    def _idle(self, chosen: Sequence[Change]) -> FloatArray:
        """Return the values [SI] of the machine with every change neutral but what the chosen ones hold."""
        found = self.neutral.copy()
        for change in chosen:
            for name, value in change.held.items():
                found[self.replica.names.index(name)] = value
        return found

    def run(self, start: Chosen) -> Chosen:
        """Return what is kept: change after change, while one betters what was not fitted and what is left is more than noise.

        In each round every change is looked at where its probes are, with all other values refitted on straight lines. The best few are
        fitted in full. Ctrl-C keeps what was kept so far.
        """
        found = start
        starts = [start.point] if start.changes else [start.point, np.zeros(len(start.point))]
        try:
            for kept in self._kept(found, starts):
                found = kept
                if self.wandering is not None:
                    objective = self.objective(found.changes)
                    objective.least = self.least
                    objective.take_clock(found.point)
                    self.floor, self.wandering = objective.floor, objective.wandering
        except KeyboardInterrupt:
            return Chosen(found.changes, found.point, stopped=True)
        return found

    def _kept(self, found: Chosen, starts: Sequence[FloatArray]) -> Iterator[Chosen]:
        """Yield what is kept, change after change."""
        while len(found.changes) < _MOST_CHANGES:
            objective = self.objective(found.changes)
            judged, slopes = left_out(objective, found.point)
            if is_noise(objective, found.point, slopes):
                return
            tried: list[tuple[float, float, Change, FloatArray]] = []
            for change, begin in self._looked(found.changes, starts)[:_TRIED]:
                trial = self.objective((*found.changes, change))
                end = self._fitted(trial, begin)
                away, _ = left_out(trial, end)
                self.say(f"  with {change.title}: {self._size(away)} on what is left out, {self._size(judged)} without")
                tried.append((float(np.square(away).sum()), gained(judged, away), change, end))
            if not tried:
                return
            _, worth, kept, end = min(tried, key=lambda item: item[0])
            if worth < SURE:
                return
            found, starts = Chosen((*found.changes, kept), end), [end]
            self.say(f"Kept: {kept.title}.")
            yield found

    def _size(self, deviations: FloatArray) -> str:
        return f"{in_unit(self.floor * float(np.sqrt(np.square(deviations).mean())), 'mm')}"

    def _fitted(self, objective: Objective, start: FloatArray) -> FloatArray:
        """Return the end of a descent, with the floor at what is left so that what the lesson says of values has its weight."""
        low, high = bounds(objective.free)
        quiet: Callable[[int, float], None] = lambda runs, cost: None  # noqa: E731
        left = self.floor * max(1.0, float(np.sqrt(np.square(objective.vector(start)[0]).mean())) / 3.0)
        for most in (_RUNS, _RUNS // 2):
            objective.floor = left
            start = descend(objective, low, high, start, quiet, most, 1e-3)
            left = max(self.floor, left * float(np.sqrt(np.square(objective.vector(start)[0]).mean())))
        objective.floor = self.floor
        return start

    def _looked(self, chosen: Sequence[Change], starts: Sequence[FloatArray]) -> list[tuple[Change, FloatArray]]:
        """Return the changes not chosen yet, the one that promises most first, each with the point to begin its fit at."""
        held = {name for change in chosen for name in change.held}
        rest = [change for change in self.changes if change not in chosen and not held & set(change.held)]
        if self.wandering is None:  # a cycle shows by nothing but a clock that wanders
            rest = [change for change in rest if not change.held]
        if not rest:
            return []
        base = self.objective(chosen)
        places = [self.replica.names.index(item.name) for item in base.free]
        found: dict[str, tuple[float, Change, FloatArray]] = {}
        for start in starts:
            slopes = base.slopes(start)
            owner = [(change, probe) for change in rest for probe in change.probes]
            rows = np.array([self._idle((*chosen, change)) for change, _ in owner])
            rows[:, places] = values_of(base.free, start)
            for row, (change, probe) in zip(rows, owner, strict=True):
                row[[self.replica.names.index(value.name) for value in change.brings]] = probe
            for (change, probe), residual in zip(owner, self._deviations(rows), strict=True):
                shift, cost = _refitted(base, slopes, start, residual)
                if change.title not in found or cost < found[change.title][0]:
                    found[change.title] = (cost, change, np.concatenate([start + shift, _scaled(change, probe)]))
        return self._confirmed(base, chosen, [(change, point) for _, change, point in found.values()], starts)

    def _confirmed(
        self, base: Objective, chosen: Sequence[Change], looked: Sequence[tuple[Change, FloatArray]], starts: Sequence[FloatArray]
    ) -> list[tuple[Change, FloatArray]]:
        """Return changes with where to begin, in the order of what they leave when they are run: straight lines may lead astray."""
        count = len(base.free)
        tried = [
            (change, np.concatenate([start + share * (point[:count] - start), point[count:]]))
            for change, point in looked
            for start in starts
            for share in (1.0, 0.3)
        ]
        rows = np.array([self._idle((*chosen, change)) for change, _ in tried])
        for row, (change, point) in zip(rows, tried, strict=True):
            free = [*base.free, *change.brings]
            row[[self.replica.names.index(item.name) for item in free]] = values_of(free, point)
        costs = np.square(self._deviations(rows)).sum(axis=1)
        best: dict[str, tuple[Change, FloatArray]] = {}
        for place in np.argsort(costs):
            best.setdefault(tried[place][0].title, tried[place])
        return list(best.values())

    def _deviations(self, rows: FloatArray) -> FloatArray:
        """Return the deviations (members, numbers) in floors for values [SI] of everything that the machine holds."""
        free = [FreeValue(name, "1", 0.0, -np.inf, np.inf, 1.0) for name in self.replica.names]
        found = Objective(self.replica, free, self.recorded, self.weight, self.floor)
        found.wandering = self.wandering
        return found.vector(rows)


def _scaled(change: Change, probe: FloatArray) -> FloatArray:
    """Return a probe on the scale of the search, within the bounds of the values."""
    low, high = bounds(change.brings)
    return np.clip([value.to_scale(max(float(size), value.low)) for value, size in zip(change.brings, probe, strict=True)], low, high)


def _refitted(base: Objective, slopes: FloatArray, start: FloatArray, residual: FloatArray) -> tuple[FloatArray, float]:
    """Return the shift of the base values that makes a deviation least, within their bounds, and what it leaves."""
    spread = np.array([item.spread for item in base.free])
    low, high = bounds(base.free)
    noise = float(np.sqrt(np.square(residual).mean())) / 3.0 + 1.0
    stacked = np.vstack([slopes / noise, np.diag(1.0 / spread)])
    goal = np.concatenate([-residual / noise, -start / spread])
    gap = 1e-9
    shift = fit_linear(stacked, goal, np.minimum(low - start, -gap), np.maximum(high - start, gap))
    left = residual + slopes @ shift
    return shift, float(np.square(left).sum() + noise**2 * np.square((start + shift) / spread).sum())
