"""The interpolator of a bought control: ramps, a rest between blocks, and a moving average that limits the jerk."""

from __future__ import annotations

import math
from typing import Any

from lathesim.component import DiscreteState, Memory, Parameter
from lathesim.components.references.constant_acceleration_interpolator import ramp_speed, ramp_time, ramp_way
from lathesim.components.references.interpolator import (
    ConstantVelocityInterpolator,
    wanted_speed,
    x_on_path,
    z_on_path,
)
from lathesim.components.references.rows import next_row, takes_time
from lathesim.components.references.threads import NO_ANGLE, walk_thread
from lathesim.path_columns import DWELL, DWELL_PAUSE, FEED_MODE, KIND, LENGTH, THREAD

_CELLS = 2048
_ALIKE = 0.02
"""Share of a cycle by which the time of a block may exceed whole cycles and still count as them; assumed."""
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
    if width > (cells - 3) * sample_period:
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
        """Walk one sample further."""
        rows = len(path)
        row = int(segment)
        first = time <= 0.0
        if rows > 0 and at_end < 0.5:
            if first and not takes_time(path, row):
                row = next_row(path, row)
            left = 0.0 if first else sample_period
            path_speed = 0.0
            while row < rows:
                if path[row][FEED_MODE] >= THREAD and spindle_angle > NO_ANGLE:
                    place, travelled, index, way, reached = walk_thread(path, row, travelled, index, spindle_angle)
                    row = int(place)
                    path_speed = way / sample_period
                    if reached < 0.5:
                        break
                    left, travelled, index = 0.0, 0.0, NO_ANGLE
                    row = next_row(path, row)
                    continue
                wanted = 0.0
                if path[row][KIND] != DWELL_PAUSE:
                    x = x_on_path(path, row, travelled)
                    wanted = wanted_speed(
                        path, row, x, spindle_speed, feed_command, feed_override, spindle_override, rapid_speed, largest_spindle_speed
                    )
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
                row = rows - 1
                travelled = path[row][LENGTH] * 1.0
                at_end = 1.0
                elapsed = left
        elif rows > 0:
            elapsed += sample_period
        else:
            at_end = 1.0
        done = 1.0 if at_end > 0.5 and elapsed >= averaging else 0.0
        x, z = 0.0, 0.0
        if rows > 0:
            x, z = x_on_path(path, row, travelled), z_on_path(path, row, travelled)
        cells = len(x_places)
        place = int(newest)
        if first:
            for cell in range(cells):
                x_places[cell], z_places[cell] = x, z
                x_integrals[cell] = x * sample_period * (cell - place)
                z_integrals[cell] = z * sample_period * (cell - place)
                if cell > place:
                    x_integrals[cell] -= x * sample_period * cells
                    z_integrals[cell] -= z * sample_period * cells
        else:
            before = place
            place = place + 1 if place + 1 < cells else 0
            x_places[place], z_places[place] = x, z
            x_integrals[place] = x_integrals[before] + 0.5 * sample_period * (x_places[before] + x)
            z_integrals[place] = z_integrals[before] + 0.5 * sample_period * (z_places[before] + z)
        x_now = mean_place(x_places, x_integrals, place, averaging, sample_period)
        z_now = mean_place(z_places, z_integrals, place, averaging, sample_period)
        x_rate = 0.0 if first else (x_now - x_mean) / sample_period
        z_rate = 0.0 if first else (z_now - z_mean) / sample_period
        return (
            row * 1.0, travelled, samples_left, speed_of_block, path_speed, at_end, 1.0, done, index, elapsed, speed_of_block,
            place * 1.0, time, x_now, z_now, x_rate, z_rate,
        )  # fmt: skip

    @staticmethod
    def output_x_reference(x_mean: float, x_rate: float, began: float, done: float, time: float) -> float:
        """The mean, going on at its speed."""
        return x_mean if done > 0.5 else x_mean + x_rate * (time - began)

    @staticmethod
    def output_z_reference(z_mean: float, z_rate: float, began: float, done: float, time: float) -> float:
        """The mean, going on at its speed."""
        return z_mean if done > 0.5 else z_mean + z_rate * (time - began)

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
        """What the block in work asks for."""
        told = block_output(path, segment, travelled, path_speed, done, spindle_override, largest_spindle_speed)
        return told[4:]
