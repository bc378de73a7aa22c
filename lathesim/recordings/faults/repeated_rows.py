"""What is written twice: blocks of rows, and stretches of one sensor that its logger gave again."""

from __future__ import annotations

import numpy as np

from lathesim.recordings.faults.common_motion import MOTION_UNITS, Pair
from lathesim.recordings.faults.recorded_channel import RecordedChannel, runs_of
from lathesim.recordings.finding import Finding

_SHORTEST_COPY, _LONGEST_COPY, _COPY_JUMP = 20, 2_000, 5.0
"""Samples of a stretch that is given twice, and by how many of the steps around it a channel jumps back where the copy begins."""


def repeated_blocks(channels: list[RecordedChannel], period: float) -> list[Finding]:
    """Find rows that were written twice: a block equal in every channel to the one right before it, with a jump back at the seam."""
    moving = [channel for channel in channels if not channel.constant]
    if not moving:
        return []
    rows = np.ascontiguousarray(np.column_stack([channel.values for channel in moving]))
    names = np.unique(rows.view([("", rows.dtype)] * rows.shape[1]).ravel(), return_inverse=True)[1].ravel()
    order = np.argsort(names, kind="stable")
    back = np.zeros(len(names), dtype=np.int64)
    same = names[order][1:] == names[order][:-1]
    back[order[1:][same]] = (order[1:] - order[:-1])[same]
    begins, ends = runs_of(np.concatenate([[False], (back[1:] == back[:-1]) & (back[1:] > 1)]))
    for begin, end in zip(begins - 1, ends, strict=True):
        distance = int(back[begin])
        whole = end - begin >= 0.9 * distance
        if distance >= 20 and whole and _seam(moving, int(begin)):
            fact = f"the rows from {(begin - distance) * period:.6g} to {(begin - 1) * period:.6g} s are written twice"
            return [Finding("repeated", "", fact, "take the second copy out", True)]
    return []


def _seam(channels: list[RecordedChannel], begin: int) -> bool:
    places = [channel for channel in channels if channel.unit in MOTION_UNITS]
    return begin > 0 and any(abs(channel.steps[begin - 1]) > 5.0 * channel.usual_step for channel in places)


def repeated_stretches(found_pairs: list[Pair], period: float) -> list[Finding]:
    """Find stretches that a sensor of a motion gives twice, one right after the other, while another one of the same motion goes on: a
    logger that loses a block of one source and gives the one before again."""
    findings: dict[str, Finding] = {}
    for pair in found_pairs:
        for channel, other in ((pair.first, pair.second), (pair.second, pair.first)):
            if channel.driven or channel.unit not in MOTION_UNITS or other.unit != channel.unit or channel.name in findings:
                continue
            copies = [(begin, length) for begin, length in _copies(channel) if not _is_copy(other, begin, length)]
            if copies:
                begin, length = max(copies, key=lambda copy: copy[1])
                more = f", the longest of {len(copies)} such stretches" if len(copies) > 1 else ""
                when = f"{(begin - length) * period:.6g} to {(begin - 1) * period:.6g} s"
                fact = f"it gives the stretch from {when} twice, while {other.name} goes on{more}"
                findings[channel.name] = Finding("repeated", channel.name, fact, "leave this out, or record again", True)
    return list(findings.values())


def _copies(channel: RecordedChannel) -> list[tuple[int, int]]:
    """Return where a channel jumps back and gives the samples before once more: the first sample of the copy and its length."""
    steps = np.abs(channel.steps)
    around = np.maximum(np.concatenate([[0.0], steps[:-1]]), np.concatenate([steps[1:], [0.0]]))
    found = []
    for begin in (np.flatnonzero((steps > _COPY_JUMP * around) & (around > 0.0)) + 1).tolist():
        first = max(0, begin - _LONGEST_COPY)
        lengths = begin - first - np.flatnonzero(channel.values[first:begin] == channel.values[begin])
        copies = [length for length in lengths.tolist() if length >= _SHORTEST_COPY and _is_copy(channel, begin, length)]
        found += [(begin, length) for length in copies[:1]]
    return found


def _is_copy(channel: RecordedChannel, begin: int, length: int) -> bool:
    """Return whether a stretch of ``length`` samples is that before it again; one that hardly moves is none."""
    here, before = channel.values[begin : begin + length], channel.values[begin - length : begin]
    return len(here) == len(before) and bool(np.all(here == before)) and len(np.unique(here)) > 0.5 * length
