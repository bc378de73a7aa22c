"""Channels that were logged slower than the rest and written into every row: a reading that comes over a field bus."""

from __future__ import annotations

import numpy as np

from lathesim.recordings.faults.recorded_channel import RecordedChannel
from lathesim.recordings.finding import Finding

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
    if len(changes) < _FEWEST or len(np.unique(np.round(channel.steps / np.abs(channel.steps).max(), 6))) < _SIZES:
        return 1
    turns = range(_SLOWEST, 1, -1)
    return next((rows for rows in turns if np.bincount(changes % rows).max() > _IN_TURN * len(changes)), 1)


def _nth(number: int) -> str:
    """Return an ordinal number: 2nd, 16th."""
    ending = {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th") if number % 100 not in (11, 12, 13) else "th"
    return f"{number}{ending}"
