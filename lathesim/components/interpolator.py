"""Interpolators: parts that walk along the path sample by sample and give the reference point of each sample instant.

They walk *in the loop*: feed override, process controllers, feed per revolution and constant surface speed may change the speed at any
sample, so nothing but the geometry is laid out beforehand.

Columns of the table ``path`` (one row a segment, SI, X is a radius), the same as the path layer writes them.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from lathesim.component import ON, Component, DiscreteState, Input, Output, Parameter, Table
from lathesim.components.threads import NO_ANGLE, TWO_PI, angle_of_speed, next_row, takes_time, walk_thread
from lathesim.elementary import within
from lathesim.path_columns import (
    ARC_MOVE,
    CENTRE_X,
    CENTRE_Z,
    CONSTANT_SPEED,
    CONSTANT_SURFACE_SPEED,
    DWELL,
    DWELL_PAUSE,
    END_X,
    END_Z,
    FEED,
    FEED_MODE,
    KIND,
    LENGTH,
    LINE,
    LINE_MOVE,
    PATH_COLUMNS,
    RADIUS,
    RAPID,
    SPINDLE_DIRECTION,
    SPINDLE_LIMIT,
    SPINDLE_MODE,
    SPINDLE_SPEED,
    START_ANGLE,
    START_X,
    START_Z,
    SWEEP,
    TAP_OUT,
    THREAD,
)

SAME_SPEED = 1e-9
"""Share of a speed by which another one may differ and still be the same: rounding."""

EXAMPLE_PATH = [
    [0.0, 5e-5, 0.0, 0.0, 3e-5, 4e-5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 100.0, 0.0, 0.0, 1.0, 1.0],
    [2.0, math.pi * 5e-6, 3e-5, 4e-5, 4e-5, 5e-5, 4e-5, 4e-5, 1e-5, -math.pi / 2, math.pi / 2, 2e-3, 0.0, 2.0, 2.0, 300.0, 0.0, 2.0, 1.0],
    [3.0, 0.0, 4e-5, 5e-5, 4e-5, 5e-5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -100.0, 0.0, 0.01, 3.0, -1.0],
    [1.0, 1e-5, 4e-5, 5e-5, 4e-5, 6e-5, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-4, 1.0, 1.0, -100.0, 0.0, 0.0, 4.0, -1.0],
    [1.0, 1e-5, 4e-5, 6e-5, 4e-5, 7e-5, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-4, 2.0, 1.0, -100.0, 0.0, 0.0, 5.0, -1.0],
]
"""A rapid, an arc, a dwell, a line and a thread of some micrometres, for the conformance test."""

NOT_WIRED = 1.0e9
"""Spindle speed [rad/s] that means "nothing is wired here": the programmed speed then counts as reached."""
SLOWEST = 1.0e-12
"""Path speed [m/s] below which the tool stands."""
FEW_SAMPLES = 4.0
"""Samples before the end of a block in which it is cut evenly even while its speed changes."""
SAMPLE_SLACK = 1.0e-6
"""Share of a sample that rounding may add to a block's time before it costs another sample."""


def motion_row(path: Any, row: int) -> int:
    """Return the row whose direction holds at ``row``: itself, else the last motion before it, else the first one after it."""
    rows = len(path)
    back = row
    while back >= 0 and not (path[back][KIND] <= ARC_MOVE and path[back][LENGTH] > 0.0):
        back -= 1
    if back >= 0:
        return back
    ahead = row
    while ahead < rows - 1 and not (path[ahead][KIND] <= ARC_MOVE and path[ahead][LENGTH] > 0.0):
        ahead += 1
    return ahead


def programmed_spindle(path: Any, row: int, x: float, override: float, largest: float) -> float:
    """Return the spindle speed [rad/s] a row asks for when the tool stands at radius ``x`` [m]; constant surface speed: V = omega x."""
    mode = path[row][SPINDLE_MODE]
    speed = 0.0
    if mode == CONSTANT_SPEED:
        speed = path[row][SPINDLE_SPEED] * override
    elif mode == CONSTANT_SURFACE_SPEED:
        limit = path[row][SPINDLE_LIMIT]
        if limit <= 0.0 or limit > largest:
            limit = largest
        radius = abs(x)
        wanted = abs(path[row][SPINDLE_SPEED]) * override
        speed = limit if radius * limit <= wanted else wanted / radius
        if path[row][SPINDLE_DIRECTION] < 0.0:
            speed = -speed
    return within(speed, -largest, largest)


