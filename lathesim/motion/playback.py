"""Playing set-points at the servo period from a buffer that may run low: in machine code, as a servo would.

``hold`` consumes one set-point a period and keeps the last one where there is none: the tool stops dead. ``elastic`` consumes r of them,
0 <= r <= 1, changes r by at most rho a period, and keeps r as large as leaves the braking distance r^2 / (2 rho) in the buffer: the tool
slows down on its path. Between two set-points it goes along the straight line. The acceleration along the path grows by v rho / T.
"""

from __future__ import annotations

import numba
import numpy as np
import numpy.typing as npt

_ROUNDING = 1e-9
"""Of a fill, in set-points."""

FloatArray = npt.NDArray[np.float64]

PLACE, RATE, UNDERRUNS, LOWEST, STANDING = 0, 1, 2, 3, 4
"""Places in a player's state: set-points consumed, rate r, periods without a set-point, lowest fill, periods of a dead stop."""
NUMBERS = 5


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def play(ring: FloatArray, arrived: int, ended: bool, rho: float, state: FloatArray, out: FloatArray) -> int:
    """Write the set-points of the next periods to ``out`` (periods, axes) and return how many periods were played.

    ``ring`` (capacity, axes) holds set-point k in row k modulo its length; ``arrived`` is how many came. ``rho`` 0 means ``hold``. It
    returns early only at the end: once all set-points of a stream that ``ended`` are consumed.
    """
    periods: int = len(out)
    axes = out.shape[1]
    rows = len(ring)
    for period in range(periods):
        fill = arrived - state[PLACE]
        if ended and fill <= 0.0:
            return period
        if rho <= 0.0:
            if fill >= 1.0:
                state[PLACE] += 1.0
                state[RATE] = 1.0
            else:
                state[UNDERRUNS] += 1.0
                state[RATE] = 0.0
        else:
            rate = 1.0 if ended else rho * (np.sqrt(1.0 + 2.0 * fill / rho) - 1.0)
            rate = min(1.0, state[RATE] + rho, max(rate, state[RATE] - rho, 0.0))
            if rate > fill:
                if not ended and rate > fill + _ROUNDING:
                    state[STANDING] += 1.0
                rate = fill
            if fill < 1.0 and not ended:
                state[UNDERRUNS] += 1.0
            state[PLACE] += rate
            state[RATE] = rate
        left = arrived - state[PLACE]
        if not ended and left < state[LOWEST]:
            state[LOWEST] = left
        at = state[PLACE] - 1.0
        if at < 0.0:
            at = 0.0
        first = int(np.floor(at))
        share = at - first
        for axis in range(axes):
            begin = ring[first % rows, axis]
            out[period, axis] = begin if share == 0.0 else begin + share * (ring[(first + 1) % rows, axis] - begin)
    return periods
