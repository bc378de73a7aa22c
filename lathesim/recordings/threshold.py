"""When something was on, told from a column: a tool in the cut from its force, a spindle that turns from its current."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lathesim.record import FloatArray


@dataclass(frozen=True)
class Threshold:
    """On from where the column rises through ``above`` until it falls through ``until_below`` [SI of the column's unit].

    A crossing counts only if the column stays on that side for ``lasting`` [s]: noise does not switch. ``until_below`` may be higher than
    ``above``; then the column must have been higher than both before it can fall. A column that begins above is on from the start.
    The channel is ``value`` [SI of the channel] while on and 0 while off.
    """

    above: float
    until_below: float
    lasting: float
    value: float


def switched(column: FloatArray, threshold: Threshold, period: float) -> npt.NDArray[np.bool_]:
    """Return for each sample of ``column`` (samples,), taken every ``period`` [s], whether it is on."""
    least = max(1, round(threshold.lasting / period))
    rises = _crossings(column > threshold.above, least)
    falls = _crossings(column < threshold.until_below, least)
    on = np.zeros(len(column), dtype=bool)
    begin = 0 if len(column) and column[0] > threshold.above else _next(rises, -1)
    while begin is not None:
        end = _next(falls, begin)
        on[begin:end] = True
        begin = None if end is None else _next(rises, end)
    return on


def _crossings(beyond: npt.NDArray[np.bool_], least: int) -> npt.NDArray[np.int64]:
    """Return the samples from which on a condition holds for at least so many samples."""
    edges = np.diff(np.concatenate([[0], beyond.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    found: npt.NDArray[np.int64] = begins[(ends - begins >= least) & (begins > 0)]
    return found


def _next(samples: npt.NDArray[np.int64], after: int) -> int | None:
    place = int(np.searchsorted(samples, after, side="right"))
    return int(samples[place]) if place < len(samples) else None
