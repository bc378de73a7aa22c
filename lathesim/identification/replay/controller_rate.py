"""A recording that holds every k-th decision of its controllers: simulated at their rate, and held against the samples that are there.

At the recorder's rate a loop would be another, slower one. A command that a lesson declares held is held in between. What else was recorded
is interpolated by Akima's splines, which follow a smooth motion to the third order and hardly overshoot beside a step.
Source: Akima, A new method of interpolation and smooth curve fitting based on local procedures, Journal of the ACM 17 (1970), 589-602.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from lathesim.engine.assembly import Assembly, FloatArray, Part
from lathesim.identification.replay.recorded_parts import HeldSignal, LinearSignal, SplineTerm
from lathesim.identification.roles import closes_a_loop, decides

MOST = 10
"""Decisions for each sample up to which what happens in between is interpolated."""
_WHOLE = 0.01
"""How far a ratio of two periods may lie beside a whole number, as a share of it."""
_CLOCK = 5e-4
"""Share by which the clocks of two devices may differ."""
_SIGNALS = (HeldSignal, LinearSignal, SplineTerm)


def decisions_for_each(period: float, assembly: Assembly) -> int:
    """Return how often controllers decide for each recorded sample, on the same clock; 1 where they do so once, or on another."""
    ratio = period / assembly.sample_period
    whole = round(ratio)
    slower = 1 < whole <= MOST and abs(ratio - whole) < _WHOLE * whole
    return whole if slower and any(closes_a_loop(part) for part in assembly.parts) else 1


def clock_beside(period: float, assembly: Assembly) -> float:
    """Return how many times as long as the lesson says the periods of its controllers and converters are by the recording's clock, where
    that holds each or every k-th of their decisions; 1 where it is no further off than a clock, or holds something else."""
    ratio = period / assembly.sample_period
    beside = ratio / max(1, round(ratio))
    alike = _CLOCK < abs(beside - 1.0) < _WHOLE
    return beside if alike and any(decides(part.component) for part in assembly.parts) else 1.0


def at_controllers_rate(assembly: Assembly, decisions: int, held: Collection[str] = ()) -> Assembly:
    """Return an assembly that is sampled as a recording is with so many ``decisions`` for each of its samples; the recorded signals (parts)
    that were ``held`` change with a row alone."""
    if decisions == 1:
        return assembly
    parts = tuple(_finer(part, decisions, held=part.name in held) for part in assembly.parts)
    period = assembly.sample_period / decisions
    return replace(assembly, parts=parts, sample_period=period, step=dividing(period, assembly.step))


def dividing(period: float, step: float) -> float:
    """Return the longest step that divides a period and is no longer than ``step`` [s]."""
    return period / max(1, math.ceil(period / step - 1e-6))


def _finer(part: Part, decisions: int, *, held: bool) -> Part:
    if not issubclass(part.component, _SIGNALS):
        return part
    return replace(part, tables={name: _between(rows, decisions, held=held) for name, rows in part.tables.items()})


def _between(rows: FloatArray, decisions: int, *, held: bool) -> FloatArray:
    """Return rows (samples, values) with ``decisions`` - 1 between any two of them; each is repeated where it was
    ``held``, or where some of them were not recorded."""
    last = (len(rows) - 1) * decisions + 1
    if held or not np.isfinite(rows).all():
        return np.ascontiguousarray(np.repeat(rows, decisions, axis=0)[:last])
    return np.ascontiguousarray(Akima1DInterpolator(np.arange(len(rows)), rows)(np.arange(last) / decisions))
