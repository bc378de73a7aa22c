"""What an emulation makes small: the mean square deviation at the way-points, of positions and, weighted, of speeds.

    Q = sum_channels w mean (y - y_model)^2,   w = 1 for a position, lambda for a speed

Source: A. Tiwari et al., J. Manuf. Syst. 68 (2023), section 2.3. Q adds m^2 and (m/s)^2, as printed there.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.free_values import FreeValue, values_of
from lathesim.experiments.wandering_clock import Wandering, likely_wandering, whitened
from lathesim.experiments.waypoints import Waypoints
from lathesim.units import same_dimension

FAR = 1.0
"""Deviation [SI] that stands for a run that diverged."""
STEP = 1e-3
"""Step of differences on the scale of the search."""
_WITHIN = 2e-3
"""Time [s] on either side of a way-point within which its speed is taken."""


@dataclass
class TriedPoints:
    """Every point that was tried on the scale of the search, with its Q."""

    points: list[FloatArray] = field(default_factory=list)
    costs: list[float] = field(default_factory=list)

    def best(self) -> FloatArray:
        """Return the point with the smallest Q."""
        return self.points[int(np.argmin(self.costs))]


class MachineReadings(Protocol):
    """What gives the readings of a machine for values of the free names; ``runs`` counts simulations, ``stop`` ends a batch."""

    @property
    def runs(self) -> int:
        """Simulations made so far."""

    stop: threading.Event | None

    def readings(
        self, values: FloatArray, only: Sequence[int] | None = None, later: float = 0.0, until: float = math.inf
    ) -> list[FloatArray]:  # fmt: skip
        """Return for each recording the readings (members, channels, times) [SI], ``later`` [s] than its times; NaN behind ``until``."""


class Objective:
    """Deviations of a replica from way-points, as a function of points on the scale of the search.

    ``floor`` [SI] is what one deviation is worth in a sum of squares; Q itself knows no floor. With ``wandering`` the squares are those of
    what is new in each deviation, given the earlier ones. Way-points behind ``until`` [s] do not count.
    """

    def __init__(
        self, replica: MachineReadings, free: Sequence[FreeValue], recorded: Sequence[Waypoints], weight: float, floor: float
    ) -> None:
        self.replica = replica
        self.free = tuple(free)
        self.recorded = tuple(recorded)
        self.weight = weight
        self.floor, self.least = floor, floor
        self.wandering: Wandering | None = None
        self.until = math.inf
        self.history = TriedPoints()
        self._weights = [np.array([self._weight(item, name) for name in item.channels]) for item in recorded]

    def _weight(self, item: Waypoints, name: str) -> float:
        return 1.0 if same_dimension(item.prepared.plan.unit(name), "m") else self.weight

    def deviations(self, points: FloatArray, only: Sequence[int] | None = None) -> list[FloatArray]:
        """Return model minus way-points, for each recording (members, channels, times); 0 where nothing was recorded or nothing counts, FAR
        where a run diverged."""
        rows = np.atleast_2d(points)
        chosen = range(len(self.recorded)) if only is None else only
        found = []
        for position, readings in zip(chosen, self.replica.readings(values_of(self.free, rows), only, 0.0, self.until), strict=True):
            measured = np.array([self.recorded[position].values[name] for name in self.recorded[position].channels])
            deviation = readings - measured
            ignored = np.isnan(measured) | (self.recorded[position].time > self.until)
            deviation = np.where(ignored, 0.0, np.where(np.abs(deviation) < FAR, deviation, FAR * np.sign(deviation + 1e-300)))
            found.append(np.where(np.isnan(deviation), FAR, deviation))
        return found

    def costs(self, points: FloatArray) -> FloatArray:
        """Return Q (members,) [m^2], and remember it."""
        rows = np.atleast_2d(points)
        total = np.zeros(len(rows))
        for deviation, weights in zip(self.deviations(rows), self._weights, strict=True):
            total += np.einsum("mct,c->m", np.square(deviation), weights) / deviation.shape[2]
        total /= len(self.recorded)
        self.history.points += list(rows)
        self.history.costs += [float(cost) for cost in total]
        return total

    def vector(self, points: FloatArray) -> FloatArray:
        """Return the weighted deviations in floors (members, numbers), whose squares add up to the misfit."""
        return np.concatenate([rows.reshape(len(rows), -1) for rows in self.news(points)], axis=1)

    def news(self, points: FloatArray) -> list[FloatArray]:
        """Return what is new in the deviations of each recording, in floors (members, channels, times)."""
        found = []
        for place, (deviation, weights) in enumerate(zip(self.deviations(points), self._weights, strict=True)):
            if self.wandering is None:
                found.append(deviation * (np.sqrt(weights)[:, None] / self.floor))
            else:
                time, rates = self.recorded[place].time, self.wandering.rates[place]
                found.append(whitened(deviation, weights, time, rates, self.wandering.spread, self.floor))
        return found

    def rates(self, point: FloatArray) -> tuple[FloatArray, ...]:
        """Return how fast each reading changes at a point, for each recording (channels, times) [SI/s]."""
        values = values_of(self.free, np.atleast_2d(point))
        ahead, behind = (self.replica.readings(values, None, sign * _WITHIN) for sign in (1.0, -1.0))
        return tuple(np.nan_to_num((after[0] - before[0]) / (2.0 * _WITHIN)) for after, before in zip(ahead, behind, strict=True))

    def wandering_of(self, recording: int) -> Wandering | None:
        """Return the wandering with the rates of one recording."""
        return self.wandering and Wandering(self.wandering.spread, (self.wandering.rates[recording],))

    def take_floor(self, point: FloatArray) -> None:
        """Set the floor to what is left at a point, at least what it was made with."""
        self.floor = max(self.least, self.floor * float(np.sqrt(np.square(self.vector(point)).mean())))

    def take_clock(self, point: FloatArray) -> None:
        """Set floor and wandering to those under which the deviations at a point are most likely."""
        rates = self.rates(point)
        deviations = [rows[0] for rows in self.deviations(point)]
        spread, floor = likely_wandering(deviations, self._weights, [item.time for item in self.recorded], rates)
        self.floor = max(self.least, floor)
        self.wandering = Wandering(spread, rates) if spread > 0.0 else None

    def slopes(self, point: FloatArray, wanted: Sequence[int] | None = None, here: FloatArray | None = None) -> FloatArray:
        """Return the derivatives of :meth:`vector` (numbers, names) by central differences, in one batch.

        With ``here``, the vector at the point, the differences are one-sided: half the runs, and exact enough to descend by.
        """
        count = len(self.free)
        chosen = list(range(count)) if wanted is None else list(wanted)
        steps = np.zeros((len(chosen), count))
        steps[np.arange(len(chosen)), chosen] = STEP
        if here is not None:
            return np.asarray((self.vector(point + steps) - here).T / STEP)
        moved = self.vector(np.vstack([point + steps, point - steps]))
        return np.asarray((moved[: len(chosen)] - moved[len(chosen) :]).T / (2.0 * STEP))

    def position_rms(self, point: FloatArray, settled: float = 0.0) -> list[float]:
        """Return for each recording sqrt(MSE(x) + MSE(y)) [m] of the positions from ``settled`` [s] on."""
        found = []
        for item, deviation in zip(self.recorded, self.deviations(point), strict=True):
            rows = [place for place, name in enumerate(item.channels) if same_dimension(item.prepared.plan.unit(name), "m")]
            late = item.time >= settled
            found.append(float(np.sqrt(np.square(deviation[0][rows][:, late]).mean(axis=1).sum())))
        return found
