"""Remedies of one kind at one place put together: two effects of an axis have one table, one bias, one friction feedforward."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from lathesim.compensation.remedying.bench import Line

_SUMMED = ("bias", "strain", "growth")


def merged(lines: Sequence[Line]) -> list[Line]:
    """Return the lines with those of one name put together, in the order of the first of each."""
    found: dict[str, Line] = {}
    for line in lines:
        found[line.name] = _both(found[line.name], line) if line.name in found else line
    return list(found.values())


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
