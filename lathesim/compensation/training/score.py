"""What a regulator is trained for, from the channels of a run, with the gradient that a search follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.errors import LessonError, nearest

_TINY = 1e-15


@dataclass(frozen=True)
class Score:
    """A sum of sizes of channels:  score = sum of weight times size(channel).

    ``channels`` holds the ending of a channel's name with its weight; ``size`` is "rms" or "largest".
    """

    name: str
    doc: str
    channels: tuple[tuple[str, float], ...]
    size: str = "rms"


SCORES = {
    score.name: score
    for score in (
        Score(
            "seed",
            "rms contour error [m] + 0.001 rms speed error [m^2/s^2], as published",
            ((".contour_error", 1.0), (".speed_error", 1e-3)),
        ),
        Score("contour", "rms contour error [m]", ((".contour_error", 1.0),)),
        Score("largest", "largest contour error [m]", ((".contour_error", 1.0),), "largest"),
        Score("even", "rms contour error [m] + 0.1 rms speed error [m^2/s^2]", ((".contour_error", 1.0), (".speed_error", 0.1))),
    )
}
"""The scores, by name."""


def score_named(name: str) -> Score:
    """Return a score; :class:`LessonError` with the nearest name where there is none."""
    if name not in SCORES:
        raise LessonError(f"there is no score '{name}'.", remedy=nearest(name, SCORES) or f"Scores: {', '.join(SCORES)}.")
    return SCORES[name]


def size_of(values: FloatArray, how: str) -> float:
    """Return the size of a channel: root mean square, or the largest magnitude."""
    if not np.all(np.isfinite(values)):
        return float("inf")
    return float(np.max(np.abs(values))) if how == "largest" else float(np.sqrt(np.mean(values * values)))


def total(score: Score, traces: Sequence[FloatArray]) -> float:
    """Return the score of one run from the traces of its channels."""
    return sum(weight * size_of(trace, score.size) for (_, weight), trace in zip(score.channels, traces, strict=True))


def slopes(score: Score, traces: Sequence[FloatArray], changes: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return gradient and Gauss-Newton matrix of one run's score, given the changes of its traces, shape (weights, samples), per weight.

    d rms/dw = mean(trace change)/rms; the matrix leaves out the second derivatives of the traces.
    """
    count = changes[0].shape[0]
    gradient, matrix = np.zeros(count), np.zeros((count, count))
    for (_, weight), trace, change in zip(score.channels, traces, changes, strict=True):
        size = max(size_of(trace, score.size), _TINY)
        if score.size == "largest":
            place = int(np.argmax(np.abs(trace)))
            gradient += weight * np.sign(trace[place]) * change[:, place]
            matrix += weight / size * np.outer(change[:, place], change[:, place])
        else:
            gradient += weight * change @ trace / (len(trace) * size)
            matrix += weight * change @ change.T / (len(trace) * size)
    return gradient, matrix
