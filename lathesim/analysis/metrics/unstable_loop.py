"""Whether a loop of a run was unstable, by what was recorded: an alarm that says so, or a voltage that goes from limit to limit."""

from __future__ import annotations

import numpy as np

from lathesim.record import FloatArray, Record

UNSTABLE = "the loop is unstable"
"""Words of an alarm that stopped a run because of its loop."""
_AT_LIMIT = 0.9
"""Share of the largest voltage from which on it counts as a limit (assumed)."""
_TIMES, _WITHIN = 20, 0.2
"""Times in a row that the voltage goes to the other limit, each within so many seconds [s], in a loop that swings (assumed)."""


def unstable_loop(record: Record) -> str:
    """Return what a hint says of a run with an unstable loop: that this comes first; empty where no loop was unstable.

    A loop that is unstable in the small swings between the limits of its voltage (K. J. Astrom, R. M. Murray, Feedback Systems, section
    10.5: limit cycle with saturation). One that swings within them is not seen here.
    """
    if UNSTABLE in record.status:
        return "The loop is unstable, see the alarm: mend that first."
    for name, channel in record.channels.items():
        part, _, item = name.partition(".")
        if item == "voltage" and "controller" in part and _bounces(channel.values, record.sample_period):
            return f"The loop of {part} is unstable, its voltage goes from limit to limit: lower its gains first."
    return ""


def _bounces(voltage: FloatArray, period: float) -> bool:
    largest = float(np.max(np.abs(voltage))) if len(voltage) else 0.0
    at = np.flatnonzero(np.abs(voltage) >= _AT_LIMIT * largest)
    if largest == 0.0 or len(at) <= _TIMES:
        return False
    turns = at[1:][np.sign(voltage[at[1:]]) != np.sign(voltage[at[:-1]])]
    if len(turns) <= _TIMES:
        return False
    return bool((turns[_TIMES:] - turns[:-_TIMES] <= _TIMES * _WITHIN / period).any())
