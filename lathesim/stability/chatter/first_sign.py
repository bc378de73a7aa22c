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
from lathesim.stability.chatter.thresholds import LINES, SIGN

_MOST_DIFFERENCES = 8
"""Differences of turns that are looked at together at most."""
_BAND = 0.12
"""Half width of a band over its order."""
_CHECKS_A_TURN = 4


@dataclass(frozen=True)
class FirstSign:
    """When chatter could be told [s after the beginning], and the difference of two turns before that over its largest."""

    time: float
    share: float


def first_sign(values: FloatArray, rate: float, turning: float, mean: float) -> FirstSign | None:
    """Return the first sign of chatter in a signal; ``mean`` is that of a force, 0 of other signals. None where nothing tells of it."""
    turn = rate / turning
    steps = _CHECKS_A_TURN * len(values) / turn
    in_a_row = 0
    for check in range(3 * _CHECKS_A_TURN, int(steps) + 1):
        end = check * turn / _CHECKS_A_TURN
        in_a_row = in_a_row + 1 if _grows(values, end, turn, mean) else 0
        if in_a_row >= (1 if mean > 0.0 else SIGN.checks):
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
    """Whether the last turns before ``end`` [samples] show a vibration off the orders that does not die out."""
    before, after = _difference(values, end - turn, turn), _difference(values, end, turn)
    if mean > 0.0 and after.std() < SIGN.of_force * mean:
        return False
    if _changes_sign(before, after):
        return True
    order = _strongest_order(np.concatenate([before, after]))
    if order <= 0.0:
        return False
    count = min(max(math.ceil(SIGN.independent / (2.0 * _BAND * order)), 2), _MOST_DIFFERENCES)
    if end < (count + 1) * turn:
        return False
    rows = [_difference(values, end - back * turn, turn) for back in range(count - 1, -1, -1)]
    return _turns_and_grows(np.concatenate(rows), count, order)


def _changes_sign(before: FloatArray, after: FloatArray) -> bool:
    """Whether a difference comes back as large with its sign changed, in all lines that stand out of its noise: a flip."""
    spectra = np.fft.rfft(np.stack([before, after]), axis=1)
    power = (np.abs(spectra) ** 2).sum(axis=0)
    kept = power > SIGN.stands_out * np.median(power)
    if np.count_nonzero(kept) < SIGN.fewest_lines or power[kept].sum() < SIGN.narrow * power.sum():
        return False
    first, last = spectra[0, kept], spectra[1, kept]
    size, product = float(np.vdot(first, first).real), float(np.vdot(first, last).real)
    return -product >= max(size, SIGN.alike * math.sqrt(size * float(np.vdot(last, last).real)))


def _difference(values: FloatArray, end: float, turn: float) -> FloatArray:
    """Return the turn that ends at a place less the turn before, without its mean."""
    found = _piece(values, max(0.0, end - turn), turn) - _piece(values, max(0.0, end - 2.0 * turn), turn)
    return np.asarray(found - found.mean())


def _strongest_order(both: FloatArray) -> float:
    """Return the order that is strongest in two differences, 0 where none is."""
    power = np.abs(np.fft.rfft(both)) ** 2
    order = 0.5 * np.arange(len(power))
    power[order < LINES.lowest_order] = 0.0
    return float(order[int(np.argmax(power))]) if power.any() else 0.0


def _turns_and_grows(rows: FloatArray, count: int, top: float) -> bool:
    """Whether the band that carries ``count`` differences in a row comes back as large after each turn, turned by an angle that is none of
    whole orders."""
    length = len(rows)
    spectrum = np.fft.fft(rows)
    order = np.fft.fftfreq(length) * length / count
    power = np.where(order >= LINES.lowest_order, np.abs(spectrum) ** 2, 0.0)
    shape = np.exp(-0.5 * ((order - top) / max(1.0, _BAND * top)) ** 2)
    if float((power * shape**2).sum()) < SIGN.narrow * float(power.sum()):
        return False
    band = np.fft.ifft(2.0 * spectrum * shape)
    turn, edge = length // count, max(1, length // (12 * count))
    before, after = band[edge : length - turn - edge], band[turn + edge : length - edge]
    product = np.vdot(before, after)
    first, last = float(np.vdot(before, before).real), float(np.vdot(after, after).real)
    alike = abs(product) / math.sqrt(first * last) if first > 0.0 and last > 0.0 else 0.0
    return bool(alike >= SIGN.alike and last >= SIGN.growth * first and abs(np.angle(product)) > 2.0 * np.pi * SIGN.off_order)
