"""What the twin's screen draws: path and surface as asked for, executed and simulated, in memory that does not grow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.live.twin import TwinStretch
from lathesim.record import FloatArray

SHOWN = 20.0
"""Seconds of the path that are drawn."""
_POINTS = 2000
"""Points that are kept of them."""
PLACES = 200
"""Places of the way at which the surface is kept."""


@dataclass(frozen=True, eq=False)
class Ways:
    """Where the axes were asked to go, went, and would have gone in the simulation: (axes, points) [SI], with the ``time`` (points,)."""

    time: FloatArray
    reference: FloatArray
    executed: FloatArray
    simulated: FloatArray


class TwinPicture:
    """Keeps what was shown last. ``pairs`` holds for each driven axis the row of the compared channel that measures it."""

    def __init__(self) -> None:
        self.pairs: list[tuple[int, int]] = []
        self._apart: FloatArray | None = None
        self._points = np.zeros((1, 0))
        self._every = 0.0
        self._axes = 0
        self._surface: dict[tuple[int, int], tuple[float, float, float]] = {}
        self._span = [np.inf, -np.inf]

    def take(self, stretch: TwinStretch) -> None:
        """Take what the twin has just done."""
        self._pair(stretch)
        if not self.pairs:
            return
        axes = min(2, len(self.pairs))
        self._axes = axes
        self._every = max(self._every, SHOWN / _POINTS)
        rows = [stretch.reference[driven] for driven, _ in self.pairs[:axes]]
        rows += [stretch.executed[channel] for _, channel in self.pairs[:axes]]
        rows += [stretch.simulated[channel] for _, channel in self.pairs[:axes]]
        table = np.vstack([stretch.time, *rows])
        step = max(1, round(self._every / max(float(np.median(np.diff(stretch.time))), 1e-9))) if len(stretch.time) > 1 else 1
        kept = table[:, ::step]
        joined = kept if self._points.shape[0] != len(kept) else np.concatenate([self._points, kept], axis=1)
        self._points = joined[:, joined[0] > stretch.time[-1] - SHOWN][:, -_POINTS:]
        self._mark(table)

    def _pair(self, stretch: TwinStretch) -> None:
        """Find for each driven axis the channel of its unit whose simulation follows it most closely, in all that came so far."""
        apart = np.array([[np.sum((row - wanted) ** 2) for row in stretch.simulated] for wanted in stretch.reference])
        self._apart = apart if self._apart is None else self._apart + apart
        pairs = []
        for driven, unit in enumerate(stretch.units[0]):
            same = [row for row, other in enumerate(stretch.units[1]) if other == unit]
            if same:
                least = min(float(self._apart[driven, row]) for row in same)
                # of an encoder and a scale that agree the last is nearer to the tool
                pairs.append((driven, [row for row in same if self._apart[driven, row] <= 2.0 * least][-1]))
        if pairs != self.pairs:
            self.pairs = pairs
            self._points, self._surface = self._points[:, :0], {}

    def _mark(self, table: FloatArray) -> None:
        """Keep what each place of the way looks like now: the difference there, or of two axes the innermost radius."""
        axes = self._axes
        along = table[axes]  # the last driven axis: Z on a lathe, the only one otherwise
        self._span = [min(self._span[0], float(along.min())), max(self._span[1], float(along.max()))]
        width = self._span[1] - self._span[0]
        if width <= 0.0 or table.shape[1] < 2:
            return
        executed, simulated = table[1 + axes], table[1 + 2 * axes]
        places = np.round(along / max(width / PLACES, 1e-9)).astype(np.int64)
        if len(self._surface) > 4 * PLACES:
            self._surface = {}
        steps = np.diff(table[axes])
        forth = np.concatenate([steps[:1], steps]) >= 0.0
        for place in np.unique(places):
            for way in (0, 1):
                here = (places == place) & (forth == bool(way))
                if not here.any():
                    continue
                where = float(along[here].mean())
                if axes > 1:
                    self._surface[int(place), 0] = (where, float(executed[here].min()), float(simulated[here].min()))
                else:
                    self._surface[int(place), way] = (where, float(np.mean((executed - simulated)[here])), 0.0)

    @property
    def ways(self) -> Ways | None:
        """Return the newest part of the path; None before there is one."""
        axes = self._axes
        if not axes or self._points.shape[1] < 2:
            return None
        p = self._points
        return Ways(p[0], p[1 : 1 + axes], p[1 + axes : 1 + 2 * axes], p[1 + 2 * axes : 1 + 3 * axes])

    @property
    def surface(self) -> FloatArray:
        """Return place, innermost radius executed and simulated of two axes, (3, places), in the order of the way."""
        rows = np.array(sorted(value for (_, way), value in self._surface.items() if way == 0))
        return np.asarray(rows.T if len(rows) else np.zeros((3, 0)))

    @property
    def differences(self) -> tuple[FloatArray, FloatArray]:
        """Return places and the difference there of one axis, (2, places), going back and forth."""
        found = []
        for way in (0, 1):
            rows = np.array(sorted(value[:2] for (_, other), value in self._surface.items() if other == way))
            found.append(rows.T if len(rows) else np.zeros((2, 0)))
        return found[0], found[1]


def magnified(executed: FloatArray, simulated: FloatArray, times: float) -> FloatArray:
    """Return what was executed, its difference from the simulation magnified."""
    return simulated + times * (executed - simulated)


def nice_magnification(ways: Ways) -> float:
    """Return a round number that makes the largest difference a tenth of the way."""
    error = float(np.abs(ways.executed - ways.simulated).max())
    way = float(np.ptp(ways.reference, axis=1).max())
    if error <= 0.0 or way <= 0.0:
        return 1.0
    exact = max(1.0, 0.1 * way / error)
    power = 10.0 ** np.floor(np.log10(exact))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= exact))
