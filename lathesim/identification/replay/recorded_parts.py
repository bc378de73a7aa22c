"""Recorded signals as parts of a machine: what was measured takes the place of what would be computed.

Both walk along a table with one row a sample and one column, the value, from the first sample of the run on. After its end the last row
stays.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lathesim.component import Component, DiscreteState, Input, Output, Parameter, Table
from lathesim.engine.assembly import FloatArray, Part


def row_at(position: float, table: Any) -> int:
    """Return the row for a sample, the last one where the table has ended."""
    last = len(table) - 1
    row = int(position)
    return row if row < last else last


class HeldSignal(Component):
    """A recorded signal that stays at its value until the next sample, as what a converter or controller puts out does."""

    position = DiscreteState("1", 0.0, doc="number of the next row")
    now = DiscreteState("{signal}", 0.0, doc="value of the present sample")
    recorded = Table("{signal}", ("value",), doc="recorded values, one row a sample")
    value = Output("{signal}", doc="recorded signal")

    @staticmethod
    def update(position: float, recorded: Any) -> tuple[float, float]:
        return position + 1.0, recorded[row_at(position, recorded)][0]

    @staticmethod
    def output(now: float) -> float:
        return now


class LinearSignal(Component):
    """A recorded signal that moves on a straight line from sample to sample, as a position or a force does."""

    position = DiscreteState("1", 0.0, doc="number of the next row")
    now = DiscreteState("{signal}", 0.0, doc="value of the present sample")
    slope = DiscreteState("{signal}/s", 0.0, doc="slope towards the next sample")
    since = DiscreteState("s", 0.0, doc="time of the present sample")
    recorded = Table("{signal}", ("value",), doc="recorded values, one row a sample")
    value = Output("{signal}", doc="recorded signal")

    @staticmethod
    def update(position: float, recorded: Any, time: float, sample_period: float) -> tuple[float, float, float, float]:
        here = recorded[row_at(position, recorded)][0]
        following = recorded[row_at(position + 1.0, recorded)][0]
        return position + 1.0, here, (following - here) / sample_period, time

    @staticmethod
    def output(now: float, slope: float, since: float, time: float) -> float:
        return now + slope * (time - since)


def recorded_signal(name: str, component: type[HeldSignal] | type[LinearSignal], unit: str, values: FloatArray) -> Part:
    """Return the part of a name that gives recorded values (samples,) [``unit``]."""
    table = np.ascontiguousarray(np.asarray(values, dtype=float).reshape(-1, 1))
    return Part(name, component.with_units({"signal": unit}), tables={"recorded": table})


class SensedMotion(Component):
    """What an effect senses of its host's motion:  value = share recorded + (1 - share) simulated.

    A candidate senses the recorded motion: its force is then a known function of time. One that sticks, once it is in the model, has to
    sense the motion it stops.
    """

    recorded = Input("{signal}", doc="recorded motion")
    simulated = Input("{signal}", doc="simulated motion")
    value = Output("{signal}", doc="what the effect senses")
    share = Parameter("1", 1.0, low=0.0, high=1.0, doc="share of the recorded motion")

    @staticmethod
    def output(recorded: float, simulated: float, share: float) -> float:
        return simulated + share * (recorded - simulated)


class CorrectedSight(Component):
    """What a sensor shows of a simulated motion, with its errors taken at the recorded one.

    reading = simulated + (sensed - recorded);   sensed: what the sensor makes of the recorded motion

    A simulation without feedback drifts away from where the machine was; an error that belongs to a place or a time would be looked for
    in the wrong one.
    """

    sensed = Input("{signal}", doc="what the sensor makes of the recorded motion")
    simulated = Input("{signal}", doc="simulated motion")
    recorded = Input("{signal}", doc="recorded motion")
    reading = Output("{signal}", doc="what the sensor shows")

    @staticmethod
    def output(simulated: float, recorded: float, sensed: float) -> float:
        return simulated + (sensed - recorded)


class SplineTerm(Component):
    """A force or signal added on a wire: the weighted sum of eight recorded functions. It finds out what a mismatch depends on.

    out = in + sum_j weight_j basis_j(t_k)
    """

    position = DiscreteState("1", 0.0, doc="number of the next row")
    added = DiscreteState("{signal}", 0.0, doc="what is added in the present sample")
    basis = Table("1", tuple(f"basis_{number}" for number in range(8)), doc="eight functions, one row a sample")
    incoming = Input("{signal}", doc="what the wire carries")
    outgoing = Output("{signal}", doc="what arrives")
    weight_0 = Parameter("{signal}", 0.0, doc="weight of function 0")
    weight_1 = Parameter("{signal}", 0.0, doc="weight of function 1")
    weight_2 = Parameter("{signal}", 0.0, doc="weight of function 2")
    weight_3 = Parameter("{signal}", 0.0, doc="weight of function 3")
    weight_4 = Parameter("{signal}", 0.0, doc="weight of function 4")
    weight_5 = Parameter("{signal}", 0.0, doc="weight of function 5")
    weight_6 = Parameter("{signal}", 0.0, doc="weight of function 6")
    weight_7 = Parameter("{signal}", 0.0, doc="weight of function 7")

    @staticmethod
    def update(
        position: float,
        basis: Any,
        weight_0: float,
        weight_1: float,
        weight_2: float,
        weight_3: float,
        weight_4: float,
        weight_5: float,
        weight_6: float,
        weight_7: float,
    ) -> tuple[float, float]:
        row = row_at(position, basis)
        first = weight_0 * basis[row][0] + weight_1 * basis[row][1] + weight_2 * basis[row][2] + weight_3 * basis[row][3]
        second = weight_4 * basis[row][4] + weight_5 * basis[row][5] + weight_6 * basis[row][6] + weight_7 * basis[row][7]
        return position + 1.0, first + second

    @staticmethod
    def output(incoming: float, added: float) -> float:
        return incoming + added
