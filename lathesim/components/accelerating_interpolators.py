"""Interpolators whose path speed rises and falls at a constant acceleration, with and without a limit of the jerk."""

from __future__ import annotations

import math
from typing import Any

from lathesim.component import ON, DiscreteState, Memory, Parameter
from lathesim.components.interpolator import (
    SAME_SPEED,
    SAMPLE_SLACK,
    SLOWEST,
    ConstantVelocityInterpolator,
    follow_spindle,
    point_on_path,
    turning_speed,
    waiting,
    wanted_speed,
)
from lathesim.components.threads import NO_ANGLE, next_row, takes_time, walk_thread
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


def on_ramp(
    length: float, begin: float, start_speed: float, speed: float, acceleration: float, share: float, lasts: float
) -> tuple[float, float]:
    """Return way [m] and path speed [m/s] after a ``share`` of the ramp from ``begin`` to the end of a block, stretched to last so long."""
    way = length - begin
    whole = ramp_time(way, start_speed, speed, acceleration)
    elapsed = whole * share
    path_speed = ramp_speed(elapsed, way, start_speed, speed, acceleration) * (whole / lasts)
    return begin + ramp_way(elapsed, way, start_speed, speed, acceleration), path_speed


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
        path: Any, segment: float, travelled: float, samples_left: float, planned_speed: float, path_speed: float, at_end: float,
        started: float, done: float, index: float, plan_from: float, plan_start_speed: float, plan_samples: float, spindle_speed: float,
        spindle_angle: float, feed_command: float, feed_override: float, spindle_override: float, rapid_speed: float,
        largest_spindle_speed: float, acceleration: float, sample_period: float,
    ) -> tuple[float, ...]:  # fmt: skip
        rows = len(path)
        row = int(segment)
        if started < ON or done > ON or rows == 0:
            at_end, done = waiting(path, row, started, at_end, done)
            return segment, travelled, samples_left, planned_speed, 0.0, at_end, 1.0, done, index, plan_from, plan_start_speed, plan_samples
        if at_end > ON:
            row = next_row(path, row)
            travelled, samples_left, planned_speed, path_speed, index = 0.0, 0.0, -1.0, 0.0, NO_ANGLE
        turning = turning_speed(path, row, travelled, spindle_speed, spindle_override, largest_spindle_speed)
        if path[row][KIND] == DWELL_PAUSE:
            if planned_speed < 0.0:
                samples_left = max(1.0, math.ceil(path[row][DWELL] / sample_period - SAMPLE_SLACK) * 1.0)
                planned_speed = 0.0
            samples_left -= 1.0
            path_speed = 0.0
        elif path[row][FEED_MODE] >= THREAD:
            place, travelled, index, way, reached = follow_spindle(path, row, travelled, index, spindle_angle, turning, sample_period)
            row = int(place)
            path_speed = way / sample_period
            samples_left = 1.0 - reached
            planned_speed = 0.0
        else:
            length = path[row][LENGTH] * 1.0
            wanted = wanted_speed(path, row, turning, feed_command, feed_override, rapid_speed)
            if wanted <= SLOWEST:
                slower = max(0.0, path_speed - acceleration * sample_period)
                travelled = min(length, travelled + 0.5 * (path_speed + slower) * sample_period)
                path_speed = slower
                planned_speed = 0.0
                samples_left = 0.0 if travelled >= length else 1.0
            else:
                if abs(wanted - planned_speed) > SAME_SPEED * wanted:
                    plan_from = travelled
                    plan_start_speed = path_speed
                    planned_speed = wanted
                    whole = ramp_time(length - plan_from, plan_start_speed, wanted, acceleration)
                    plan_samples = max(1.0, math.ceil(whole / sample_period - SAMPLE_SLACK) * 1.0)
                    samples_left = plan_samples
                samples_left -= 1.0
                share, lasts = 1.0 - samples_left / plan_samples, plan_samples * sample_period
                travelled, path_speed = on_ramp(length, plan_from, plan_start_speed, planned_speed, acceleration, share, lasts)
                if samples_left < 1.0:
                    travelled = length
                    path_speed = 0.0
        at_end = 1.0 if samples_left < 1.0 else 0.0
        done = 1.0 if at_end > ON and next_row(path, row) >= rows else 0.0
        return (
            row * 1.0, travelled, samples_left, planned_speed, path_speed, at_end, 1.0, done, index, plan_from, plan_start_speed,
            plan_samples,
        )  # fmt: skip


_CELLS = 2048
_ALIKE = 0.02
"""Share of a cycle by which the time of a block may exceed whole cycles and still count as them; assumed."""
_BESIDE = 3
"""Cells of a ring beside those of the width: what is averaged begins between two of them."""
block_output = ConstantVelocityInterpolator.output


