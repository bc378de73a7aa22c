"""How the values that may move go: uncertain values and sizes of known effects, estimated together over one segment after another.

The blocks of a segment are added up and solved once for all values (least squares, held by what the lesson calls uncertain; followed sizes
are free). A warm-up moves the uncertain values, and leaves the size of an effect alone as far as the segment tells them apart.

What the uncertain values are expected to be after a change, from the laps before it.

What is uncertain about a value of the machine is mostly how large it is, and not whether it stays: a mass that was found on the laps before
is the mass after. How a value moved over the segments before tells how far it may have moved since: its increments add up as those of a
random walk, and their mean may go on or end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lathesim.live.watching.residual_stream import FREE, Residual
from lathesim.live.watching.thresholds import ERRORS
from lathesim.live.watching.usual import Usual
from lathesim.record import FloatArray

SEGMENT = 20.0
"""Seconds of a segment: about a lap, over which what differs comes and goes."""

_HOLD_MORE, _HOLD_MOST = 2.0, 1e9
"""By how much more values that move too far are held at a time, and at most."""


@dataclass(frozen=True, eq=False)
class CoursePoint:
    """Estimates of a segment around ``time`` [s]: ``values`` (parameters,) [scales from the lesson's], their standard ``deviations``, and
    the ``excess`` (channels,) [SI]: root mean square of what the followed sizes do to each channel; NaN where that is not simulated."""

    time: float
    values: FloatArray
    deviations: FloatArray
    excess: FloatArray


class ValueCourse:
    """Adds up blocks and returns a :class:`CoursePoint` for each whole segment. ``usual`` is what the machine showed before it changed.

    ``centre`` (parameters,) are the uncertain values then; ``new`` (parameters,) [scales] is how large a followed effect is, with the
    lesson's size, that the machine did not have then.
    """

    def __init__(self, usual: Usual, free: NDArray[np.bool_], centre: FloatArray, new: FloatArray, block_time: float) -> None:
        self.usual, self._free, self._new, self._block_time = usual, free, new, block_time
        self._centre = np.where(free, 0.0, centre)
        self._weight = 1.0 / usual.variance
        self._prior = np.where(free, FREE, 1.0)
        self._begin()

    def _begin(self) -> None:
        parameters, channels, self._samples = len(self._free), len(self.usual.mean), 0
        self._times: list[float] = []
        self._normals: list[FloatArray] = []
        self._rights: list[FloatArray] = []
        self._square = np.zeros(channels)
        self._mixed, self._quadratic = np.zeros((parameters, channels)), np.zeros((parameters, parameters, channels))

    def take(
        self, residual: Residual, quick: FloatArray, nominal: FloatArray, difference: FloatArray | None, time: float
    ) -> CoursePoint | None:
        """Return the point of a segment with the block that ends at ``time`` [s] and completes it; None before.

        ``residual`` holds averaged samples around the ``nominal`` values; ``difference`` (channels, samples) is what the machine with the
        followed sizes does more than without them.
        """
        count = self.usual.mean.shape[1]
        block = self.usual.sums(residual, quick, time)
        normal = np.einsum("c,cpq->pq", self._weight, block.normal[:, count:, count:])
        self._normals.append(normal)
        self._rights.append(self._weight @ block.mixed[:, count:] + normal @ nominal)
        sensitivities = np.where(self._free[:, None, None], residual.sensitivities, 0.0)
        plain = np.full_like(residual.values, np.nan) if difference is None else difference
        plain = plain - np.einsum("p,pcn->cn", nominal, sensitivities)
        self._square += np.mean(plain**2, axis=1)
        self._mixed += np.mean(plain * sensitivities, axis=2)
        self._quadratic += np.einsum("pcn,qcn->pqc", sensitivities, sensitivities) / plain.shape[1]
        self._samples += plain.shape[1]
        self._times.append(time - 0.5 * self._block_time)
        return self._point() if len(self._times) * self._block_time >= SEGMENT - 0.5 * self._block_time else None

    def _point(self) -> CoursePoint:
        values, deviations = self._solved(np.array(self._normals), np.array(self._rights))
        square = self._square + 2.0 * values @ self._mixed + np.einsum("p,q,pqc->c", values, values, self._quadratic)
        excess = np.sqrt(np.maximum(0.0, square / len(self._times)))
        point = CoursePoint(float(np.mean(self._times)), values, deviations, excess)
        self._begin()
        return point

    def _solved(self, normals: FloatArray, rights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the values and their standard deviations from the blocks' normal matrices and right sides.

        The noise counts for more, and the values of the first laps hold the better, where blocks contradict one another (by the ratio of
        the scores' own covariance to the information: the trace of White's sandwich), and where followed sizes have changed: what they do
        is known to a tenth only. Beside followed sizes the uncertain values are held until they have moved by no more than the lesson calls
        usual, root mean square: sensitivities of quantised sensors are noise in part, which else takes from a size what it gives to them.
        """
        whole, right = normals.sum(axis=0), rights.sum(axis=0)
        plain = np.linalg.solve(whole + np.diag(self._prior), right + self._prior * self._centre)
        score = rights - normals @ plain
        ratio = float(np.trace(np.linalg.solve(whole + np.diag(self._prior), score.T @ score))) / max(1, len(plain))
        changed = np.where(self._free, plain + self._new, 0.0)
        noise = max(1.0, ratio, 1.0 + ERRORS.linear**2 * float(changed @ whole @ changed) / self._samples)
        hold = 1.0
        while True:
            prior = np.where(self._free, 1.0, hold) * self._prior
            held = whole / noise + np.diag(prior)
            values = np.linalg.solve(held, right / noise + prior * self._centre)
            moved = (values - self._centre)[~self._free]
            if not self._free.any() or not len(moved) or np.mean(moved**2) <= 1.0 or hold > _HOLD_MOST:
                return values, np.sqrt(np.diag(np.linalg.inv(held)))
            hold *= _HOLD_MORE


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
