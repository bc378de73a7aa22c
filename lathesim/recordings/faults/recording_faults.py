"""Faults of a recording that show in itself, without any simulation: what a logger, a cable or a hurried export does to data.

Each check errs on the side of silence: what a sound machine can do with physics that nobody modelled is no fault of its recording.
"""

from __future__ import annotations

from lathesim.record import Record
from lathesim.recordings.faults.common_motion import pairs, swapped_columns, wrong_factors
from lathesim.recordings.faults.force_sense import senseless_forces
from lathesim.recordings.faults.jumps import dropped_samples, wrapped_counters
from lathesim.recordings.faults.recorded_channel import RecordedChannel, channels_of
from lathesim.recordings.faults.repeated_rows import repeated_blocks, repeated_stretches
from lathesim.recordings.faults.slow_channels import slow_channels
from lathesim.recordings.faults.stuck_values import clipped_channels, clipped_readings, frozen_channels
from lathesim.recordings.faults.time_shift import shifted_channels
from lathesim.recordings.finding import Finding
from lathesim.recordings.mapping import RecordingMapping

_MEASURED = ("m", "m/s", "rad", "rad/s", "N", "N*m", "A", "W")
"""Units of what sensors show; a voltage or a pure number may rest for good reasons."""


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
        *dropped_samples(same, period),
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