def block_time(path: Any, row: int, speed: float, acceleration: float, pause: float, cycle: float) -> float:
    """Return how long a row of the path takes [s]: its ramp or dwell in whole cycles, and the rest behind a ramp."""
    dwells = path[row][KIND] == DWELL_PAUSE
    whole = path[row][DWELL] * 1.0 if dwells else ramp_time(path[row][LENGTH], 0.0, speed, acceleration)
    if cycle > 0.0:
        whole = math.ceil(whole / cycle - _ALIKE) * cycle
    return float(whole) if dwells else whole + pause


def mean_place(places: Any, integrals: Any, newest: int, width: float, sample_period: float) -> float:
    """Return the mean of a signal over the last ``width`` [s], its values at the instants joined by straight lines.

    ``integrals`` holds the integral of the signal at each instant; both are rings, of which ``newest`` is the latest cell.
    """
    cells = len(places)
    if width <= 0.0:
        return float(places[newest])
    if width > (cells - _BESIDE) * sample_period:
        return math.nan
    back = int(width / sample_period)
    share = width - back * sample_period
    late = newest - back
    if late < 0:
        late += cells
    before = late - 1 if late > 0 else cells - 1
    slope = (places[late] - places[before]) / sample_period
    rest = share * (places[late] - 0.5 * slope * share)
    return float((integrals[newest] - integrals[late] + rest) / width)


def moved_mean(value: float, places: Any, integrals: Any, place: int, first: bool, width: float, sample_period: float) -> float:
    """Return the mean over the last ``width`` [s] with a new value, which is written to its ``place`` in the rings.

    The ``first`` one fills them: before the path begins the signal stands still.
    """
    cells = len(places)
    if first:
        for cell in range(cells):
            places[cell] = value
            integrals[cell] = value * sample_period * (cell - place)
            if cell > place:
                integrals[cell] -= value * sample_period * cells
    else:
        before = place - 1 if place > 0 else cells - 1
        places[place] = value
        integrals[place] = integrals[before] + 0.5 * sample_period * (places[before] + value)
    return mean_place(places, integrals, place, width, sample_period)


