"""The single-pass cycles G90, G92 and G94 of system A: in, along, out and back.

Source: Fanuc 0i-T operator's manual, canned cycle (outer and inner diameter cutting, thread cutting, end face turning). ``taper`` is the
word R: how far the start of the cut lies from its end.
"""

from __future__ import annotations

import math

from lathesim.program.cycles.step import Point, Step


def turning_pass(start: Point, end: Point, taper: float) -> list[Step]:
    """Return G90: rapid to the diameter, feed along, feed out to the start's X, rapid back."""
    return [Step("rapid", (end[0] + taper, start[1])), Step("feed", end), Step("feed", (start[0], end[1])), Step("rapid", start)]


def facing_pass(start: Point, end: Point, taper: float) -> list[Step]:
    """Return G94: rapid to the depth, feed across, feed out to the start's Z, rapid back."""
    return [Step("rapid", (start[0], end[1] + taper)), Step("feed", end), Step("feed", (end[0], start[1])), Step("rapid", start)]


def threading_pass(start: Point, end: Point, taper: float, lead: float, chamfer: float = 0.0) -> list[Step]:
    """Return G92: rapid to the diameter, thread along with ``lead`` [m] on the longer axis and its run-out, rapid out and back."""
    begin = (end[0] + taper, start[1])
    return [
        Step("rapid", begin),
        *thread_with_run_out(begin, end, lead, chamfer, 1.0 if start[0] >= end[0] else -1.0),
        Step("rapid", (start[0], end[1])),
        Step("rapid", start),
    ]


def thread_with_run_out(begin: Point, end: Point, lead: float, chamfer: float, outside: float) -> list[Step]:
    """Return a thread that runs out over its last ``chamfer`` [m] along Z, at 45 degrees to the side ``outside`` of X, in one motion.

    Without a chamfer, or with a chamfer as long as the thread, there is no run-out.
    """
    along, length = lead_along_path(begin, end, lead), abs(end[1] - begin[1])
    if not 0.0 < chamfer < length:
        return [Step("thread", end, lead=along)]
    share = 1.0 - chamfer / length
    leave = (begin[0] + share * (end[0] - begin[0]), begin[1] + share * (end[1] - begin[1]))
    out = (leave[0] + outside * chamfer, end[1])
    return [Step("thread", leave, lead=along), Step("thread", out, lead=lead_along_path(leave, out, lead))]


def lead_along_path(begin: Point, end: Point, lead: float) -> float:
    """Return the lead along the path [m] of a thread whose ``lead`` [m] is counted along its longer axis, as F of G32 and G92."""
    across, along = abs(end[0] - begin[0]), abs(end[1] - begin[1])
    longer = max(across, along)
    return lead * math.hypot(across, along) / longer if longer > 0.0 else lead
