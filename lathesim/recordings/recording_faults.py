"""Faults of a recording that show in itself, without any simulation: what a logger, a cable or a hurried export does to data.

Each check errs on the side of silence: what a sound machine can do with physics that nobody modelled is no fault of its recording.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from lathesim.engine.assembly import Place
from lathesim.record import FloatArray, Record, stretches
from lathesim.recordings.channel_faults import clipped_channels, clipped_readings, frozen_channels, shifted_channels
from lathesim.recordings.mapping import RecordingMapping
from lathesim.recordings.raw_table import Finding
from lathesim.recordings.recorded_channel import (
    MOTION_UNITS,
    Pair,
    RecordedChannel,
    channels_of,
    correlated,
    pairs,
    swapped_columns,
    wrong_factors,
)
from lathesim.recordings.recording_thresholds import FROZEN, JUMPS, MOTION

_SPECIFIC = (5e7, 2e10)
"""Specific cutting force of anything that is turned [N/m^2], from plastics to hardened steel at small feeds. Range assumed."""
_RATIO = 50.0
"""Components of one cutting force differ less than this."""
_COARSEST_FEED = 1e-3
"""Feeds per revolution above this [m] are not turned with a smaller depth of cut. Assumed."""


def senseless_forces(channels: list[RecordedChannel]) -> list[Finding]:
    """Find forces, feeds and depths of a cut that cannot be as they are mapped."""
    found = _unlike_components(channels)
    by_item = {Place.of(channel.name).port: channel for channel in channels if channel.driven}
    feed, depth = by_item.get("feed"), by_item.get("depth")
    if feed is None or depth is None or feed.group != depth.group or feed.unit != "m" or depth.unit != "m":
        return found
    cutting = (feed.values > 0.0) & (depth.values > 0.0)
    if np.count_nonzero(cutting) < MOTION.least_cut:
        return found
    ratio = float(np.median(feed.values[cutting] / depth.values[cutting]))
    if ratio > MOTION.coarse_feed and float(feed.values.max()) > _COARSEST_FEED:
        largest = feed.values.max() * 1e3
        fact = f"the feed is {ratio:.3g} times the depth of cut (median), up to {largest:.3g} mm, so the two columns look swapped"
        return [*found, Finding("swapped", f"{feed.name}, {depth.name}", fact, "exchange them in the lesson", True)]
    forces = [channel for channel in channels if channel.unit == "N" and not channel.driven and not channel.constant]
    if forces and not found:
        found += _specific_force(feed.values * depth.values, max(forces, key=lambda force: force.span))
    return found


def _specific_force(area: FloatArray, force: RecordedChannel) -> list[Finding]:
    """Hold the force against the area of cut: their ratio is the specific cutting force."""
    if correlated(area, force.values) < MOTION.loosely:
        return []
    specific = float(area @ force.values) / float(area @ area)
    if _SPECIFIC[0] < specific < _SPECIFIC[1]:
        return []
    fact = f"it makes a specific cutting force of {specific * 1e-6:.4g} N/mm^2, and no material has that"
    return [Finding("unit", force.name, fact, "check its unit and scale, and those of feed and depth, in the lesson", True)]


def _unlike_components(channels: list[RecordedChannel]) -> list[Finding]:
    """Find one of several forces of one instrument that is far larger or smaller than the others."""
    forces = [channel for channel in channels if channel.unit == "N" and not channel.driven and not channel.constant]
    for one in forces:
        others = [other for other in forces if other is not one and other.part == one.part]
        if not others:
            continue
        sizes = [one.span / other.span for other in others]
        if all(size > _RATIO for size in sizes) or (len(others) > 1 and all(size < 1.0 / _RATIO for size in sizes)):
            size = float(np.median(sizes))
            fact = f"its range is {size:.4g} times that of {', '.join(other.name for other in others)}, too far apart for one cut"
            return [Finding("unit", one.name, fact, "check its unit and scale in the lesson", True)]
    return []


_AROUND = 8
"""Samples on either side of a fall over which a counter is seen to move on."""
_FAR = 8.0
"""A jump is this many times larger than what the steps around it let expect."""


def dropped_samples(channels: list[RecordedChannel], found_pairs: list[Pair], period: float) -> list[Finding]:
    """Find samples in which two channels of one motion jump together and by the same way, or the only place of a motion jumps ahead and
    goes on as before, as when rows between them are missing.

    A machine cannot follow a jump of its reference within one sample, so both at once is the logger's. Nor does one that moves steadily go
    many times as far in a single sample.
    """
    for pair in found_pairs:
        first, second = pair.first, pair.second
        if first.unit != second.unit or pair.correlation < MOTION.alike or first.unit not in ("m", "rad"):
            continue
        at = np.intersect1d(_jumps(first), _jumps(second))
        at = at[np.abs(first.steps[at]) < JUMPS.fall * first.span]
        ratio = second.steps[at] / (pair.slope * first.steps[at])
        at = at[(ratio > MOTION.same_jump) & (ratio < 1.0 / MOTION.same_jump)]
        if len(at):
            return [_dropped("all channels jump together", first, at, period)]
    paired = {one.name for pair in found_pairs for one in (pair.first, pair.second)}
    for channel in channels:
        if channel.name in paired or channel.driven or channel.constant or channel.unit not in ("m", "rad"):
            continue
        at = _jumps(channel)
        before, after = _around(channel, at)
        ahead = (before * channel.steps[at] > 0.0) & (after * channel.steps[at] > 0.0) & _is_even(before, after)
        at = at[ahead & (np.abs(channel.steps[at]) < JUMPS.fall * channel.span)]
        if len(at):
            return [_dropped(f"{channel.name} jumps ahead", channel, at, period)]
    return []


def _dropped(how: str, channel: RecordedChannel, at: npt.NDArray[np.int64], period: float) -> Finding:
    """Return the finding that rows are missing where a channel jumps."""
    lost = sum(_lost(channel, int(place)) for place in at)
    places = ", ".join(f"{(place + 1) * period:.6g}" for place in at[: JUMPS.listed]) + (" and so on" if len(at) > JUMPS.listed else "")
    often = f"{len(at)} times" if len(at) > 1 else "once"
    fact = f"{how} {often}, at {places} s, as if about {round(lost)} samples were dropped there"
    return Finding("dropped", "time", fact, "record again with a logger that keeps up, or cut the recording there", True)


def _around(channel: RecordedChannel, jumps: npt.NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """Return how far a place moves on over some samples before and after jumps (their positions), which are that far from the ends."""
    before = channel.values[jumps] - channel.values[np.maximum(jumps - _AROUND, 0)]
    last = len(channel.values) - 1
    return before, channel.values[np.minimum(jumps + 1 + _AROUND, last)] - channel.values[np.minimum(jumps + 1, last)]


def _is_even(before: FloatArray, after: FloatArray) -> npt.NDArray[np.bool_]:
    """Return whether a place moves on after jumps about as it did before."""
    even = (np.abs(after) < JUMPS.evenly * np.abs(before)) & (np.abs(before) < JUMPS.evenly * np.abs(after))
    return np.asarray(even)


def _jumps(channel: RecordedChannel) -> npt.NDArray[np.int64]:
    """Return the steps (their positions) far larger than their neighbours on both sides, and sudden as never else."""
    steps = np.abs(channel.steps)
    sudden = np.abs(np.diff(channel.steps, prepend=channel.steps[0]))
    usual = float(np.quantile(sudden, 0.99))
    around = np.maximum.reduce([np.roll(steps, shift) for shift in (-4, -3, -2, 2, 3, 4)])
    beside = np.maximum(np.roll(steps, 1), np.roll(steps, -1))
    far = (steps > _FAR * around + JUMPS.noise * channel.roughness) & (steps > JUMPS.beside * beside)
    far &= (steps > JUMPS.usual * channel.usual_step) & (sudden > JUMPS.sudden * usual)
    far[:4] = far[-4:] = False
    return np.flatnonzero(far)


def _lost(channel: RecordedChannel, place: int) -> float:
    usual = float(np.median(np.abs(channel.steps[max(place - 20, 0) : place + 21])))
    return abs(channel.steps[place]) / usual - 1.0 if usual > 0.0 else 1.0


def wrapped_counters(channels: list[RecordedChannel], period: float) -> list[Finding]:
    """Find a position that falls back by nearly its whole span while it moves on: a counter or an angle that runs over."""
    findings = []
    for channel in channels:
        if channel.constant or channel.unit not in ("m", "rad"):
            continue
        jumps = np.flatnonzero(np.abs(channel.steps) > JUMPS.fall * channel.span)
        jumps = jumps[(jumps > _AROUND) & (jumps < len(channel.steps) - _AROUND)]
        if not len(jumps) or len(jumps) > int(JUMPS.falls * len(channel.steps)):
            continue
        before, after = _around(channel, jumps)
        against = (before * channel.steps[jumps] < 0.0) & (after * channel.steps[jumps] < 0.0) & _is_even(before, after)
        middle = np.abs(channel.values - 0.5 * (channel.values.max() + channel.values.min())) < JUMPS.half * channel.span
        if against.all() and np.mean(middle) > JUMPS.passes:
            width = float(np.median(np.abs(channel.steps[jumps])))
            first = (jumps[0] + 1) * period
            fact = f"it falls back by {width:.6g} {channel.unit} {len(jumps)} times while it moves on, first at {first:.6g} s"
            findings.append(Finding("wrapped", channel.name, fact, "add the width of the counter at each fall before recording it", True))
    return findings


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
    begins, ends = stretches(np.concatenate([[False], (back[1:] == back[:-1]) & (back[1:] > 1)]))
    for begin, end in zip(begins - 1, ends, strict=True):
        distance = int(back[begin])
        whole = end - begin >= JUMPS.copy * distance
        if distance >= JUMPS.least_copy and whole and _seam(moving, int(begin)):
            fact = f"the rows from {(begin - distance) * period:.6g} to {(begin - 1) * period:.6g} s are written twice"
            return [Finding("repeated", "", fact, "take the second copy out", True)]
    return []


def _seam(channels: list[RecordedChannel], begin: int) -> bool:
    places = [channel for channel in channels if channel.unit in MOTION_UNITS]
    return begin > 0 and any(abs(channel.steps[begin - 1]) > FROZEN.jump * channel.usual_step for channel in places)


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


_MEASURED = ("m", "m/s", "rad", "rad/s", "N", "N*m", "A", "W")
"""Units of what sensors show: a command may well change less often than its log has rows."""
_SLOWEST = 250
"""Rows for which a reading may stand, at the most."""
_FEWEST = 60
"""Changes from which on they tell that they come in turn."""
_IN_TURN = 0.98
"""Share of the changes that must come in turn."""
_SIZES = 8
"""Different steps there must be: an encoder that moves steadily takes one count after so many rows each."""


def slow_channels(channels: list[RecordedChannel], period: float) -> list[Finding]:
    """Find readings that change in every n-th row and never between, while another channel of the recording does."""
    refreshed = {channel: _rows_of_one_reading(channel) for channel in channels if not channel.constant}
    fastest = min((rows for channel, rows in refreshed.items() if not channel.driven), default=1)
    found = []
    for channel, rows in refreshed.items():
        if not channel.driven and channel.unit in _MEASURED and rows > fastest:
            fact = f"it changes in every {_nth(rows)} row only, each {1e3 * rows * period:.4g} ms, and other channels do between"
            done = f"log it as fast as the rest, or keep every {_nth(rows)} row of all channels"
            found.append(Finding("slow", channel.name, fact, done, True))
    return found


def _rows_of_one_reading(channel: RecordedChannel) -> int:
    """Return the largest number of rows in whose turn nearly all changes come; 1 where they come in no turn."""
    changes = np.flatnonzero(channel.steps)
    # of two changes in neighbouring rows one comes out of turn
    in_turn = len(changes) - 0.5 * np.count_nonzero(np.diff(changes) == 1)
    if len(changes) < _FEWEST or in_turn <= _IN_TURN * len(changes) or _sizes(channel.steps) < _SIZES:
        return 1
    return next((rows for rows in range(_SLOWEST, 1, -1) if np.bincount(changes % rows).max() > _IN_TURN * len(changes)), 1)


def _sizes(steps: FloatArray) -> int:
    """Return how many different steps there are, to a millionth of the largest."""
    return len(np.unique(np.round(steps / np.abs(steps).max(), 6)))


def _nth(number: int) -> str:
    """Return an ordinal number: 2nd, 16th."""
    ends = {11: "th", 12: "th", 13: "th", 1: "st", 2: "nd", 3: "rd"}
    return f"{number}{ends.get(number % 100) or ends.get(number % 10, 'th')}"


def recording_faults(record: Record, mapping: RecordingMapping) -> list[Finding]:
    """Return what is wrong with a mapped recording as far as it tells by itself; an empty list where nothing is."""
    channels = channels_of(record, mapping)
    period = record.sample_period
    same = pairs(channels, period)
    return [
        *constant_channels(channels),
        *wrong_factors(same),
        *swapped_columns(channels, period),
        *senseless_forces(channels),
        *wrapped_counters(channels, period),
        *dropped_samples(channels, same, period),
        *repeated_blocks(channels, period),
        *repeated_stretches(same, period),
        *frozen_channels(channels, same, period),
        *clipped_channels(same, period),
        *clipped_readings(channels),
        *slow_channels(channels, period),
        *shifted_channels(channels, same, period),
    ]


def constant_channels(channels: list[RecordedChannel]) -> list[Finding]:
    """Find compared channels that never move although something drives them; a rig that rests has no fault."""
    found = []
    for channel in channels:
        if channel.driven or not channel.constant:
            continue
        drives = [other for other in channels if other.driven and other.group == channel.group]
        if not drives and channel.unit in _MEASURED:
            drives = [other for other in channels if other.driven]
        moving = any(not other.constant for other in drives)
        fact = f"it does not move: {channel.values[0]:.6g} {channel.unit} in all {len(channel.values)} samples"
        done = "" if moving else "nothing that belongs to it moves either"
        found.append(Finding("constant", channel.name, fact, done, moving))
    return found
