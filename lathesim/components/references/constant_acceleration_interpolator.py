"""The interpolator whose path speed rises and falls at a constant acceleration in every block."""

from __future__ import annotations

import math
from typing import Any

from lathesim.component import DiscreteState, Parameter
from lathesim.components.references.interpolator import (
    SAMPLE_SLACK,
    SLOWEST,
    ConstantVelocityInterpolator,
    follow_spindle,
    wanted_speed,
    x_on_path,
)
from lathesim.components.references.rows import next_row, takes_time
from lathesim.components.references.threads import NO_ANGLE
from lathesim.path_columns import DWELL, DWELL_PAUSE, FEED_MODE, KIND, LENGTH, THREAD


def ramp_time(way: float, start_speed: float, speed: float, acceleration: float) -> float:
    """Return the time [s] from ``start_speed`` over ``speed`` to rest within ``way`` [m]; triangular where ``way`` is short."""
    peak = ramp_peak(way, start_speed, speed, acceleration)
    if start_speed > 0.0 and start_speed * start_speed >= 2.0 * acceleration * way:
        return 2.0 * way / start_speed
    change = abs(peak - start_speed) / acceleration
    level = way - (0.5 * (start_speed + peak) * change + 0.5 * peak * peak / acceleration)
    return change + max(0.0, level) / peak + peak / acceleration


def ramp_peak(way: float, start_speed: float, speed: float, acceleration: float) -> float:
    """Return the speed [m/s] of the level part: ``speed``, or less where the way is too short to reach it and stop again."""
    if start_speed >= speed:
        return speed
    reach = math.sqrt(acceleration * way + 0.5 * start_speed * start_speed)
    return speed if reach > speed else reach


def ramp_way(elapsed: float, way: float, start_speed: float, speed: float, acceleration: float) -> float:
    """Return the way [m] done ``elapsed`` [s] after the start of the ramp."""
    whole = ramp_time(way, start_speed, speed, acceleration)
    rest = whole - elapsed
    if rest <= 0.0:
        return way
    if start_speed > 0.0 and start_speed * start_speed >= 2.0 * acceleration * way:
        return way * (1.0 - (rest / whole) * (rest / whole))
    peak = ramp_peak(way, start_speed, speed, acceleration)
    change = abs(peak - start_speed) / acceleration
    if elapsed < change:
        return start_speed * elapsed + 0.5 * (peak - start_speed) / change * elapsed * elapsed
    if rest < peak / acceleration:
        return way - 0.5 * acceleration * rest * rest
    return 0.5 * (start_speed + peak) * change + peak * (elapsed - change)


def ramp_speed(elapsed: float, way: float, start_speed: float, speed: float, acceleration: float) -> float:
    """Return the speed [m/s] ``elapsed`` [s] after the start of the ramp."""
    whole = ramp_time(way, start_speed, speed, acceleration)
    rest = whole - elapsed
    if rest <= 0.0:
        return 0.0
    if start_speed > 0.0 and start_speed * start_speed >= 2.0 * acceleration * way:
        return start_speed * rest / whole
    peak = ramp_peak(way, start_speed, speed, acceleration)
    change = abs(peak - start_speed) / acceleration
    if elapsed < change:
        return start_speed + (peak - start_speed) * elapsed / change
    return acceleration * rest if rest < peak / acceleration else peak


