"""Machines that a diagnosis leaves possible: values drawn together, as the recording that was diagnosed ties them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lathesim.compensation.remedying.bench import Bench
from lathesim.component import Parameter
from lathesim.engine.assembly import FloatArray
from lathesim.identification.machine.position_loops import resolution_of

_TO_ONE = 3.919928
"""Width of a 95 % interval over its standard deviation."""
_FINEST = 1e-9
"""Share of the largest value of a channel that counts as its floor where nothing rounds it."""
_LEAST = 1e-9
"""Precision of a direction in which neither recording nor lesson say anything, over that of the diagnosis."""

Intervals = Mapping[str, tuple[float, float, float]]
"""``part.parameter`` -> value, and the ends of its 95 % interval [SI]."""


def draws_of(
    bench: Bench, intervals: Intervals, prior: Mapping[str, float], free: Mapping[str, tuple[float, float]], count: int, seed: int
) -> list[dict[str, float]]:
    """Return ``count`` sets of values around their estimates, within what may be set.

    They are normal, with the standard deviations s of the diagnosis and the correlation R of what it was made from:

        R_ij = C_ij/sqrt(C_ii C_jj),   C = (J'J + diag(s^2/p^2))^-1,   J = d(channels/floors)/d(value/s)

    p is what the lesson calls uncertain. The diagnosis tells each interval by itself, and a motion fixes few of the values alone: with the
    force of a drive, mass and friction it tells their ratios only. Drawn apart they would move the table where the recording shows that it
    does not move. What is ``free``, as the side of a play at the start, is even over its
    range. Linear around the estimates. Source: G. A. F. Seber, C. J. Wild, Nonlinear Regression, Wiley 1989, section 2.1.2.
    """
    names = [name for name, (_, low, high) in intervals.items() if high > low]
    middle = {name: value for name, (value, _, _) in intervals.items()}
    rng = np.random.default_rng([seed, 5])
    loose = [{name: float(rng.uniform(*ends)) for name, ends in free.items()} for _ in range(count)]
    if not names:
        return [middle | item for item in loose]
    deviations = np.array([(intervals[name][2] - intervals[name][1]) / _TO_ONE for name in names])
    root = _root(correlation(bench, names, middle, deviations, prior))
    drawn = np.array([middle[name] for name in names]) + deviations * (rng.standard_normal((count, len(names))) @ root.T)
    low, high = _bounds(bench, names)
    rows = np.clip(drawn, low, high)
    return [{**middle, **dict(zip(names, map(float, row), strict=True)), **item} for row, item in zip(rows, loose, strict=True)]


def correlation(
    bench: Bench, names: Sequence[str], middle: Mapping[str, float], deviations: FloatArray, prior: Mapping[str, float]
) -> FloatArray:
    """Return the correlation of the errors of values, from how the unremedied machine answers to each."""
    _, high = _bounds(bench, names)
    values = np.array([middle[name] for name in names])
    steps = np.where(values + deviations <= high, deviations, -deviations)
    rows = [
        {**middle, **bench.bare},
        *[{**middle, **bench.bare, name: value + step} for name, value, step in zip(names, values, steps, strict=True)],
    ]
    records = [_seen(bench, record) for record in bench.runs(rows, exact=True)]
    slopes = np.stack([(record - records[0]) * np.sign(step) for record, step in zip(records[1:], steps, strict=True)], axis=1)
    slopes[~np.isfinite(slopes)] = 0.0
    known = np.array([(deviation / prior[name]) ** 2 if name in prior else 0.0 for name, deviation in zip(names, deviations, strict=True)])
    covariance = np.linalg.inv(slopes.T @ slopes + np.diag(known + _LEAST))
    scale = np.sqrt(np.diag(covariance))
    return np.asarray(covariance / np.outer(scale, scale))


def _seen(bench: Bench, record: FloatArray) -> FloatArray:
    """Return tables, readings and commands over what they resolve, all in one row."""
    rows = []
    for loop in bench.loops:
        for name, sensor in ((loop.table, loop.beyond.partition(".")[0]), (loop.reading, loop.sensor), (f"{loop.controller}.voltage", "")):
            values = bench.channel(record, name)
            if values is not None:
                floor = resolution_of(bench.machinery, sensor) if sensor else 0.0
                rows.append(values / max(floor, _FINEST * float(np.nanmax(np.abs(values))), 1e-300))
    return np.concatenate(rows)


def _root(matrix: FloatArray) -> FloatArray:
    """Return a root A of a correlation matrix,  A A' = R,  rounding below zero taken as zero."""
    sizes, directions = np.linalg.eigh(matrix)
    return np.asarray(directions * np.sqrt(np.maximum(sizes, 0.0)))


def _bounds(bench: Bench, names: Sequence[str]) -> tuple[FloatArray, FloatArray]:
    declared = {part.name: part.component.declared(Parameter) for part in bench.machinery.parts}
    items = [declared.get(name.partition(".")[0], {}).get(name.partition(".")[2]) for name in names]
    return (
        np.array([item.low if item is not None else -np.inf for item in items]),
        np.array([item.high if item is not None else np.inf for item in items]),
    )
