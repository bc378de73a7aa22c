"""Which changes of the structure a machine needs: looked at on one machine that holds all of them, judged on programs not fitted."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.emulation.free_values import FreeValue, bounds, values_of
from lathesim.experiments.emulation.left_out import gained, left_out
from lathesim.experiments.emulation.methods import descend
from lathesim.experiments.emulation.objective import Objective
from lathesim.experiments.emulation.only_noise import is_noise
from lathesim.experiments.emulation.structure import Change
from lathesim.experiments.replica import Replica, given_values
from lathesim.experiments.waypoints import Waypoints

_MOST_CHANGES = 8
_TRIED = 2
"""Changes of each round that are fitted in full, after a first look at all of them."""
_SURE = 2.0
"""Standard errors by which a change must better the programs not fitted."""
_RUNS = 10
"""Descents of a trial, each with its set of derivatives."""

Say = Callable[[str], None]


class HeldReplica:
    """A replica of which only some values are asked for: the others are held [SI]."""

    def __init__(self, replica: Replica, names: Sequence[str], held: FloatArray) -> None:
        self.replica, self.held = replica, held
        self.columns = [replica.names.index(name) for name in names]

    @property
    def runs(self) -> int:
        """Simulations made so far."""
        return self.replica.runs

    @property
    def stop(self) -> threading.Event | None:
        """What ends a batch."""
        return self.replica.stop

    @stop.setter
    def stop(self, event: threading.Event | None) -> None:
        self.replica.stop = event

    def readings(self, values: FloatArray, only: Sequence[int] | None = None) -> list[FloatArray]:
        """Return what the replica reads with these values and the others held."""
        whole = np.tile(self.held, (len(values), 1))
        whole[:, self.columns] = values
        return self.replica.readings(whole, only)


@dataclass(frozen=True, eq=False)
class Chosen:
    """The changes that were kept, and the point of base values and what the changes bring."""

    changes: tuple[Change, ...]
    point: FloatArray
    stopped: bool = False


class StructureSearch:
    """A machine that holds all changes, each neutral until it is chosen."""

    def __init__(
        self, replica: Replica, free: Sequence[FreeValue], changes: Sequence[Change], recorded: Sequence[Waypoints], weight: float,
        floor: float, say: Say,
    ) -> None:  # fmt: skip
        self.replica, self.free, self.changes, self.recorded = replica, list(free), list(changes), recorded
        self.weight, self.floor, self.say = weight, floor, say
        self.neutral = given_values(replica.plan, replica.names)
        for change in changes:
            for value, idle in zip(change.brings, change.neutral, strict=True):
                self.neutral[replica.names.index(value.name)] = idle

    def objective(self, chosen: Sequence[Change]) -> Objective:
        """Return the objective of the machine with these changes: its base values and what they bring are free."""
        free = [*self.free, *(value for change in chosen for value in change.brings)]
        held = HeldReplica(self.replica, [item.name for item in free], self.neutral)
        return Objective(held, free, self.recorded, self.weight, self.floor)

    def run(self, start: FloatArray) -> Chosen:
        """Return what is kept: change after change, while one betters the programs not fitted and what is left is more than noise.

        In each round every change is looked at where its probes are, with all other values refitted on straight lines. The best two are
        fitted in full. Ctrl-C keeps what was kept so far.
        """
        chosen: tuple[Change, ...] = ()
        point, starts = start, [start, np.zeros(len(start))]
        objective = self.objective(())
        try:
            judged, slopes = left_out(objective, point)
            while len(chosen) < _MOST_CHANGES and not is_noise(objective, point, slopes):
                best: tuple[float, Change, FloatArray, FloatArray, FloatArray] | None = None
                for change, begin in self._looked(chosen, starts)[:_TRIED]:
                    trial = self.objective((*chosen, change))
                    end = self._fitted(trial, begin)
                    away, slopes = left_out(trial, end)
                    self.say(f"  with {change.title}: {self._size(away)} on the program left out, {self._size(judged)} without")
                    worth = gained(judged, away)
                    if best is None or float(np.square(away).sum()) < float(np.square(best[3]).sum()):
                        best = (worth, change, end, away, slopes)
                if best is None or best[0] < _SURE:
                    break
                _, kept, point, judged, slopes = best
                chosen, starts = (*chosen, kept), [point]
                objective = self.objective(chosen)
                self.say(f"Kept: {kept.title}.")
        except KeyboardInterrupt:
            return Chosen(chosen, point, stopped=True)
        return Chosen(chosen, point)

    def _size(self, deviations: FloatArray) -> str:
        return f"{1e3 * self.floor * float(np.sqrt(np.square(deviations).mean())):.4g} mm"

    def _fitted(self, objective: Objective, start: FloatArray) -> FloatArray:
        """Return the end of a descent, with the floor at what is left so that what the lesson says of values has its weight."""
        low, high = bounds(objective.free)
        quiet: Callable[[int, float], None] = lambda runs, cost: None  # noqa: E731
        left = self.floor * max(1.0, float(np.sqrt(np.square(objective.vector(start)[0]).mean())) / 3.0)
        for most in (_RUNS, _RUNS // 2):
            objective.floor = left
            start = descend(objective, low, high, start, quiet, most, 1e-3)
            now = left * float(np.sqrt(np.square(objective.vector(start)[0]).mean()))
            left = max(self.floor, now)
        objective.floor = self.floor
        return start

    def _looked(self, chosen: Sequence[Change], starts: Sequence[FloatArray]) -> list[tuple[Change, FloatArray]]:
        """Return the changes not chosen yet, the one that promises most first, each with the point to begin its fit at."""
        rest = [change for change in self.changes if change not in chosen]
        if not rest:
            return []
        base = self.objective(chosen)
        places = [self.replica.names.index(item.name) for item in base.free]
        found: dict[str, tuple[float, Change, FloatArray]] = {}
        for start in starts:
            slopes = base.slopes(start)
            shared = self.neutral.copy()
            shared[places] = values_of(base.free, start)
            owner = [(change, probe) for change in rest for probe in change.probes]
            rows = np.tile(shared, (len(owner), 1))
            for row, (change, probe) in zip(rows, owner, strict=True):
                row[[self.replica.names.index(value.name) for value in change.brings]] = probe
            for (change, probe), residual in zip(owner, self._deviations(rows), strict=True):
                shift, cost = _refitted(base, slopes, start, residual)
                if change.title not in found or cost < found[change.title][0]:
                    found[change.title] = (cost, change, np.concatenate([start + shift, _scaled(change, probe)]))
        return self._confirmed(base, [(change, point) for _, change, point in found.values()], starts)

    def _confirmed(
        self, base: Objective, looked: Sequence[tuple[Change, FloatArray]], starts: Sequence[FloatArray]
    ) -> list[tuple[Change, FloatArray]]:
        """Return changes with where to begin, in the order of what they leave when they are run: straight lines may lead astray."""
        count = len(base.free)
        tried = [
            (change, np.concatenate([start + share * (point[:count] - start), point[count:]]))
            for change, point in looked
            for start in starts
            for share in (1.0, 0.3)
        ]
        rows = np.tile(self.neutral, (len(tried), 1))
        for row, (change, point) in zip(rows, tried, strict=True):
            free = [*base.free, *change.brings]
            row[[self.replica.names.index(item.name) for item in free]] = values_of(free, point)
        costs = np.square(self._deviations(rows)).sum(axis=1)
        best: dict[str, tuple[Change, FloatArray]] = {}
        for place in np.argsort(costs):
            best.setdefault(tried[place][0].title, tried[place])
        return list(best.values())

    def _deviations(self, rows: FloatArray) -> FloatArray:
        """Return the deviations (members, numbers) in floors for values [SI] of everything that the machine holds."""
        free = [FreeValue(name, "1", 0.0, -np.inf, np.inf, 1.0) for name in self.replica.names]
        held = HeldReplica(self.replica, self.replica.names, self.neutral)
        return Objective(held, free, self.recorded, self.weight, self.floor).vector(rows)


def _scaled(change: Change, probe: FloatArray) -> FloatArray:
    """Return a probe on the scale of the search, within the bounds of the values."""
    low, high = bounds(change.brings)
    return np.clip([value.to_scale(max(float(size), value.low)) for value, size in zip(change.brings, probe, strict=True)], low, high)


def _refitted(base: Objective, slopes: FloatArray, start: FloatArray, residual: FloatArray) -> tuple[FloatArray, float]:
    """Return the shift of the base values that makes a deviation least, within their bounds, and what it leaves."""
    from scipy.optimize import lsq_linear

    spread = np.array([item.spread for item in base.free])
    low, high = bounds(base.free)
    noise = float(np.sqrt(np.square(residual).mean())) / 3.0 + 1.0
    stacked = np.vstack([slopes / noise, np.diag(1.0 / spread)])
    goal = np.concatenate([-residual / noise, -start / spread])
    shift = np.linalg.lstsq(stacked, goal, rcond=None)[0]
    if np.any(start + shift < low) or np.any(start + shift > high):
        gap = 1e-9
        shift = np.asarray(
            lsq_linear(stacked, goal, (np.minimum(low - start, -gap), np.maximum(high - start, gap)), method="bvls", max_iter=30).x
        )
    left = residual + slopes @ shift
    return shift, float(np.square(left).sum() + noise**2 * np.square((start + shift) / spread).sum())
