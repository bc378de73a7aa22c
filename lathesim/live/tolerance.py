"""Slower only where it matters: a path timed so that the simulated contour error of a lesson's machine keeps a tolerance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import Place
from lathesim.identification.roles import behind_effects
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import Prepared, prepare
from lathesim.live.samples import SAME, LiveError
from lathesim.live.stepped_machine import SteppedMachine, axes_of
from lathesim.motion.axis_limits import AxisLimits
from lathesim.motion.kinematics import Chain, tool_speed_of
from lathesim.motion.retime import retime
from lathesim.motion.time_law import Timing, sample_times
from lathesim.plugins import load_registry
from lathesim.record import FloatArray
from lathesim.units import in_unit

_ROUNDS = 8
_NO_BETTER = 0.99
"""Share of the error that a round leaves at most to be worth another run."""
_SLOWER = 0.999
"""Share of the speed below which a place counts as slower."""
_SLOWEST = 0.1
"""Share of the speed below which slowing down is given up: what is left does not come from the speed."""
_CELLS = 400
"""Pieces of the path that may have a speed of their own."""
_SEARCH = 1.0
"""Seconds before and after a sample in which its foot point on the path is looked for."""
_SETTLE = 1.5
"""Seconds that the machine is simulated beyond the end."""


def within_tolerance(
    timing: Timing, limits: AxisLimits, lesson: str, tolerance: float, period: float, jerk: bool, chain: Chain | None
) -> tuple[Timing, dict[str, float]]:
    """Return a timing whose contour error keeps ``tolerance`` [m] where slowing down can do that, and what it cost.

    The contour error is the distance of the executed position from the path. Where it is too large, the speed falls by the root of the
    ratio, as the error of a curved path goes with the square of the speed; then the machine is simulated again.
    """
    if not tolerance > 0.0:
        raise LiveError("the tolerance is not above 0.", remedy="Give one like 10um.")
    prepared = prepare(load_lesson(lesson), load_registry([]))
    tool = tool_speed_of(timing.path, chain) if chain is not None or np.isfinite(limits.feed) else None
    share = np.ones(_CELLS)
    edges = np.linspace(0.0, timing.curve.length, _CELLS + 1)
    first = before = _errors(timing, prepared, period)
    best, after = timing, first
    for _ in range(_ROUNDS):
        if before[1].max() <= tolerance:
            break
        share = np.maximum(_SLOWEST, share * _reduction(edges, before, tolerance))
        floor = np.concatenate([share[:1], share, share[-1:]])
        slower = _Slower(0.5 * (edges[1:] + edges[:-1]), np.minimum(np.minimum(floor[:-2], floor[1:-1]), floor[2:]))
        trial = retime(timing.path, limits, jerk=jerk, tool_speed=tool, slower=slower)
        before = _errors(trial, prepared, period)
        if before[1].max() >= _NO_BETTER * after[1].max():
            break
        best, after = trial, before
    return best, {
        "before_m": float(first[1].max()),
        "after_m": float(after[1].max()),
        "tolerance_m": tolerance,
        "slower_share": float(np.mean(share < _SLOWER)),
        "duration_before_s": timing.duration,
    }


@dataclass(frozen=True, eq=False)
class _Slower:
    """The share of the speed along the path: straight lines between the middles of its pieces."""

    places: FloatArray
    shares: FloatArray

    def __call__(self, s: FloatArray) -> FloatArray:
        return np.interp(s, self.places, self.shares)


def _reduction(edges: FloatArray, errors: tuple[FloatArray, FloatArray], tolerance: float) -> FloatArray:
    """Return by how much each piece is to be slower: the root of tolerance over error, 1 where the tolerance is kept."""
    place, error = errors
    cell = np.clip(np.searchsorted(edges, place, side="right") - 1, 0, len(edges) - 2)
    worst = np.zeros(len(edges) - 1)
    np.maximum.at(worst, cell, error)
    return np.where(worst > tolerance, np.sqrt(0.95 * tolerance / np.maximum(worst, tolerance)), 1.0)


def _errors(timing: Timing, prepared: Prepared, period: float) -> tuple[FloatArray, FloatArray]:
    """Return where on the path (s) the tool was at each sample, and how far off the path [m]."""
    names = timing.path.names
    axes = axes_of(prepared, names, {})
    outputs = [_executed(prepared, axes[name]) for name in names]
    machine = SteppedMachine(prepared, axes, record=list(dict.fromkeys(outputs)))
    if abs(machine.period / period - 1.0) > SAME:
        taken = in_unit(machine.period, "ms", "g")
        raise LiveError(f"the machine of {prepared.name} takes a set-point every {taken}.", remedy=f"Use --period '{taken}'.")
    time = sample_times(timing.duration + _SETTLE, period)
    wanted = timing.at(np.minimum(time, timing.duration))[0]
    began = machine.advance(wanted[:1])[[machine.plan.channels.index(name) for name in outputs], 0]
    machine = SteppedMachine(prepared, axes, record=list(dict.fromkeys(outputs)))
    shifted = wanted - wanted[0] + began  # the machine stands where its lesson lets it stand
    executed = machine.advance(shifted)[[machine.plan.channels.index(name) for name in outputs]].T - began + wanted[0]
    return _distances(timing, time, wanted, executed, period)


def _distances(timing: Timing, time: FloatArray, wanted: FloatArray, executed: FloatArray, period: float) -> tuple[FloatArray, FloatArray]:
    reach = max(2, int(_SEARCH / period))
    places = timing.law.at(np.minimum(time, timing.duration))[0]
    best = np.full(len(time), np.inf)
    where = places.copy()
    for shift in range(-reach, 2):
        at = np.clip(np.arange(len(time)) + shift, 0, len(time) - 2)
        way = wanted[at + 1] - wanted[at]
        length = np.maximum(np.sum(way * way, axis=1), 1e-300)
        along = np.clip(np.sum((executed - wanted[at]) * way, axis=1) / length, 0.0, 1.0)
        distance = np.linalg.norm(executed - wanted[at] - along[:, None] * way, axis=1)
        nearer = distance < best
        best = np.where(nearer, distance, best)
        where = np.where(nearer, places[at], where)
    return where, best


def _executed(prepared: Prepared, targets: tuple[str, ...]) -> str:
    """Return the output that shows where an axis really is: what its controller's sensor looks at."""
    assembly = prepared.machinery
    for target in targets:
        name = Place.of(target).part
        sensor = behind_effects(assembly, f"{name}.{assembly.ports(name).get('measured', 'measured')}")
        host = Place.of(sensor).part
        if host in assembly.by_name:
            return behind_effects(assembly, f"{host}.{assembly.ports(host).get('measured', '')}") or sensor
    raise LiveError(f"no sensor shows what follows {', '.join(targets)}.", remedy="Choose a lesson whose axes are under control.")