class JerkLimitedInterpolator(ConstantVelocityInterpolator):
    """Gives the reference of each sample: every block ramps at constant acceleration, rests, and all is averaged over a while.

    A block of length L at speed v takes L/v + v/a, or 2 sqrt(L/a) where it is too short to reach v, and ``pause`` behind it. The
    references of both axes are then the means over the last ``averaging`` w:

        x(t) = 1/w  integral of x_ramp from t - w to t

    so their jerk is at most a/w. With a pause of w or more the path is kept; a shorter one rounds the corners. A change of the wanted speed
    within a block stretches its time. Blocks begin when they are due, not at a sample instant, so that the way depends smoothly on every
    value; between instants a reference goes on at its speed. A thread follows the angle of the spindle without ramp and rest, half of w
    late. With a ``cycle`` a block takes whole cycles, rounded up, before its rest: it stands still for what is left of the last one.

    Source: the mean as a limit of jerk: L. Biagiotti, C. Melchiorri, FIR filters for online trajectory planning, Control Eng. Practice 20
    (2012). Left out: speeds carried over corners.
    """

    acceleration = Parameter("m/s^2", 20.0, low=1e-3, doc="acceleration and deceleration along the path")
    pause = Parameter("s", 0.0, low=0.0, doc="rest after each block")
    averaging = Parameter("s", 0.0, low=0.0, doc="w: how long the references are averaged over")
    cycle = Parameter("s", 0.0, low=0.0, doc="the control's interpolation cycle, in whole multiples of which a block lasts; 0: none")

    elapsed = DiscreteState("s", doc="time since the present block began")
    speed_of_block = DiscreteState("m/s", -1.0, doc="speed its ramp is laid out for; below zero: not yet", shown=False)
    newest = DiscreteState("1", doc="latest cell of the rings")
    began = DiscreteState("s", doc="the last sample instant")
    x_mean = DiscreteState("m", doc="mean reference radius")
    z_mean = DiscreteState("m", doc="mean reference z position")
    x_rate = DiscreteState("m/s", doc="its speed")
    z_rate = DiscreteState("m/s", doc="its speed")
    x_places = Memory("m", _CELLS, doc="radius of the ramp at the last instants", holds=lambda averaging: averaging)
    z_places = Memory("m", _CELLS, doc="z position of the ramp at the last instants", holds=lambda averaging: averaging)
    x_integrals = Memory("m*s", _CELLS, doc="integral of the radius", holds=lambda averaging: averaging)
    z_integrals = Memory("m*s", _CELLS, doc="integral of the z position", holds=lambda averaging: averaging)

    @staticmethod
    def update(  # type: ignore[override]  # a law's arguments are its own
        path: Any, segment: float, travelled: float, samples_left: float, path_speed: float, at_end: float, done: float, index: float,
        elapsed: float, speed_of_block: float, newest: float, x_mean: float, z_mean: float, x_places: list[float], z_places: list[float],
        x_integrals: list[float], z_integrals: list[float], spindle_speed: float, spindle_angle: float, feed_command: float,
        feed_override: float, spindle_override: float, rapid_speed: float, largest_spindle_speed: float, acceleration: float,
        pause: float, averaging: float, cycle: float, time: float, sample_period: float,
    ) -> tuple[float, ...]:  # fmt: skip
        rows, row, first = len(path), int(segment), time <= 0.0
        if rows > 0 and at_end < ON:
            if first and not takes_time(path, row):
                row = next_row(path, row)
            left = 0.0 if first else sample_period
            path_speed = 0.0
            while row < rows:
                if path[row][FEED_MODE] >= THREAD and spindle_angle > NO_ANGLE:
                    place, travelled, index, way, reached = walk_thread(path, row, travelled, index, spindle_angle)
                    row, path_speed = int(place), way / sample_period
                    if reached < ON:
                        break
                    row, left, travelled, index = next_row(path, row), 0.0, 0.0, NO_ANGLE
                    continue
                wanted = 0.0
                if path[row][KIND] != DWELL_PAUSE:
                    turning = turning_speed(path, row, travelled, spindle_speed, spindle_override, largest_spindle_speed)
                    wanted = wanted_speed(path, row, turning, feed_command, feed_override, rapid_speed)
                    if speed_of_block <= 0.0:
                        speed_of_block = wanted
                        if wanted <= 0.0:
                            break
                pace = wanted / speed_of_block if speed_of_block > 0.0 else 1.0
                whole = block_time(path, row, speed_of_block, acceleration, pause, cycle)
                if elapsed + pace * left < whole or (first and left == 0.0):
                    elapsed += pace * left
                    if path[row][KIND] != DWELL_PAUSE:
                        length = path[row][LENGTH] * 1.0
                        travelled = ramp_way(elapsed, length, 0.0, speed_of_block, acceleration)
                        path_speed = pace * ramp_speed(elapsed, length, 0.0, speed_of_block, acceleration)
                    break
                left -= (whole - elapsed) / pace
                elapsed, travelled, speed_of_block, index = 0.0, 0.0, -1.0, NO_ANGLE
                row = next_row(path, row)
            if row >= rows:
                row, at_end, elapsed = rows - 1, 1.0, left
                travelled = path[row][LENGTH] * 1.0
        elif rows > 0:
            elapsed += sample_period
        else:
            at_end = 1.0
        done = 1.0 if at_end > ON and elapsed >= averaging else 0.0
        x, z = point_on_path(path, row, travelled) if rows > 0 else (0.0, 0.0)
        place = int(newest) if first else (int(newest) + 1) % len(x_places)
        x_now = moved_mean(x, x_places, x_integrals, place, first, averaging, sample_period)
        z_now = moved_mean(z, z_places, z_integrals, place, first, averaging, sample_period)
        x_rate = 0.0 if first else (x_now - x_mean) / sample_period
        z_rate = 0.0 if first else (z_now - z_mean) / sample_period
        return (
            row * 1.0, travelled, samples_left, speed_of_block, path_speed, at_end, 1.0, done, index, elapsed, speed_of_block,
            place * 1.0, time, x_now, z_now, x_rate, z_rate,
        )  # fmt: skip

    @staticmethod
    def output_x_reference(x_mean: float, x_rate: float, began: float, done: float, time: float) -> float:
        """The mean, going on at its speed."""
        return x_mean if done > ON else x_mean + x_rate * (time - began)

    @staticmethod
    def output_z_reference(z_mean: float, z_rate: float, began: float, done: float, time: float) -> float:
        """The mean, going on at its speed."""
        return z_mean if done > ON else z_mean + z_rate * (time - began)

    @staticmethod
    def output_x_velocity(x_rate: float) -> float:
        """The speed of the mean."""
        return x_rate

    @staticmethod
    def output_z_velocity(z_rate: float) -> float:
        """The speed of the mean."""
        return z_rate

    @staticmethod
    def output(
        path: Any, segment: float, travelled: float, path_speed: float, done: float, spindle_override: float, largest_spindle_speed: float
    ) -> tuple[float, ...]:  # fmt: skip
        told = block_output(path, segment, travelled, path_speed, done, spindle_override, largest_spindle_speed)
        return told[4:]
