"""Runs laid over each other: the same channels of several records, as one record for a figure or a file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lathesim.analysis.metrics.metric import find_channel
from lathesim.errors import RecordError
from lathesim.record import FloatArray, Record


def overlaid(runs: Sequence[tuple[str, Record]], channels: Sequence[str]) -> Record:
    """Return one record with the channels of all runs, ``(title, record)``; a single run keeps its names.

    With several, a channel is called ``channel (title)`` and the values of the later runs are interpolated to the instants of the longest.
    Raises :class:`RecordError` where no run has any of the channels.
    """
    if not runs or not any(name in record for _, record in runs for name in channels):
        raise RecordError("there is nothing to draw.", remedy="Choose a run and a channel it has.")
    if len(runs) == 1:
        _, record = runs[0]
        return Record(record.time, {name: record.channel(name) for name in channels if name in record}, dict(record.meta))
    longest = max((record for _, record in runs), key=lambda record: record.time[-1] if len(record) else 0.0)
    found = Record(longest.time, {}, dict(longest.meta))
    for title, record in runs:
        for name in channels:
            if name in record:
                values = np.interp(longest.time, record.time, record[name], right=np.nan)
                found = found.with_channel(f"{name} ({title})", record.unit(name), values, record.channel(name).description)
    return found


def contact(record: Record) -> FloatArray | None:
    """Return where tool and part touch in a block run at feed (1 or 0, (samples,)); None where the record does not tell."""
    name = find_channel(record, ".engaged", ".in_contact")
    return record[name] if name is not None else None


def value_at(record: Record, channel: str, time: float) -> float:
    """Return the value of a channel at the sample nearest to ``time`` [s]; NaN beyond the record."""
    if channel not in record or not len(record) or not record.time[0] <= time <= record.time[-1] + record.sample_period:
        return float("nan")
    place = int(np.searchsorted(record.time, time))
    place = min(place, len(record) - 1)
    if place > 0 and time - record.time[place - 1] < record.time[place] - time:
        place -= 1
    return float(record[channel][place])
