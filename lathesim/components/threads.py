"""The walk along a path table: which row comes next, and threads that follow the angle of the spindle."""

from __future__ import annotations

import math
from typing import Any

from lathesim.path_columns import (
    ARC_MOVE,
    DWELL,
    DWELL_PAUSE,
    FEED,
    FEED_MODE,
    KIND,
    LENGTH,
    SPINDLE_DIRECTION,
    START_ANGLE,
    TAP_OUT,
    THREAD,
    THREAD_ON,
)


def takes_time(path: Any, row: int) -> bool:
    """Return whether a segment needs at least one sample: it has a length, or is a dwell."""
    kind = path[row][KIND]
    if kind == DWELL_PAUSE:
        return bool(path[row][DWELL] > 0.0)
    return bool(kind <= ARC_MOVE and path[row][LENGTH] > 0.0)


def next_row(path: Any, row: int) -> int:
    """Return the first row after ``row`` that takes time, or the number of rows if there is none."""
    rows = len(path)
    following = row + 1
    while following < rows and not takes_time(path, following):
        following += 1
    return following


TWO_PI = 2.0 * math.pi
NO_ANGLE = -1.0e300
"""Spindle angle [rad] that means "no thread is being cut", or "no angle is wired": a thread then follows the speed, without an index."""


def sense_of(path: Any, row: int) -> float:
    """Return the direction of the spindle in a row: -1 for M04, else 1."""
    return -1.0 if path[row][SPINDLE_DIRECTION] < 0.0 else 1.0


def thread_start(turned: float, start_angle: float) -> float:
    """Return the first angle [rad] from ``turned`` on that lies ``start_angle`` [rad] behind an index (a multiple of 2 pi)."""
    return math.ceil((turned - start_angle) / TWO_PI - 1e-12) * TWO_PI + start_angle


def angle_of_speed(path: Any, row: int, travelled: float, index: float, way: float) -> float:
    """Return the spindle angle [rad] at which the tool has moved on by ``way`` [m] in this sample, for a spindle without a wired angle."""
    lead = path[row][FEED] * 1.0
    return sense_of(path, row) * (index + TWO_PI * (travelled + way) / lead) if lead > 0.0 else 0.0


def walk_thread(path: Any, row: int, travelled: float, index: float, angle: float) -> tuple[float, float, float, float, float]:
    """Return row, way in the row [m], angle at the start of the row [rad], way of this sample [m], and 1 at the end of the thread, else 0.

    The way is s = lead (turned - index)/(2 pi), with the angle counted in the direction of the row. A thread that waits begins at the first
    index after the lowest angle, because the spindle may still turn the other way. A thread that goes on begins at the angle of the joint,
    within the sample, so that the tool stays on the lead. The tool never moves back on a thread. Only on the way out of a tapped hole is s
    below 0, deeper than the bottom, until the spindle has reversed.
    """
    done = 0.0
    while True:
        turned = sense_of(path, row) * angle
        mode = path[row][FEED_MODE]
        if index <= NO_ANGLE or (mode == THREAD and travelled <= 0.0):
            found = thread_start(turned, path[row][START_ANGLE])
            if index <= NO_ANGLE or found < index:
                index = found
        lead = path[row][FEED] * 1.0
        length = path[row][LENGTH] * 1.0
        way = lead * (turned - index) / TWO_PI
        if way < travelled and mode != TAP_OUT:
            way = travelled
        if way < length:
            return row * 1.0, way, index, done + way - travelled, 0.0
        done += length - travelled
        following = next_row(path, row)
        if following >= len(path) or path[following][FEED_MODE] < THREAD_ON:
            return row * 1.0, length, index, done, 1.0
        index = sense_of(path, row) * sense_of(path, following) * (index + TWO_PI * length / lead)
        row = following
        travelled = 0.0
