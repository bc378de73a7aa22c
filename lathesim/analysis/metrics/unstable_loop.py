"""Whether a loop of a run was unstable, by what was recorded: an alarm that says so, or a voltage that goes from limit to limit."""

from __future__ import annotations

import numpy as np

from lathesim.record import FloatArray, Record

UNSTABLE = "the loop is unstable"
"""Words of an alarm that stopped a run because of its loop."""
COMMANDS = "loop_commands"
"""Entry of a record's ``meta``: the channels with which controllers drive, a space between two."""
_SAME = 1e-6
"""Share of the largest command by which two samples in a row at a limit may miss it: the peaks of a command that only swings do not."""
_LEVELS = 20
"""Values of a command up to which it goes to and fro by steps of a converter, as that of an axis that stands does (assumed)."""
_TIMES, _WITHIN = 20, 0.2
"""Times in a row that the command goes to the other limit, each within so many seconds [s], in a loop that swings (assumed)."""


def unstable_loop(record: Record) -> str:
    """Return what a hint says of a run with an unstable loop: that this comes first; empty where no loop was unstable.

    A loop that is unstable in the small swings between the limits of its voltage (K. J. Astrom, R. M. Murray, Feedback Systems, section
    10.5: limit cycle with saturation). One that swings within them is not seen here.
    """
    if UNSTABLE in record.status:
        return "The loop is unstable, see the alarm: mend that first."
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
