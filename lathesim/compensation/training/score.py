"""What a regulator is trained for, from the channels of a run, with the gradient that a search follows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lathesim.engine.assembly import FloatArray
from lathesim.errors import LessonError, nearest
from lathesim.identification.estimation.fit import Weighting

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


@dataclass(frozen=True)
class AsScored(Weighting):
    """Traces, shape (situations, channels, samples), as they count: the squares add up to the mean score over the situations.

        rms = sum_k (x_k / sqrt(N rms))^2,    largest = (x_l / sqrt(|x_l|))^2 at its sample l

    Divided by the sizes at one place, their slopes are those of the score there; the second derivatives of the traces are left out.
    """

    score: Score

    def power(self, residual: FloatArray) -> float:
        """Return the mean score; infinity where a run diverged."""
        return float(np.mean([total(self.score, traces) for traces in residual]))

    def white(self, residual: FloatArray) -> FloatArray:
        """Return the traces divided by the roots of their sizes, shape (numbers,)."""
        return np.asarray(self.white_slopes(residual[None], residual)[:, 0])

    def white_slopes(self, slopes: FloatArray, residual: FloatArray) -> FloatArray:
        """Return slopes of traces divided by the roots of the sizes at ``residual``, shape (numbers, weights)."""
        rows = []
        for situation, traces in enumerate(residual):
            for channel, (_, weight) in enumerate(self.score.channels):
                trace, changes = traces[channel], slopes[:, situation, channel]
                size = max(size_of(trace, self.score.size), _TINY)
                if self.score.size == "largest":
                    place = int(np.argmax(np.abs(trace)))
                    trace, changes = trace[place : place + 1], changes[:, place : place + 1]
                rows.append(changes * math.sqrt(weight / (trace.size * size * len(residual))))
        return np.concatenate(rows, axis=1).T
