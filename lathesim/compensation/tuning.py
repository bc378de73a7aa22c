"""The values of remedies: those of one kind at one place put together, then found by simulation."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence

import numpy as np

from lathesim.compensation.diagnosed_machine import Bench, InsertedRemedy
from lathesim.component import Parameter
from lathesim.engine.assembly import FloatArray, Place, of_part
from lathesim.identification.estimation.fit import Problem, fit
from lathesim.identification.records import Free

_SUMMED = ("bias",)
"""Values that add up, whatever else is set."""


def merged(lines: Sequence[InsertedRemedy]) -> list[InsertedRemedy]:
    """Return the lines with those of one name put together, in the order of the first of each.

    Two that ask for different values of one parameter, as ripples of two periods do, stay two, the later ones numbered.
    """
    found: dict[str, InsertedRemedy] = {}
    for line in lines:
        names = (line.name, *(f"{line.name}_{number}" for number in range(2, len(lines) + 1)))
        name = next(name for name in names if name not in found or _agree(found[name], line))
        named = dataclasses.replace(line, name=name)
        found[name] = _both(found[name], named) if name in found else named
    return list(found.values())


def _agree(first: InsertedRemedy, second: InsertedRemedy) -> bool:
    shared = [name for name in first.values if name in second.values and name not in _SUMMED]
    return all(first.values[name] == second.values[name] for name in shared)


def _both(first: InsertedRemedy, second: InsertedRemedy) -> InsertedRemedy:
    values = {**first.values, **second.values}
    for name in _SUMMED:
        if name in first.values and name in second.values:
            values[name] = first.values[name] + second.values[name]
    tables = dict(first.tables)
    for name, (columns, rows) in second.tables.items():
        if name not in tables:
            tables[name] = (columns, rows)
            continue
        mine = tables[name][1]
        places = np.unique(np.concatenate([mine[:, 0], rows[:, 0]]))
        together = [np.interp(places, mine[:, 0], mine[:, k]) + np.interp(places, rows[:, 0], rows[:, k]) for k in range(1, len(columns))]
        tables[name] = (columns, np.stack([places, *together], axis=1))
    return dataclasses.replace(
        first,
        values=values,
        tables=tables,
        answers=tuple(dict.fromkeys((*first.answers, *second.answers))),
        tuned=tuple(dict.fromkeys((*first.tuned, *second.tuned))),
        one_sided=tuple(dict.fromkeys((*first.one_sided, *second.one_sided))),
        free={**first.free, **second.free},
        share=min(first.share, second.share),
    )


_ROUNDS = 8
_WORTH = 1e-4
"""Steps of a search at most, and the share of the mean square that one must gain to be followed by another."""
_STEP = 0.03
_LEAD_STEP = 2e-4
"""Changes by which slopes are taken: a share of a value, and seconds of a lead."""


def deviation(bench: Bench, record: FloatArray, sound: FloatArray) -> FloatArray:
    """Return how far the tables are from where those of the sound machine are, all loops in one row [m]."""
    return (bench.table(record) - sound).ravel()


def tuned(bench: Bench, lines: Sequence[InsertedRemedy], free: Mapping[str, tuple[str, ...]]) -> dict[str, float]:
    """Return ``part.parameter`` -> value for the free parameters of the lines: a short fit from the given values."""
    names = [f"{line.name}.{name}" for line in lines for name in free.get(line.name, ())]
    if not names:
        return {}
    values = np.array([{f"{line.name}.{n}": v for line in lines for n, v in line.values.items()}.get(name, 0.0) for name in names])
    low, high = _bounds(bench, names)
    sound = bench.table(bench.runs([bench.sound], exact=True)[0])
    for line in lines:
        for short, begins in line.begins.items():
            place = names.index(f"{line.name}.{short}")
            tried = [np.where(np.arange(len(names)) == place, begin, values) for begin in begins]
            values = tried[int(np.argmin(_cost(bench, names, tried, sound)))]
    steps = np.array([_step(name, value) for name, value in zip(names, values, strict=True)])
    left = functools.partial(_left, bench, names, sound, np.sqrt(_cost(bench, names, [values], sound)[0]))
    fitted = [Free(name, value, step, *ends) for name, value, step, *ends in zip(names, values, steps, low, high, strict=True)]
    problem = Problem(left, fitted, steps=lambda values, before: steps)
    found = fit(problem, fitted, values, iterations=_ROUNDS, tolerance=_WORTH, least=0.0).values
    return dict(zip(names, map(float, found), strict=True))


def _left(bench: Bench, names: Sequence[str], sound: FloatArray, unit: float, rows: FloatArray) -> list[FloatArray]:
    """Return how far the tables are from the sound machine's for each row of values, in a unit [m]."""
    records = bench.runs([dict(zip(names, row, strict=True)) for row in rows], exact=True)
    return [deviation(bench, record, sound) / max(unit, 1e-30) for record in records]


def _cost(bench: Bench, names: Sequence[str], rows: Sequence[FloatArray], sound: FloatArray) -> list[float]:
    costs = [float(np.mean(left**2)) for left in _left(bench, names, sound, 1.0, np.array(rows))]
    return [cost if np.isfinite(cost) else np.inf for cost in costs]


def _step(name: str, value: float) -> float:
    if name.endswith((".lead", ".spread")):
        return _LEAD_STEP
    return _STEP * abs(value) if value != 0.0 else _FIRST[Place.of(name).port]


_FIRST = {
    "velocity_gain": 1e-2,
    "acceleration_gain": 1e-3,
    "jerk_gain": 1e-5,
    "per_speed": 1e-6,
    "per_acceleration": 1e-7,
    "drag": 0.2,
    "gain": 1e-2,
    "level": 1e-3,
    "bias": 1e-4,
    "excess": 1e-3,
    "amplitude": 1e-4,
    "width": 1e-7,
    "distance": 1e-7,
}
"""First change of a value that begins at zero [its SI unit]."""


def _bounds(bench: Bench, names: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    declared = {f"{part.name}.{name}": item for part in bench.machinery.parts for name, item in part.component.declared(Parameter).items()}
    items = [declared[name] for name in names]
    return np.array([item.low for item in items]), np.array([item.high for item in items])


def with_values(line: InsertedRemedy, found: Mapping[str, float]) -> InsertedRemedy:
    """Return a line with the values that were found for it."""
    return dataclasses.replace(line, values={**line.values, **of_part(line.name, found)})
