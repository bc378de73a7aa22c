"""What the uncertain values are expected to be after a change, from the laps before it.

What is uncertain about a value of the machine is mostly how large it is, and not whether it stays: a mass that was found on the laps before
is the mass after. How a value moved over the segments before tells how far it may have moved since: its increments add up as those of a
random walk, and their mean may go on or end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lathesim.live.watching.courses.value_course import SEGMENT
from lathesim.live.watching.thresholds import ERRORS
from lathesim.record import FloatArray


@dataclass(frozen=True, eq=False)
class Expected:
    """Values [scales from the lesson's] and their standard ``deviations``, both (parameters,)."""

    values: FloatArray
    deviations: FloatArray


def expected_values(times: FloatArray, values: FloatArray, at: float) -> Expected:
    """Return the values expected at a time ``at`` [s] from those noted at ``times`` (notes,) [s] before; ``values`` (notes, parameters).

    With n increments d over a segment, of the mean u and the variance v, that of one is s^2 = (p^2 + n v) / (n + 1): the drift p that is
    allowed to any value counts as one increment, one that was not seen yet. After m segments the variance is m s^2 + m^2 (u^2 + v / n), and
    s^2 / 2 for the error of the last note; without any increment p^2 stands for v / n. No value is less sure than the lesson's.
    """
    last = len(times) - 1
    rows = [int(np.searchsorted(times, times[last] - number * SEGMENT)) for number in range(int((times[last] - times[0]) / SEGMENT) + 1)]
    steps = np.diff(values[rows[::-1]], axis=0)
    count = len(steps)
    mean = steps.mean(axis=0) if count else np.zeros(values.shape[1])
    allowed = (ERRORS.drift * SEGMENT) ** 2
    spread = np.mean((steps - mean) ** 2, axis=0) if count else np.zeros(values.shape[1])
    one = (allowed + count * spread) / (count + 1)
    many = max(0.0, at - float(times[last])) / SEGMENT
    variance = (0.5 + many) * one + many**2 * (mean**2 + (spread / count if count else allowed))
    return Expected(values[last], np.minimum(1.0, np.sqrt(variance)))
