"""Find out from a record whether a loop was unstable: an alarm says so, or a voltage swings between its limits."""

from __future__ import annotations

import numpy as np

from lathesim.record import FloatArray, Record

UNSTABLE = "the loop is unstable"
"""Words in the status of a run that an alarm stopped because of an unstable loop."""
COMMANDS = "loop_commands"
"""Entry of a record's ``meta``: the command channels of the controllers, separated by spaces."""
_SAME = 1e-6
"""Share of the largest command by which two successive samples may miss its limit (assumed); peaks of a swing differ by more."""
_LEVELS = 20
"""Number of different values up to which a command only toggles by converter steps, as for an axis at rest (assumed)."""
_TIMES, _WITHIN = 20, 0.2
"""Changes to the other limit in a row, and the mean time of each [s], that count as a swinging loop (assumed)."""


def unstable_loop(record: Record) -> str:
    """Return the hint for a run with an unstable loop, or an empty text if no loop was unstable.

    A loop that is unstable for small errors swings between the limits of its voltage (K. J. Astrom, R. M. Murray, Feedback Systems, section
    10.5: limit cycle with saturation). Left out: loops that swing within these limits.
    """
    if UNSTABLE in record.status:
        return "The loop is unstable, see the alarm: correct that first."
    for name in str(record.meta.get(COMMANDS, "")).split():
        part, _, item = name.partition(".")
        if name in record and _bounces(record[name], record.sample_period):
            return f"The loop of {part} is unstable, its {item} goes from limit to limit: lower its gains first."
    return ""


def _bounces(command: FloatArray, period: float) -> bool:
    largest = float(np.max(np.abs(command))) if len(command) else 0.0
    held = np.abs(np.diff(command)) <= _SAME * largest
    near = (command >= np.max(command, initial=0.0) - _SAME * largest) | (command <= np.min(command, initial=0.0) + _SAME * largest)
    at = np.flatnonzero(near[1:] & held)
    if len(at) <= _TIMES or len(np.unique(command)) <= _LEVELS:
        return False
    turns = at[1:][np.sign(command[at[1:]]) != np.sign(command[at[:-1]])]
    if len(turns) <= _TIMES:
        return False
    return bool((turns[_TIMES:] - turns[:-_TIMES] <= _TIMES * _WITHIN / period).any())
