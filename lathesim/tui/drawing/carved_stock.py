"""The stock as the tool leaves it, from the recorded motion of the tip."""

from __future__ import annotations

import numpy as np

from lathesim.analysis.part.nothing_cut import RawStock
from lathesim.record import FloatArray

_CELLS = 2000


class CarvedStock:
    """Radius over z of a stock that is cut sample by sample; it may be followed forwards, and backwards from the start again.

    The rules are those of :class:`lathesim.components.stock.Stock`. The tip runs straight from sample to sample, rapid or not, and
    every cell it passes is cut to its radius. Feeding towards the axis, the edge takes along what stands towards the free end. Left out:
    the nose.
    """

    def __init__(self, stock: RawStock) -> None:
        self.stock = stock
        self.radius: FloatArray = np.full(_CELLS, stock.stock_radius)
        self._cell = stock.stock_length / _CELLS
        self._done = 0

    def cut(self, x: FloatArray, z: FloatArray, until: int) -> FloatArray:
        """Return the radius [m] (cells,) after the first ``until`` samples of the tip's radius and place, x and z [m]."""
        if until < self._done:
            self.radius = np.full(_CELLS, self.stock.stock_radius)
            self._done = 0
        if until > self._done:
            begin = max(0, self._done - 1)
            self._carve(x[begin:until], z[begin:until])
            self._done = until
        return self.radius

    def at(self, z: FloatArray) -> FloatArray:
        """Return the radius at places z [m]: the smallest between neighbouring places, 0 outside the stock."""
        edges = (np.asarray(z) - self.stock.face) / self._cell
        half = 0.5 * (edges[1] - edges[0]) if len(edges) > 1 else 0.5
        first = np.floor(edges - half).astype(int)
        last = np.maximum(np.ceil(edges + half).astype(int), first + 1)
        radius = np.zeros(len(edges))
        for place in np.flatnonzero((edges >= 0.0) & (edges <= _CELLS)):
            part = self.radius[max(first[place], 0) : min(last[place], _CELLS)]
            radius[place] = part.min() if len(part) else 0.0
        return radius

    def _carve(self, x: FloatArray, z: FloatArray) -> None:
        usable = np.isfinite(x) & np.isfinite(z)
        x, z = x[usable], z[usable]
        if not len(x):
            return
        places = np.clip((z - self.stock.face) / self._cell, -1.0, _CELLS + 1.0)
        steps = np.maximum(np.ceil(np.abs(np.diff(places))).astype(int), 1)
        index = np.repeat(np.arange(len(steps)), steps)
        share = (np.arange(len(index)) - np.repeat(np.cumsum(steps) - steps, steps) + 1) / steps[index] if len(index) else np.empty(0)
        along = np.append(places[0], places[index] + share * np.diff(places)[index])
        height = np.append(x[0], x[index] + share * np.diff(x)[index])
        cells = np.floor(along).astype(int)
        touched = (cells >= 0) & (cells < _CELLS) & (height < self.stock.stock_radius)
        np.minimum.at(self.radius, cells[touched], np.maximum(height[touched], 0.0))
        self._carve_beside(x, z, places)

    def _carve_beside(self, x: FloatArray, z: FloatArray, places: FloatArray) -> None:
        """Let the edge take along what stands between the tip and the free end while it feeds towards the axis."""
        edge = int(self.stock.edge_length / self._cell)
        if edge <= 0 or len(x) < 2:
            return
        side = -1 if self.stock.free_end < 0.0 else 1
        radial = (np.diff(x) < 0.0) & (-np.diff(x) > np.abs(np.diff(z)))
        for sample in np.flatnonzero(radial) + 1:
            cell = int(places[sample])
            if 0 <= cell < _CELLS and x[sample] < self.stock.stock_radius:
                first, last = (cell - edge, cell) if side < 0 else (cell + 1, cell + 1 + edge)
                beside = self.radius[max(first, 0) : min(last, _CELLS)]
                np.minimum(beside, max(x[sample], 0.0), out=beside)
