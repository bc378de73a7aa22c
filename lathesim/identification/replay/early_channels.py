"""Channels that are early: a recording knows what comes, and a run does not.

A sensor that is early, or one whose clock is fast, shows at each sample what the machine does later. So does every channel of a recording
whose driven column is late. A run is made without that, and read ahead afterwards: y(t + a), with a the time by which it is early.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from lathesim.component import Parameter
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray, Place
from lathesim.engine.wiring import Plan
from lathesim.identification.replay.recorded_parts import CorrectedSight
from lathesim.identification.signal import SETTLING


class Shift(NamedTuple):
    """A parameter below zero of which a channel (``row``) is early: a time, or a share of the time that has passed. What a second sensor
    of one motion gets wrong acts on the motion as it was recorded."""

    row: int
    is_time: bool
    of_recorded: bool


def shifts_of(plan: Plan, channels: Sequence[str]) -> dict[str, Shift]:
    """Return the parameters (``part.parameter``) of a plan that may make some of its ``channels`` early."""
    found: dict[str, Shift] = {}
    for row, channel in enumerate(channels):
        output, of_recorded = channel, False
        while (placed := plan.parts.get(Place.of(output).part)) is not None:
            component = placed.component
            if component is CorrectedSight:
                output, of_recorded = plan.assembly.sources.get(f"{placed.name}.sensed", ""), True
                continue
            if not issubclass(component, Effect):
                break
            delay = component.identification.delay
            if delay and component.declared(Parameter)[delay].low < 0.0:
                found[f"{placed.name}.{delay}"] = Shift(row, component.declared(Parameter)[delay].unit == "s", of_recorded)
            output = plan.assembly.sources.get(f"{placed.name}.incoming", "")
    return found


def without_early(
    plan: Plan, shifts: Mapping[str, Shift], names: Sequence[str], values: FloatArray, period: float, samples: int
) -> tuple[list[str], FloatArray, FloatArray]:
    """Return names and values (runs, names) with which no channel is early by more than one sample of so many, and by how much each of some
    shifts was below zero where it was (runs, shifts). Part of a sample is as well told by the last ones: see :class:`ChannelTimeShift`."""
    here, found = list(names), np.array(values, dtype=float)
    early = np.zeros((len(found), len(shifts)))
    for place, (name, shift) in enumerate(shifts.items()):
        if name not in here:
            if plan.values[name] >= 0.0:
                continue
            here.append(name)
            found = np.column_stack([found, np.full(len(found), plan.values[name])])
        column = here.index(name)
        least = period if shift.is_time else 1.0 / samples
        early[:, place] = np.where(-found[:, column] > least, -found[:, column], 0.0)
        found[:, column] += early[:, place]
    return here, found, early


def ending_as_recorded(read: FloatArray, recorded: FloatArray, samples: FloatArray | float) -> FloatArray:
    """Return a signal that was read ahead by so many samples, with the course of the recorded one where nothing tells its own.

    That holds for a fiftieth of the recording at most: a shift by much of it would explain all of it.
    """
    number, end = np.arange(len(read)), len(read) - 1
    known = int(np.sum(number + samples <= end - 1))
    if known <= (1.0 - SETTLING) * len(read) or known > end or not np.isfinite(recorded[known - 1]):
        return read
    return np.concatenate([read[:known], recorded[known:] + (read[known - 1] - recorded[known - 1])])
