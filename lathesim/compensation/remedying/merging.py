"""Remedies of one kind at one place put together: two effects of an axis have one table, one bias, one friction feedforward."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from lathesim.compensation.remedying.bench import Line

_SUMMED = ("bias",)
"""Values that add up, whatever else is set."""


def merged(lines: Sequence[Line]) -> list[Line]:
    """Return the lines with those of one name put together, in the order of the first of each.

    Two that ask for different values of one parameter, as ripples of two periods do, stay two, the later ones numbered.
    """
    found: dict[str, Line] = {}
    for line in lines:
        names = (line.name, *(f"{line.name}_{number}" for number in range(2, len(lines) + 1)))
        name = next(name for name in names if name not in found or _agree(found[name], line))
        named = dataclasses.replace(line, name=name)
        found[name] = _both(found[name], named) if name in found else named
    return list(found.values())


def _agree(first: Line, second: Line) -> bool:
    shared = [name for name in first.values if name in second.values and name not in _SUMMED]
    return all(first.values[name] == second.values[name] for name in shared)


def _both(first: Line, second: Line) -> Line:
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
