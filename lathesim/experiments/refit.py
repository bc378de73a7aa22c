"""A rival refitted to what another one would make a recording read: from several starts, by linear rounds that follow where it bends.

    T(a, b) = min over p of  |W (y_a - y_b(p))|^2 + sum ((p - given)/deviation)^2

A round takes slopes where it stands and goes to the least sum of squares of them. A descent ends early where a further round cannot change
what a run would decide.
Source: Atkinson, Fedorov, Biometrika 62 (1975), 57; Nocedal, Wright, Numerical Optimization, 2nd ed. (2006), chapter 10 (Gauss-Newton).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray, Place
from lathesim.experiments.candidate_programs import Laid
from lathesim.experiments.rivals import Rival
from lathesim.experiments.scene import Scene
from lathesim.identification.estimation.fit import Descent, Problem, Weighting, fit, fit_linear
from lathesim.identification.records import Candidate as Term
from lathesim.identification.records import Free

_BEYOND = 10.0
"""Ranges beyond its usual bounds to which a rival may go when it is refitted: an unusual size is no proof against it."""
_STEP = 0.25
"""Step of the slopes, in standard deviations or as a share of a size: large against rounding, small against curvature."""
_FINER, _FINEST = 0.2, 0.01
"""By how much the steps of the slopes shrink from round to round of a refit, and to which share at most; assumed."""
_FURTHEST = 6.0
"""Standard deviations by which an uncertain value may be off when a rival is refitted."""
_WORTH_A_ROUND = 0.005
"""Share of T that a round of a refit must gain to be followed by another; assumed."""
_HELD = 1e3
"""Largest number of noise levels that counts of one stretch: beyond, no more is told."""
_FAR = 1e6 * _HELD
"""Largest change in noise levels that a slope is taken of: beyond, a run has left all bounds."""
_PROMISE = 0.5
"""Share of T that slopes must promise to take away for a descent to go on where T is settled; assumed."""


def steps_of(scene: Scene, rival: Rival, base: FloatArray) -> list[tuple[int, float]]:
    """Return which values are refitted for a rival, with the step of each slope."""
    steps = [(place, _STEP * float(size)) for place, size in enumerate(scene.deviation)]
    if rival.term is None:
        return steps
    for place, column in enumerate(scene.columns(rival)):
        low, high = float(rival.term.low[place]), float(rival.term.high[place])
        step = _STEP * (abs(base[column]) or abs(float(rival.term.usual[place] - rival.term.least[place])) or 1.0)
        steps.append((column, step if base[column] + step <= high else -min(step, base[column] - low)))
    return [(column, step) for column, step in steps if step != 0.0]


def linear_refit(
    scene: Scene, scaled: FloatArray, truth: FloatArray, rows: FloatArray, place: tuple[int, list[tuple[int, float]]],
    *, refitted: bool,
) -> tuple[float, FloatArray]:  # fmt: skip
    """Return T after a linear refit of a rival, and the values that it ends at."""
    first, steps = place
    base = scaled[first]
    row = rows[first]
    difference = np.nan_to_num(truth - base, nan=_HELD)
    if not refitted or not steps:
        return _held_power(difference), row
    slopes = _slopes(scaled[first + 1 : first + 1 + len(steps)], base, [step for _, step in steps], len(difference))
    shift, cost = _least(scene, slopes, difference, steps, row)
    moved = row.copy()
    for (column, _), amount in zip(steps, shift, strict=True):
        moved[column] += amount
    return cost, moved


def starts_alike(scene: Scene, a: int, b: int, draw: int) -> list[FloatArray]:
    """Return values at which a rival is as much like another one as the names of its parameters allow: where one effect holds the other
    as a special case, or both have a pitch and a phase, no descent from elsewhere finds that. Phases are also turned by half a turn:
    one effect may count as a push what the other counts as a drag."""
    first, second = scene.rivals[a], scene.rivals[b]
    row = scene.values(second, second.sizes[draw])
    if first.term is None or second.term is None:
        if second.term is not None:
            row[scene.columns(second)] = second.term.neutral
        return [row]
    own = _carried_over(first.term, second.term, first.sizes[draw])
    for place, column in enumerate(scene.columns(second)):
        item = Place.of(second.term.parameters[place]).port
        neutral = second.term.effect.neutral.get(item)
        if item in own:
            row[column] = min(max(own[item], float(second.term.low[place])), float(second.term.high[place]))
        elif neutral is not None:
            row[column] = neutral
    phases = [scene.columns(second)[place] for place, name in enumerate(second.term.parameters) if name.endswith("phase")]
    if not phases:
        return [row]
    turned = row.copy()
    turned[phases] += np.where(turned[phases] > 0.0, -np.pi, np.pi)
    return [row, turned]


def _carried_over(first: Term, second: Term, sizes: FloatArray) -> dict[str, float]:
    """Return what the sizes of the first would be as parameters of the second: by name, else in order, where the units agree."""
    units, values = [], {}
    for term in (first, second):
        names = [Place.of(name).port for name in term.parameters]
        units.append({name: term.effect.declarations[name].unit for name in names})
    for name, size in zip(units[0], sizes, strict=True):
        values[name] = float(size)
    spare = [name for name in units[0] if units[1].get(name) != units[0][name]]
    found = {name: values[name] for name in units[0] if name not in spare}
    for name in units[1]:
        alike = next((other for other in spare if units[0][other] == units[1][name]), None) if name not in found else None
        if alike is not None:
            found[name] = values[alike]
            spare.remove(alike)
    return found


def _least(
    scene: Scene, slopes: FloatArray, difference: FloatArray, steps: Sequence[tuple[int, float]], row: FloatArray
) -> tuple[FloatArray, float]:
    """Return the shift of the values with the least sum of squares, and that sum; rivals' sizes are kept near where slopes hold.

    An uncertain value stays within six standard deviations: beyond, what the lesson says of it counts more than ``NESTED`` by itself.
    """
    count = len(steps)
    pull, offset = np.zeros((count, count)), np.zeros(count)
    low, high = np.full(count, -np.inf), np.full(count, np.inf)
    uncertain = len(scene.uncertain)
    for number, (column, step) in enumerate(steps):
        width = float(scene.deviation[column]) if column < uncertain else 4.0 * abs(step)
        pull[number, number] = 1.0 / width
        if column < uncertain:
            off = row[column] - scene.given[column]
            offset[number] = -off / width
            low[number], high[number] = min(-_FURTHEST * width - off, -1e-9 * width), max(_FURTHEST * width - off, 1e-9 * width)
    stacked = np.vstack([slopes, pull])
    goal = np.concatenate([difference, offset])
    shift = fit_linear(stacked, goal, low, high)
    return shift, _held_power(goal - stacked @ shift)


def _held_power(difference: FloatArray) -> float:
    """Return the sum of squares of a difference in noise levels, of which no stretch counts more than ``_HELD``."""
    return float(np.square(np.clip(difference, -_HELD, _HELD)).sum())


@dataclass(frozen=True)
class RefitDescent:
    """The descent of one rival to what a truth makes a program's recording read (``truth``, in noise levels).

    ``levels`` turns readings into noise levels. ``settled`` is T from which on more of it changes nothing, and ``nested`` T below which the
    rival does what the other one does.
    """

    scene: Scene
    program: Laid
    truth: FloatArray
    rival: Rival
    levels: Callable[[FloatArray], FloatArray]
    nested: float
    settled: float

    def followed(self, start: FloatArray, rounds: int) -> tuple[float, FloatArray]:
        """Return T and values at the end: each round takes slopes where it stands, over ever smaller steps.

        The descent ends after ``rounds``, where a round gains less than half a per cent, where the rival does what the other one does, or
        where even what the slopes promise leaves T settled.
        """
        first = steps_of(self.scene, self.rival, start)
        columns = [column for column, _ in first]

        def whole(values: FloatArray) -> FloatArray:
            """Return all values of the scene, shape (rows, names)."""
            rows = np.tile(start, (len(values), 1))
            rows[:, columns] = values
            return rows

        def left(rows: FloatArray) -> list[FloatArray]:
            readings = self.levels(self.scene.readings([self.program], [whole(rows)])[0]).reshape(len(rows), -1)
            length = min(readings.shape[1], len(self.truth))
            return list(np.clip(self.truth[:length] - readings[:, :length], -_FAR, _FAR))

        def steps(values: FloatArray, before: int) -> FloatArray:
            now = {**dict(first), **dict(steps_of(self.scene, self.rival, whole(values[None])[0]))}
            return max(_FINEST, _FINER ** (before + 1)) * np.array([now[column] for column in columns])

        def worth(cost: float) -> float:
            """Return the gain without which T is settled; none is worth a round where the rival does what the other one does."""
            return np.inf if cost < self.nested else cost - max(self.settled, _PROMISE * cost)

        free = [self._free(column, step) for column, step in first]
        how = Descent(Problem(left, free, steps=steps), _Held(), _WORTH_A_ROUND, least=0.0, worth=worth, bent=True)
        found = fit(how, start[columns], rounds)
        return found.cost, whole(found.values[None])[0]

    def _free(self, column: int, step: float) -> Free:
        """Return a value that is refitted: an uncertain one with its deviation, or one of the rival's within what it may be."""
        if column < len(self.scene.uncertain):
            given, width = float(self.scene.given[column]), float(self.scene.deviation[column])
            return Free(self.scene.uncertain[column], given, abs(step), given - _FURTHEST * width, given + _FURTHEST * width, width, given)
        term = self.rival.term
        assert term is not None
        place = list(self.scene.columns(self.rival)).index(column)
        low, high = float(term.low[place]), float(term.high[place])
        reach = _BEYOND * (high - low)
        return Free(term.parameters[place], 0.0, abs(step), low - reach if low < 0.0 else low, high + reach)


class _Held(Weighting):
    """Deviations in noise levels of which no stretch counts more than ``_HELD``; where a run broke off, no slope is counted."""

    def power(self, residual: FloatArray) -> float:
        return _held_power(np.nan_to_num(residual, nan=_HELD))

    def white(self, residual: FloatArray) -> FloatArray:
        return np.nan_to_num(residual, nan=_HELD)

    def white_slopes(self, slopes: FloatArray, residual: FloatArray) -> FloatArray:
        return np.nan_to_num(slopes).T


def _slopes(moved: FloatArray, base: FloatArray, steps: Sequence[float], length: int) -> FloatArray:
    """Return slopes (readings, values); where a run of the two broke off, none is counted."""
    return np.asarray((np.clip(np.nan_to_num(moved - base), -_FAR, _FAR)[:, :length] / np.array(steps)[:, None]).T)
