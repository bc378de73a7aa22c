"""Steps that no machine makes: samples that were dropped without a trace in the clock, and counters that ran over."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from lathesim.recordings.faults.common_motion import Pair
from lathesim.recordings.faults.recorded_channel import RecordedChannel
from lathesim.recordings.finding import Finding

_AROUND = 8
"""Samples on either side of a fall over which a counter is seen to move on."""
_FAR = 8.0
"""A jump is this many times larger than what the steps around it let expect."""


def dropped_samples(found_pairs: list[Pair], period: float) -> list[Finding]:
    """Find samples in which two channels of one motion jump together and by the same way, as when rows between them are missing.

    A machine cannot follow a jump of its reference within one sample, so both at once is the logger's.
    """
    for pair in found_pairs:
        first, second = pair.first, pair.second
        if first.unit != second.unit or pair.correlation < 0.9 or first.unit not in ("m", "rad"):
            continue
        at = np.intersect1d(_jumps(first), _jumps(second))
        at = at[np.abs(first.steps[at]) < 0.6 * first.span]
        ratio = second.steps[at] / (pair.slope * first.steps[at])
        at = at[(ratio > 0.5) & (ratio < 2.0)]
        if not len(at):
            continue
        lost = [_lost(first, int(place)) for place in at]
        places = ", ".join(f"{(place + 1) * period:.6g}" for place in at[:5]) + (" and so on" if len(at) > 5 else "")
        fact = f"all channels jump together {len(at)} times, at {places} s, as if about {int(sum(lost))} samples were dropped there"
        return [Finding("dropped", "time", fact, "record again with a logger that keeps up, or cut the recording there", True)]
    return []


def _jumps(channel: RecordedChannel) -> npt.NDArray[np.int64]:
    """Return the steps (their positions) far larger than their neighbours on both sides, and sudden as never else."""
    steps = np.abs(channel.steps)
    sudden = np.abs(np.diff(channel.steps, prepend=channel.steps[0]))
    usual = float(np.quantile(sudden, 0.99))
    around = np.maximum.reduce([np.roll(steps, shift) for shift in (-4, -3, -2, 2, 3, 4)])
    beside = np.maximum(np.roll(steps, 1), np.roll(steps, -1))
    far = (steps > _FAR * around + 6.0 * channel.roughness) & (steps > 1.5 * beside) & (steps > 0.2 * channel.usual_step)
    far &= sudden > 5.0 * usual
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
        jumps = np.flatnonzero(np.abs(channel.steps) > 0.6 * channel.span)
        jumps = jumps[(jumps > _AROUND) & (jumps < len(channel.steps) - _AROUND)]
        if not len(jumps) or len(jumps) > len(channel.steps) // 20:
            continue
        before = channel.values[jumps] - channel.values[jumps - _AROUND]
        after = channel.values[jumps + 1 + _AROUND] - channel.values[jumps + 1]
        against = (before * channel.steps[jumps] < 0.0) & (after * channel.steps[jumps] < 0.0)
        against &= (np.abs(after) < 3.0 * np.abs(before)) & (np.abs(before) < 3.0 * np.abs(after))
        middle = np.abs(channel.values - 0.5 * (channel.values.max() + channel.values.min())) < 0.25 * channel.span
        if against.all() and np.mean(middle) > 0.2:
            width = float(np.median(np.abs(channel.steps[jumps])))
            first = (jumps[0] + 1) * period
            fact = f"it falls back by {width:.6g} {channel.unit} {len(jumps)} times while it moves on, first at {first:.6g} s"
            findings.append(Finding("wrapped", channel.name, fact, "add the width of the counter at each fall before recording it", True))
    return findings