def point_on_path(path: Any, row: int, travelled: float) -> tuple[float, float]:
    """Return radius and z position [m] of the point ``travelled`` [m] along a segment.

    Arcs lie on the true circle; a tap runs beyond its bottom.
    """
    kind = path[row][KIND]
    length = path[row][LENGTH]
    if kind > ARC_MOVE or length <= 0.0 or (travelled <= 0.0 and path[row][FEED_MODE] != TAP_OUT):
        return float(path[row][START_X]), float(path[row][START_Z])
    if travelled >= length:
        return float(path[row][END_X]), float(path[row][END_Z])
    if kind == ARC_MOVE:
        angle = path[row][START_ANGLE] + path[row][SWEEP] * travelled / length
        x = path[row][CENTRE_X] + path[row][RADIUS] * math.sin(angle)
        return float(x), float(path[row][CENTRE_Z] + path[row][RADIUS] * math.cos(angle))
    x = path[row][START_X] + (path[row][END_X] - path[row][START_X]) * (travelled / length)
    return float(x), float(path[row][START_Z] + (path[row][END_Z] - path[row][START_Z]) * (travelled / length))


def tangent_on_path(path: Any, row: int, travelled: float) -> tuple[float, float]:
    """Return the x and z part of the unit tangent ``travelled`` [m] along a line or arc."""
    length = path[row][LENGTH] * 1.0
    if path[row][KIND] == ARC_MOVE:
        angle = path[row][START_ANGLE] + path[row][SWEEP] * travelled / length
        turn = 1.0 if path[row][SWEEP] >= 0.0 else -1.0
        return turn * math.cos(angle), -turn * math.sin(angle)
    return (path[row][END_X] - path[row][START_X]) / length, (path[row][END_Z] - path[row][START_Z]) / length


def turning_speed(path: Any, row: int, travelled: float, spindle_speed: float, override: float, largest: float) -> float:
    """Return the spindle speed [rad/s] that feeds per revolution follow: the actual one, and where none is wired the programmed one."""
    if spindle_speed < NOT_WIRED:
        return spindle_speed
    x, _ = point_on_path(path, row, travelled)
    return programmed_spindle(path, row, x, override, largest)


def wanted_speed(path: Any, row: int, turning: float, feed_command: float, feed_override: float, rapid_speed: float) -> float:
    """Return the path speed [m/s] asked for now: rapid, feed per minute, or feed per revolution times the spindle speed ``turning``."""
    if path[row][KIND] == RAPID:
        return rapid_speed
    override = feed_override if feed_override > 0.0 else 0.0
    if feed_command < 0.0 and path[row][FEED_MODE] == 0.0:
        return float(path[row][FEED]) * override
    if path[row][FEED_MODE] >= THREAD:
        return float(path[row][FEED]) * abs(turning) / TWO_PI
    feed = feed_command if feed_command >= 0.0 else float(path[row][FEED])
    return feed * override * abs(turning) / TWO_PI


def follow_spindle(
    path: Any, row: int, travelled: float, index: float, angle: float, turning: float, sample_period: float
) -> tuple[float, float, float, float, float]:
    """Return how a thread goes on in this sample, as :func:`walk_thread`; without a wired ``angle`` [rad] it follows the spindle speed."""
    if angle <= NO_ANGLE:
        wanted = wanted_speed(path, row, turning, -1.0, 1.0, 0.0)
        index = index if index > NO_ANGLE else 0.0
        angle = angle_of_speed(path, row, travelled, index, wanted * sample_period)
    return walk_thread(path, row, travelled, index, angle)


def waiting(path: Any, row: int, started: float, at_end: float, done: float) -> tuple[float, float]:
    """Return ``at_end`` and ``done`` of a path that has not begun, is over, or has no rows: a row that takes no time is at its end."""
    if len(path) == 0:
        return at_end, 1.0
    if takes_time(path, row):
        return at_end, done
    return (1.0 if started < ON else at_end), (1.0 if next_row(path, row) >= len(path) else done)


class ReferenceOutputs:
    """Where every interpolator wants the tool, and how fast."""

    x_reference = Output("m", doc="reference radius of the tool tip")
    z_reference = Output("m", doc="reference z position of the tool tip")
    x_velocity = Output("m/s", doc="reference speed of the x axis")
    z_velocity = Output("m/s", doc="reference speed of the z axis")


