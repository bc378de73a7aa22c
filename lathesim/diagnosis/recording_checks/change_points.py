"""A channel that becomes another one in the middle of a recording: a plug that was changed, a logger that lost samples.

    recorded_k = (1 + a_i) made_k + c_i   or   recorded_k = made_(k - d_i) + c_i        in block i

What a baseline leaves of a channel is put down, block by block, to a scale that is off by a or to a channel that is late by d samples (c is
a zero). Of a machine both stay what they are or change slowly. Where one of them steps once, and with that step hardly anything is left of
what the best constant and the best steady change leave, the column changed and not the machine. Source: Basseville, Nikiforov, Detection of
Abrupt Changes (1993), section 2.6 (one change at an unknown time, by least squares).
"""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from lathesim.analysis.display_unit import shown_with_unit
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import FloatArray, Place
from lathesim.identification.records import Fitted
from lathesim.identification.replay.experiment import Experiment
from lathesim.identification.signal import late, strongest_jumps

_BLOCKS = 16
"""Blocks of a recording between which a step is looked for, but for two at either end."""


def changed_midway(experiment: Experiment, fitted: Fitted, method: Method = STANDARD) -> str:
    """Return a sentence where a channel's time, or the scale of one that another tells too, steps once in the middle of a recording; empty
    where none does. What is told by another is a motion that two sensors show, and the current that a drive's command and motion make: were
    it really another one, the motion would be. A force may really change its scale, when something breaks."""
    told_by, furthest, scale_step = _told_by_others(experiment), 25, 0.001
    for row, channel in enumerate(experiment.machine.compare):
        residual = np.nan_to_num(fitted.residual[row])
        recorded = np.nan_to_num(experiment.sensed.recorded[row])
        lags = range(-furthest, furthest + 1)
        step = _step(np.array([_power(recorded - late(recorded - residual, lag)) for lag in lags]), method=method)
        # from one end of the delays that are looked for to the other nothing is found: what was left out runs beside the motion
        if step is not None and abs(lags[step[1][1]] - lags[step[1][0]]) <= furthest:
            place, (before, after) = step
            by = lags[after] - lags[before]
            milliseconds = abs(by) * experiment.sensed.period * 1e3
            return (
                f"From about {_when(experiment, place):.3g} s on {channel} is {milliseconds:.3g} ms ({abs(by)} samples) "
                f"{'later' if by > 0 else 'earlier'} beside the other channels than before: samples were lost or repeated. "
                "Use what comes before, or after."
            )
        scales = scale_step * np.arange(-200, 201)
        scaled = np.array([_power(residual - scale * recorded) for scale in scales]) if row in told_by else None
        if scaled is not None and (step := _step(scaled, method=method)) is not None:
            place, (before, after) = step
            factor = (1.0 - scales[before]) / (1.0 - scales[after])
            if abs(factor - 1.0) > method.errors * scale_step and not _moves_otherwise(experiment, fitted, row, method=method):
                when = _when(experiment, place)
                return (
                    f"From about {when:.3g} s on {channel} is {factor:.4g} times what it was before, held against {told_by[row]}: "
                    "its scale changed while it was recorded. Use what comes before, or after."
                )
    return ""


def jumped_midway(experiment: Experiment, fitted: Fitted, method: Method = STANDARD) -> str:
    """Return a sentence where of two sensors of one motion one jumps beside the other once, and stays there; empty where none does. In both
    recordings that is an effect, LostCounts; in one it happened to that one."""
    for sight in (sight for sight in experiment.sensed.redundant_sensors if not sight.rate):
        residual = np.nan_to_num(fitted.residual[sight.row])
        instant, size = strongest_jumps(residual, experiment.sensed.period)[0]
        stepped = np.where(np.arange(len(residual)) * experiment.sensed.period < instant, 0.0, size)
        left = float(np.var(residual - stepped)) / max(float(np.var(residual)), 1e-300)
        if abs(size) > method.errors * experiment.sensed.seen_floors[sight.row] and left < method.little:
            names = [experiment.machine.compare[row] for row in (sight.row, sight.first)]
            shown = shown_with_unit(abs(size), experiment.sensed.plan.unit(experiment.sensed.channels[sight.row]), 3)
            return (
                f"At about {instant:.3g} s {names[0]} jumps by {shown} beside {names[1]}, which shows the same motion, and stays: one "
                f"of them lost counts in {experiment.name} (LostCounts)."
            )
    return ""


def _told_by_others(experiment: Experiment) -> dict[int, str]:
    """Return the channels (rows) that are told by others too, with what tells them."""
    found = {
        sight.row: f"{experiment.machine.compare[sight.first]}, which shows the same motion"
        for sight in experiment.sensed.redundant_sensors
    }
    for row, channel in enumerate(experiment.machine.compare):
        ports = experiment.machine.assembly.ports(channel)
        if "back_emf" in ports and Place.of(channel).port == ports.get("current"):
            found[row] = "what the drive makes of its command, with which the axis moves as it did"
    return found


def _moves_otherwise(experiment: Experiment, fitted: Fitted, row: int, method: Method = STANDARD) -> bool:
    """Return whether another channel than ``row`` is off, sample to sample, by far more than it resolves: the machine changed."""
    others = np.delete(np.nan_to_num(fitted.residual), row, axis=0)
    floors = np.delete(experiment.sensed.seen_floors, row)
    return bool(np.any(np.mean(np.diff(others, axis=1) ** 2, axis=1) > 2.0 * (method.errors * floors) ** 2))


def _when(experiment: Experiment, place: float) -> float:
    return place / _BLOCKS * experiment.sensed.samples * experiment.sensed.period


def _power(left: FloatArray) -> FloatArray:
    """Return the power of what is left about its mean in each block (blocks,)."""
    return np.array([len(block) * float(np.var(block)) for block in np.array_split(left, _BLOCKS)])


def _step(power: FloatArray, method: Method = STANDARD) -> tuple[float, tuple[int, int]] | None:
    """Return the block above which another row of ``power`` (choices, blocks) leaves less, and the two rows; none where a single row or a
    steady change over rows does nearly as well."""
    steps = list(_steps(power))
    _, pair, left = min(steps, key=lambda step: step[2])
    # where a part stands still the step may be earlier or later
    place = float(np.mean([other for other, rows, error in steps if rows == pair and error <= method.alike * left]))
    blocks = power.shape[1]
    steady = float(np.min(np.sum(power[_lines(len(power), blocks), np.arange(blocks)], axis=1)))
    constant = float(np.min(np.sum(power, axis=1)))
    return (place, pair) if pair[0] != pair[1] and left < method.larger_part**2 * min(constant, steady) else None


def _steps(power: FloatArray) -> Iterator[tuple[int, tuple[int, int], float]]:
    for place in range(2, _BLOCKS - 1):
        halves = [np.sum(half, axis=1) for half in (power[:, :place], power[:, place:])]
        pair = (int(np.argmin(halves[0])), int(np.argmin(halves[1])))
        yield place, pair, float(halves[0][pair[0]] + halves[1][pair[1]])


@functools.cache
def _lines(count: int, blocks: int) -> npt.NDArray[np.int64]:
    """Return rows (lines, blocks) that change steadily from one of ``count`` to another, block by block."""
    some = np.arange(0, count, max(1, count // 40))
    first, last = (ends.ravel() for ends in np.meshgrid(some, some, indexing="ij"))
    return np.rint(np.linspace(first, last, blocks, axis=1)).astype(np.int64)