class ConstantAccelerationInterpolator(ConstantVelocityInterpolator):
    """Gives the reference point of each sample; in every block the path speed rises from rest, stays, and falls to rest.

    A block of length L at speed v with acceleration a takes t = L/v + v/a (trapezoid), or t = 2 sqrt(L/a) where it is too short to reach
    v (triangle); rapid moves as well. It is cut into n = ceil(t/T) samples, the profile stretched in time by n T/t so that the last
    sample falls on the end point. Where the wanted speed changes inside a block, the rest is laid out anew from the speed reached.

    Source: J. Liu, R. G. Landers (2004), section Interpolator; that rapid moves ramp too is fitted to the cycle time of case IV.
    Left out: as with constant velocity; a thread follows the spindle from its index on without a ramp.
    """

    acceleration = Parameter("m/s^2", 0.01, low=1e-6, doc="acceleration and deceleration along the path")

    plan_from = DiscreteState("m", doc="way done where the present ramp begins")
    plan_start_speed = DiscreteState("m/s", doc="path speed where the present ramp begins")
    plan_samples = DiscreteState("1", 1.0, doc="samples of the present ramp")

    @staticmethod
    def update(  # type: ignore[override]  # a law's arguments are its own
        path: Any,
        segment: float,
        travelled: float,
        samples_left: float,
        planned_speed: float,
        path_speed: float,
        at_end: float,
        started: float,
        done: float,
        index: float,
        plan_from: float,
        plan_start_speed: float,
        plan_samples: float,
        spindle_speed: float,
        spindle_angle: float,
        feed_command: float,
        feed_override: float,
        spindle_override: float,
        rapid_speed: float,
        largest_spindle_speed: float,
        acceleration: float,
        sample_period: float,
    ) -> tuple[float, ...]:
        """Walk one sample further."""
        rows = len(path)
        row = int(segment)
        if started < 0.5 or done > 0.5 or rows == 0:
            if rows == 0 or (not takes_time(path, row) and next_row(path, row) >= rows):
                done = 1.0
            if rows > 0 and started < 0.5 and not takes_time(path, row):
                at_end = 1.0
            return segment, travelled, samples_left, planned_speed, 0.0, at_end, 1.0, done, index, plan_from, plan_start_speed, plan_samples
        if at_end > 0.5:
            row = next_row(path, row)
            travelled = 0.0
            samples_left = 0.0
            planned_speed = -1.0
            path_speed = 0.0
            index = NO_ANGLE
        if path[row][KIND] == DWELL_PAUSE:
            if planned_speed < 0.0:
                samples_left = max(1.0, math.ceil(path[row][DWELL] / sample_period - SAMPLE_SLACK) * 1.0)
                planned_speed = 0.0
            samples_left -= 1.0
            path_speed = 0.0
        elif path[row][FEED_MODE] >= THREAD:
            place, travelled, index, way, reached = follow_spindle(
                path, row, travelled, index, spindle_angle, spindle_speed, spindle_override, largest_spindle_speed, sample_period
            )
            row = int(place)
            path_speed = way / sample_period
            samples_left = 1.0 - reached
            planned_speed = 0.0
        else:
            length = path[row][LENGTH] * 1.0
            x = x_on_path(path, row, travelled)
            wanted = wanted_speed(
                path, row, x, spindle_speed, feed_command, feed_override, spindle_override, rapid_speed, largest_spindle_speed
            )
            if wanted <= SLOWEST:
                slower = max(0.0, path_speed - acceleration * sample_period)
                travelled = min(length, travelled + 0.5 * (path_speed + slower) * sample_period)
                path_speed = slower
                planned_speed = 0.0
                samples_left = 0.0 if travelled >= length else 1.0
            else:
                if abs(wanted - planned_speed) > 1e-9 * wanted:
                    plan_from = travelled
                    plan_start_speed = path_speed
                    planned_speed = wanted
                    whole = ramp_time(length - plan_from, plan_start_speed, wanted, acceleration)
                    plan_samples = max(1.0, math.ceil(whole / sample_period - SAMPLE_SLACK) * 1.0)
                    samples_left = plan_samples
                samples_left -= 1.0
                way = length - plan_from
                whole = ramp_time(way, plan_start_speed, planned_speed, acceleration)
                elapsed = whole * (1.0 - samples_left / plan_samples)
                travelled = plan_from + ramp_way(elapsed, way, plan_start_speed, planned_speed, acceleration)
                stretch = whole / (plan_samples * sample_period)
                path_speed = ramp_speed(elapsed, way, plan_start_speed, planned_speed, acceleration) * stretch
                if samples_left < 0.5:
                    travelled = length
                    path_speed = 0.0
        at_end = 1.0 if samples_left < 0.5 else 0.0
        done = 1.0 if at_end > 0.5 and next_row(path, row) >= rows else 0.0
        return (
            row * 1.0,
            travelled,
            samples_left,
            planned_speed,
            path_speed,
            at_end,
            1.0,
            done,
            index,
            plan_from,
            plan_start_speed,
            plan_samples,
        )
