"""Whether the clock of way-points runs apart from that of the simulated program."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.experiments.waypoints import Waypoints
from lathesim.units import in_unit

_LEAST_LEAD = 0.05
"""Time [s] by which a clock must be ahead or behind at the end before it is told; assumed: a shorter one is lag or jitter."""
_LEFT = 0.1
"""Share of the power left by a constant shift that a running clock may leave; assumed: other machines leave far more."""


def clocks_apart(recorded: Sequence[Waypoints], simulated: Sequence[FloatArray]) -> Iterator[str]:
    """Yield a sentence for each recording whose clock runs apart from the simulated program's.

    ``simulated`` holds for each recording the readings (channels, times) [SI] of the machine as given at its times. Two fits by least
    squares are compared, y(t) = m(t - d) and y(t) = m(t / (1 + s) - d): a constant shift d is the lag of an axis, a skew s is none. A
    sentence comes where the skew takes away nine tenths of what a shift leaves, and 50 ms or more come together by the end. A control that
    slows down at each corner looks the same, so the recording is not refused.
    """
    for item, readings in zip(recorded, simulated, strict=True):
        if not np.isfinite(readings).all():
            continue
        skew, left = _skew(item, readings)
        late = skew * item.duration
        if abs(late) < _LEAST_LEAD or left > _LEFT:
            continue
        pace, corners = ("fast", "slower") if late > 0.0 else ("slow", "quicker")
        yield (
            f"{item.file.name}: its clock runs {in_unit(abs(skew), '%', '.2g')} {pace} against the program as simulated, "
            f"{in_unit(abs(late), 'ms', '.3g')} after {item.duration:.3g} s. Correct its time column, unless the control is that much "
            f"{corners} at corners."
        )


def _skew(item: Waypoints, readings: FloatArray) -> tuple[float, float]:
    """Return the skew of the clock (0.01: a second lasts 1.01 s) and the power it leaves, as a share of what a shift alone leaves."""
    from scipy.optimize import least_squares

    time, values = item.time, list(item.values.values())

    def deviations(point: FloatArray) -> FloatArray:
        stretched = time / (1.0 + point[1]) - point[0] if len(point) > 1 else time - point[0]
        rows = [column - np.interp(stretched, time, row) for column, row in zip(values, readings, strict=True)]
        return np.asarray(np.nan_to_num(np.concatenate(rows)))

    shift = least_squares(deviations, [0.0], x_scale=0.1, diff_step=1e-3)
    # a descent finds the skew only from nearby, so several starts are tried
    both = min(
        (
            least_squares(deviations, [0.0, start], x_scale=[0.1, 0.01], bounds=([-2.0, -0.2], [2.0, 0.2]))
            for start in (-0.05, -0.01, 0.0, 0.01, 0.05)
        ),
        key=lambda found: float(found.cost),
    )
    return float(both.x[1]), float(both.cost / max(shift.cost, 1e-300))