class ConstantVelocityInterpolator(ReferenceOutputs, Component):
    """Gives the reference point of each sample; every block is run at constant path speed.

    A block of length L [m] at speed v [m/s] takes t = L/v; it is cut into n = ceil(t/T) samples of equal length L/n, so that its last
    sample falls on its end point. The first reference, at t = 0, is the start of the path. Where the speed changes inside a block (feed
    override, a process controller, feed per revolution with a moving spindle) the tool goes on at just that speed, and the rest of the
    block is cut anew once the speed stays, or a few samples before its end; at speed zero the tool stands. Rapid moves go straight
    along the path at ``rapid_speed``. A thread waits for the index of the spindle and then stands at
    s = lead (angle - index)/(2 pi) whatever the speed does, so that all its passes meet; a thread behind a thread goes on without waiting,
    and the way out of a tapped hole as well. Feed override and process controllers do not act on threads. Arcs: points on the true
    circle, equal steps of the angle.

    Source: J. Liu, R. G. Landers, Integrated Modular Machine Tool Simulation, Int. J. Eng. Educ. 20 (2004), section Interpolator; the
    cutting into equal samples is fitted to the cycle times of its Table 1.
    Left out: look-ahead, corner rounding, in-position waits, jerk limits.
    """

    group = "interpolator"

    ports = {"circle_radius": "radius"}

    example_tables: ClassVar[dict[str, list[list[float]]]] = {"path": EXAMPLE_PATH}

    path = Table("1", PATH_COLUMNS, doc="the path, one row a segment, SI")

    spindle_speed = Input("rad/s", default=NOT_WIRED, doc="actual spindle speed, which feed per revolution follows", shown=False)
    spindle_angle = Input("rad", default=NO_ANGLE, doc="angle turned by the spindle, which threads follow", shown=False)
    feed_command = Input("m", default=-1.0, previous=True, doc="feed per revolution from a process controller; below zero: none")
    feed_override = Parameter("1", 1.0, low=0.0, doc="factor on every programmed feed, 1 as programmed; may be wired")
    spindle_override = Parameter("1", 1.0, low=0.0, doc="factor on every programmed spindle or surface speed; may be wired")
    rapid_speed = Parameter("m/s", 0.12, low=1e-6, doc="path speed of rapid moves")
    largest_spindle_speed = Parameter("rad/s", 628.3185307179587, low=0.0, doc="spindle speed that is never exceeded")

    segment = DiscreteState("1", doc="row of the path in work")
    travelled = DiscreteState("m", doc="way done in this segment")
    samples_left = DiscreteState("1", doc="samples still to come in this segment")
    planned_speed = DiscreteState("m/s", -1.0, doc="speed this segment was cut for; below zero: not yet cut", shown=False)
    path_speed = DiscreteState("m/s", doc="path speed of this sample")
    at_end = DiscreteState("1", doc="1 when this segment is done")
    started = DiscreteState("1", doc="1 after the first sample")
    done = DiscreteState("1", doc="1 when the path is done")
    index = DiscreteState("rad", NO_ANGLE, doc="angle, in the sense the spindle turns, at which the thread in work began", shown=False)

    feed_speed = Output("m/s", doc="reference path speed; below zero where a tap runs beyond its bottom")
    feed_per_revolution = Output("m", doc="commanded feed per turn of the spindle in feed blocks, else 0")
    spindle_reference = Output("rad/s", doc="reference spindle speed, positive for M03")
    segment_number = Output("1", doc="row of the path in work")
    program_line = Output("1", doc="line of the part program in work")
    path_kind = Output("1", doc="0 rapid, 1 line, 2 arc, 3 dwell, 4 no motion")
    cutting_block = Output("1", doc="1 in blocks run at feed (lines and arcs), else 0")
    direction_x = Output("1", doc="x part of the unit tangent of the path")
    direction_z = Output("1", doc="z part of the unit tangent of the path")
    centre_x = Output("m", doc="centre of the arc, radius coordinate; 0 on lines")
    centre_z = Output("m", doc="centre of the arc, z coordinate; 0 on lines")
    radius = Output("m", doc="radius of the arc, 0 on lines")
    progress = Output("1", doc="share of the segments done, 0 to 1")
    finished = Output("1", doc="1 once the reference has reached the last point")

    @staticmethod
    def update(
        path: Any, segment: float, travelled: float, samples_left: float, planned_speed: float, path_speed: float, at_end: float,
        started: float, done: float, index: float, spindle_speed: float, spindle_angle: float, feed_command: float, feed_override: float,
        spindle_override: float, rapid_speed: float, largest_spindle_speed: float, sample_period: float,
    ) -> tuple[float, float, float, float, float, float, float, float, float]:  # fmt: skip
        rows = len(path)
        row = int(segment)
        if started < ON or done > ON or rows == 0:
            at_end, done = waiting(path, row, started, at_end, done)
            return segment, travelled, samples_left, planned_speed, 0.0, at_end, 1.0, done, index
        if at_end > ON:
            row = next_row(path, row)
            travelled, samples_left, planned_speed, index = 0.0, 0.0, -1.0, NO_ANGLE
        reached = 0.0
        turning = turning_speed(path, row, travelled, spindle_speed, spindle_override, largest_spindle_speed)
        if path[row][KIND] == DWELL_PAUSE:
            if planned_speed < 0.0:
                samples_left = max(1.0, math.ceil(path[row][DWELL] / sample_period - SAMPLE_SLACK) * 1.0)
                planned_speed = 0.0
            samples_left -= 1.0
            reached = 1.0 if samples_left < 1.0 else 0.0
            path_speed = 0.0
        elif path[row][FEED_MODE] >= THREAD:
            place, travelled, index, way, reached = follow_spindle(path, row, travelled, index, spindle_angle, turning, sample_period)
            row = int(place)
            path_speed = way / sample_period
            planned_speed = 0.0
        else:
            length = float(path[row][LENGTH])
            wanted = wanted_speed(path, row, turning, feed_command, feed_override, rapid_speed)
            if wanted <= SLOWEST:
                path_speed = 0.0
                planned_speed = 0.0
                samples_left = 0.0
            else:
                way = wanted * sample_period
                steady = abs(wanted - planned_speed) <= SAME_SPEED * wanted
                if not steady or samples_left < 1.0:
                    rest = max(1.0, math.ceil((length - travelled) / way - SAMPLE_SLACK) * 1.0)
                    exact = planned_speed >= 0.0 and not steady and rest > FEW_SAMPLES
                    samples_left = 0.0 if exact else rest
                    planned_speed = wanted
                if samples_left >= 1.0:
                    way = (length - travelled) / samples_left
                    samples_left -= 1.0
                    reached = 1.0 if samples_left < 1.0 else 0.0
                path_speed = way / sample_period
                travelled = length if reached > ON else travelled + way
        at_end = reached
        done = 1.0 if at_end > ON and next_row(path, row) >= rows else 0.0
        return row * 1.0, travelled, samples_left, planned_speed, path_speed, at_end, 1.0, done, index

    @staticmethod
    def output(
        path: Any, segment: float, travelled: float, path_speed: float, done: float, spindle_override: float, largest_spindle_speed: float
    ) -> tuple[float, ...]:
        rows = len(path)
        if rows == 0:
            return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0
        row = int(segment)
        kind = path[row][KIND] * 1.0
        x, z = point_on_path(path, row, travelled)
        way = motion_row(path, row)
        along = travelled
        if way < row:
            along = path[way][LENGTH] * 1.0
        elif way > row:
            along = 0.0
        direction_x = 0.0
        direction_z = 0.0
        centre_x = 0.0
        centre_z = 0.0
        radius = 0.0
        if path[way][LENGTH] > 0.0:
            direction_x, direction_z = tangent_on_path(path, way, along)
            if path[way][KIND] == ARC_MOVE:
                centre_x = path[way][CENTRE_X] * 1.0
                centre_z = path[way][CENTRE_Z] * 1.0
                radius = path[way][RADIUS] * 1.0
        cutting = 1.0 if LINE_MOVE <= kind <= ARC_MOVE else 0.0
        spindle = programmed_spindle(path, row, x, spindle_override, largest_spindle_speed)
        feed = 0.0
        if cutting > ON and abs(spindle) > 0.0:
            feed = abs(path_speed) * TWO_PI / abs(spindle)
        share = 1.0 if done > ON else row / rows
        if done < ON and path[row][LENGTH] > 0.0:
            share += travelled / path[row][LENGTH] / rows
        return (
            x, z, path_speed * direction_x, path_speed * direction_z, path_speed, feed, spindle, row * 1.0, path[row][LINE] * 1.0, kind,
            cutting, direction_x, direction_z, centre_x, centre_z, radius, share, done,
        )  # fmt: skip
