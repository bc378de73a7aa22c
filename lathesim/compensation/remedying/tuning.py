"""The values of remedies found by simulation: what makes the diagnosed machine follow as the sound one does."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence

import numpy as np

from lathesim.compensation.remedying.bench import Bench, Line
from lathesim.component import Parameter
from lathesim.engine.assembly import FloatArray
from lathesim.identification.estimation.fit import Problem, fit
from lathesim.identification.records.fit import Free

_ROUNDS = 8
_WORTH = 1e-4
"""Steps of a search at most, and the share of the mean square that one must gain to be followed by another."""
_STEP = 0.03
_LEAD_STEP = 2e-4
"""Changes by which slopes are taken: a share of a value, and seconds of a lead."""


def deviation(bench: Bench, record: FloatArray, sound: FloatArray) -> FloatArray:
    """Return how far the tables are from where those of the sound machine are, all loops in one row [m]."""
    return (bench.table(record) - sound).ravel()


def tuned(bench: Bench, lines: Sequence[Line], free: Mapping[str, tuple[str, ...]]) -> dict[str, float]:
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
    return _STEP * abs(value) if value != 0.0 else _FIRST[name.rpartition(".")[2]]


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
    declared = {part.name: part.component.declared(Parameter) for part in bench.machinery.parts}
    items = [declared[name.partition(".")[0]][name.partition(".")[2]] for name in names]
    return np.array([item.low for item in items]), np.array([item.high for item in items])


def with_values(line: Line, found: Mapping[str, float]) -> Line:
    """Return a line with the values that were found for it."""
    own = {name.partition(".")[2]: value for name, value in found.items() if name.partition(".")[0] == line.name}
    return dataclasses.replace(line, values={**line.values, **own})
