"""The columns of the path table: what the program lays down and the interpolator walks along, one row a segment, everything in SI.

``table[row][FEED]``; X is a radius. Constants are plain numbers, as laws read them.
"""

KIND = 0
LENGTH = 1
START_X = 2
START_Z = 3
END_X = 4
END_Z = 5
CENTRE_X = 6
CENTRE_Z = 7
RADIUS = 8
START_ANGLE = 9
SWEEP = 10
FEED = 11
FEED_MODE = 12
SPINDLE_MODE = 13
SPINDLE_SPEED = 14
SPINDLE_LIMIT = 15
DWELL = 16
LINE = 17
SPINDLE_DIRECTION = 18
PATH_COLUMNS = (
    "kind", "length", "start_x", "start_z", "end_x", "end_z", "centre_x", "centre_z", "radius", "start_angle", "sweep", "feed", "feed_mode",
    "spindle_mode", "spindle_speed", "spindle_limit", "dwell", "line", "direction",
)  # fmt: skip

RAPID = 0.0
LINE_MOVE = 1.0
ARC_MOVE = 2.0
DWELL_PAUSE = 3.0

PER_MINUTE = 0.0
PER_REVOLUTION = 1.0
THREAD = 2.0
"""Feed mode of a thread: the way follows the angle of the spindle from its index on, its lead stands as the feed.

``start_angle`` is the angle from the index to its start [rad]."""
THREAD_ON = 3.0
"""Feed mode of a thread that continues the previous one without waiting for the index."""
TAP_OUT = 4.0
"""Feed mode of the way out of a tapped hole: it continues the previous thread while the spindle reverses."""

SPINDLE_OFF = 0.0
CONSTANT_SPEED = 1.0
CONSTANT_SURFACE_SPEED = 2.0
