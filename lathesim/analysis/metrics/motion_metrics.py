"""Metrics of what a program asks of an axis."""

from __future__ import annotations

from lathesim.analysis.metrics.metric import Metric, signal
from lathesim.record import FloatArray, Record

_LEAST_WAY = 1e-7
"""Way [m] that a reference must go back before that counts as turning round; assumed: less is rounding."""


def reversals(reference: FloatArray) -> int:
    """Return how often a reference [m] (samples,) turns round."""
    turns, direction, furthest = 0, 0.0, float(reference[0])
    for place in reference.tolist():
        way = place - furthest
        if direction * way > 0.0:
            furthest = place
        elif abs(way) >= _LEAST_WAY:
            # the axis is set moving the first time, which is no reversal
            turns += direction != 0.0
            direction, furthest = (1.0 if way > 0.0 else -1.0), place
    return turns


def _of_axis(axis: str) -> Metric:
    def counted(record: Record) -> float:
        return float(reversals(signal(record, f"interpolator.{axis}_reference", f".{axis}_reference")))

    return Metric(f"{axis}_reversals", "1", f"how often the reference of the {axis} axis turns round", counted)


MOTION_METRICS: tuple[Metric, ...] = (_of_axis("x"), _of_axis("z"))
