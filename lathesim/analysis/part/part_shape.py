"""The shape of the part as far as the tool passed it, from the recorded motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.analysis.metrics.metric import find_channel
from lathesim.record import FloatArray, Record

_CELLS = 1500


@dataclass(frozen=True)
class PartShape:
    """Radius over z: ``stock_radius`` before, ``radius`` (cells,) after cutting, at the places ``z`` (cells,); all in metres."""

    z: FloatArray
    radius: FloatArray
    stock_radius: float


def part_shape(record: Record, x: str = "x_axis.position", z: str = "z_axis.position") -> PartShape | None:
    """Return the shape that the tip leaves, or None where the record does not tell what was cut.

    The tip runs straight from sample to sample; over each place the smallest radius it reached inside the stock counts. Left out: the
    nose radius, and material the tool never came near.
    """
    stock, inside = find_channel(record, "stock.material_radius"), find_channel(record, "stock.inside_stock")
    if stock is None or inside is None or x not in record or z not in record or len(record) < 2:
        return None
    within = record[inside] > 0.5
    stock_radius = float(record[stock].max())
    if stock_radius <= 0.0 or not within.any():
        return None
    places, radii = record[z], record[x]
    low, high = float(places[within].min()), float(places[within].max())
    if high <= low:
        return None
    cells = np.linspace(low, high, _CELLS)
    shape = np.full(_CELLS, stock_radius)
    width = cells[1] - cells[0]
    for begin in np.flatnonzero(within[:-1] | within[1:]):
        here, there = sorted(((places[begin], radii[begin]), (places[begin + 1], radii[begin + 1])))
        first, last = int(np.ceil((here[0] - low) / width)), int(np.floor((there[0] - low) / width))
        first, last = max(first, 0), min(last, _CELLS - 1)
        if first > last:
            continue
        passed = np.interp(cells[first : last + 1], (here[0], there[0]), (here[1], there[1]))
        shape[first : last + 1] = np.minimum(shape[first : last + 1], np.maximum(passed, 0.0))
    return PartShape(cells, shape, stock_radius)
