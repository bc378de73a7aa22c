"""When chatter could first have been told: the difference of two turns that comes back larger, turned by the same angle.

What repeats with the spindle, as run-out or a slot, is no part of the difference d(t) = x(t) - x(t - T). Of chatter the next difference
is mu d(t), mu the multiplier of a turn: complex in a narrow band (Hopf), or a negative number in all bands (flip). Three turns show it.
Source: T. Insperger, G. Stepan, Semi-Discretization for Time-Delay Systems (2011), multipliers.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from lathesim.record import FloatArray

_ALIKE = 0.95
"""Least coherence of two differences that follow each other. Calibrated on the tuning half of rigs: it tells 15 of 23 in time, with 7 early
signs in 60 cuts without chatter; 0.97 tells 10 with 6."""
_NARROW = 0.5
"""Least share of the difference in the band of a Hopf bifurcation."""
_BAND = 0.12
_OFF_ORDER = 0.05
"""Angle of the multiplier in turns from which it is no change at whole orders."""
_OF_FORCE = 0.05
"""A difference of so much of the mean force is more than the noise of a cut."""
_CHECKS = 4
"""Checks in a row, two to a turn, where no mean tells how large a vibration is."""
_LOWEST_ORDER = 0.45


@dataclass(frozen=True)
class FirstSign:
    """When chatter could be told [s after the beginning], and the difference of two turns before that over its largest."""

    time: float
    share: float


def first_sign(values: FloatArray, rate: float, turning: float, mean: float) -> FirstSign | None:
    """Return the first sign of chatter in a signal; ``mean`` is that of a force, 0 of other signals. None where nothing tells of it."""
    turn = rate / turning
    steps = 2.0 * len(values) / turn
    in_a_row = 0
    for half_turns in range(6, int(steps) + 1):
        end = half_turns * 0.5 * turn
        in_a_row = in_a_row + 1 if _grows(values, end, turn, mean) else 0
        if in_a_row >= (1 if mean > 0.0 else _CHECKS):
            sizes = difference_sizes(values, turn)
            largest = float(np.quantile(sizes, 0.95)) if len(sizes) else 0.0
            now = sizes[max(0, min(int(end / turn) - 2, len(sizes) - 1))]
            return FirstSign(end / rate, float(now / largest) if largest > 0.0 else 1.0)
    return None


def difference_sizes(values: FloatArray, turn: float) -> FloatArray:
    """Return the standard deviation of each difference of two turns that follow each other, (turns - 1,)."""
    turns = int(len(values) / turn)
    rows = [_piece(values, number * turn, turn) for number in range(turns)]
    return np.array([float((after - before).std()) for before, after in itertools.pairwise(rows)])


def _piece(values: FloatArray, start: float, turn: float) -> FloatArray:
    """Return the turn that begins at a place between samples."""
    places = start + np.arange(int(turn))
    first = int(start)
    part = places - first
    below = part.astype(np.int64)
    inside = values[first : first + int(turn) + 2]
    above = np.minimum(below + 1, len(inside) - 1)
    share = part - below
    return np.asarray((1.0 - share) * inside[below] + share * inside[above])


def _grows(values: FloatArray, end: float, turn: float, mean: float) -> bool:
    """Whether the last three turns before ``end`` [samples] show a vibration off the orders that does not die out."""
    first, second, third = (_piece(values, max(0.0, end - back * turn), turn) for back in (3, 2, 1))
    before, after = second - first, third - second
    before, after = before - before.mean(), after - after.mean()
    if mean > 0.0 and after.std() < _OF_FORCE * mean:
        return False
    size = float(before @ before)
    if not size > 0.0:
        return False
    product = float(before @ after)
    alike = product / math.sqrt(size * float(after @ after)) if after.any() else 0.0
    return (-alike >= _ALIKE and -product >= size) or _turns_and_grows(np.concatenate([before, after]))


def _turns_and_grows(both: FloatArray) -> bool:
    """Whether the band that carries two differences comes back larger after a turn, turned by an angle that is none of whole orders."""
    count = len(both)
    spectrum = np.fft.fft(both)
    order = np.fft.fftfreq(count) * count / 2.0
    power = np.where(order >= _LOWEST_ORDER, np.abs(spectrum) ** 2, 0.0)
    top = float(order[int(np.argmax(power))])
    shape = np.exp(-0.5 * ((order - top) / max(1.0, _BAND * top)) ** 2)
    if float((power * shape**2).sum()) < _NARROW * float(power.sum()):
        return False
    band = np.fft.ifft(2.0 * spectrum * shape)
    edge, half = max(1, count // 24), count // 2
    before, after = band[edge:half], band[half + edge :]
    product, size = np.vdot(before, after), float(np.vdot(before, before).real)
    alike = abs(product) / math.sqrt(size * float(np.vdot(after, after).real))
    return bool(alike >= _ALIKE and abs(product) >= size and abs(np.angle(product)) > 2.0 * np.pi * _OFF_ORDER)
