"""A channel that becomes another one in the middle of a recording: a plug that was changed, a logger that lost samples.

    recorded_k = (1 + a_i) made_k + c_i   or   recorded_k = made_(k - d_i) + c_i        in block i

What a baseline leaves of a channel is put down, block by block, to a scale that is off by a or to a channel that is late by d samples (c is
a zero). Of a machine both stay what they are or change slowly. Where one of them steps once, and with that step hardly anything is left of
what the best constant and the best steady change leave, the column changed and not the machine. Source: Basseville, Nikiforov, Detection of
Abrupt Changes (1993), section 2.6 (one change at an unknown time, by least squares).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from lathesim.diagnosis.fit import Fitted
from lathesim.diagnosis.problem import Rig
from lathesim.engine.assembly import FloatArray

_BLOCKS = 16
_EDGE = 2
"""Blocks at either end in which no step is looked for."""
_LEFT, _OF_STEADY = 0.2, 0.35
"""Shares of what the best constant and of what the best steady change leaves that a step may leave."""
_FURTHEST = 25
"""Samples by which a channel may become late or early."""
_SCALES = np.linspace(-0.2, 0.2, 401)
"""Steps of a scale that are looked for."""
_LEAST_SCALE = 0.003


def changed_midway(rig: Rig, fitted: Fitted) -> str:
    """Give a sentence where a channel's time, or the scale of one that shows the same motion as another, steps once in the middle of a
    recording; empty where none does. A force or a current may really change its scale, when something breaks."""
    seconds = {sight.row: rig.machine.compare[sight.first] for sight in rig.sensed.second_sight}
    for row, channel in enumerate(rig.machine.compare):
        residual = np.nan_to_num(fitted.residual[row])
        recorded = np.nan_to_num(rig.sensed.recorded[row])
        lags = range(-_FURTHEST, _FURTHEST + 1)
        step = _step(np.array([_power(recorded - _late(recorded - residual, lag)) for lag in lags]))
        if step is not None:
            place, (before, after) = step
            late = lags[after] - lags[before]
            return (
                f"From about {_when(rig, place):.3g} s on {channel} is {abs(late) * rig.sensed.period * 1e3:.3g} ms ({abs(late)} samples) "
                f"{'later' if late > 0 else 'earlier'} beside the other channels than before: samples were lost or repeated. "
                "Use what comes before, or after."
            )
        step = _step(np.array([_power(residual - scale * recorded) for scale in _SCALES])) if row in seconds else None
        if step is not None:
            place, (before, after) = step
            factor = (1.0 - _SCALES[before]) / (1.0 - _SCALES[after])
            if abs(factor - 1.0) > _LEAST_SCALE:
                return (
                    f"From about {_when(rig, place):.3g} s on {channel} is {factor:.4g} times what it was before, held against "
                    f"{seconds[row]}, which shows the same motion: its scale changed while it was recorded. Use what comes "
                    "before, or after."
                )
    return ""


def _when(rig: Rig, place: int) -> float:
    return place / _BLOCKS * rig.sensed.samples * rig.sensed.period


def _late(values: FloatArray, lag: int) -> FloatArray:
    """Give values (samples,) so many samples later, the ends held."""
    return values[np.clip(np.arange(len(values)) - lag, 0, len(values) - 1)]


def _power(left: FloatArray) -> FloatArray:
    """Give the power of what is left about its mean in each block (blocks,)."""
    return np.array([len(block) * float(np.var(block)) for block in np.array_split(left, _BLOCKS)])


def _step(power: FloatArray) -> tuple[int, tuple[int, int]] | None:
    """Give the block from which on another row of ``power`` (choices, blocks) leaves less, and the two rows; none where a single row or a
    steady change over rows does nearly as well."""
    place, pair, left = min(_steps(power), key=lambda step: step[2])
    steady = min(float(np.sum(power[line, np.arange(_BLOCKS)])) for line in _lines(len(power)))
    constant = float(np.min(np.sum(power, axis=1)))
    return (place, pair) if pair[0] != pair[1] and left < min(_LEFT * constant, _OF_STEADY * steady) else None


def _steps(power: FloatArray) -> Iterator[tuple[int, tuple[int, int], float]]:
    for place in range(_EDGE, _BLOCKS - _EDGE + 1):
        halves = [np.sum(half, axis=1) for half in (power[:, :place], power[:, place:])]
        pair = (int(np.argmin(halves[0])), int(np.argmin(halves[1])))
        yield place, pair, float(halves[0][pair[0]] + halves[1][pair[1]])


def _lines(count: int) -> Iterator[npt.NDArray[np.int64]]:
    """Give rows that change steadily from one of ``count`` to another, block by block."""
    some = range(0, count, max(1, count // 40))
    for first, last in itertools.product(some, some):
        yield np.rint(np.linspace(first, last, _BLOCKS)).astype(np.int64)
