"""Limits straight from the lines of a response, all lobes and speeds at once.

At each line with Re G < 0 the limit is b = -1/(2 Ks Re G), met at the speeds n = 60 f/(N + eps/(2 pi)), where eps = 2 arg G - pi, modulo a
turn. Between two lines limit and speed are taken as straight. At a speed the lowest branch of all lobes counts.

Source: J. Tlusty, M. Polacek (1963); T. Schmitz, K. S. Smith, Machining Dynamics (2019), chapter 3. Left out: process damping.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from lathesim.record import FloatArray
from lathesim.stability.limits.frequency_limit import Limit

_QUICK_TURN = 0.03
_BETWEEN = 12
"""Phase from line to line [rad] above which lines are put in, and into how many parts an interval is then cut."""


def limits_of_lines(frequency: FloatArray, response: Any, stiffness: float, speeds: FloatArray, lobes: int | None = None) -> list[Limit]:
    """Return the limit at each speed [rpm] from an oriented response [m/N] at rising frequencies [Hz]; at most so many ``lobes``."""
    order = np.argsort(speeds)
    width, where, number = _lowest(frequency, np.asarray(response), stiffness, np.asarray(speeds, dtype=np.float64)[order], lobes)
    found: list[Limit] = [Limit(float(speeds[0]), math.inf)] * len(speeds)
    for place, original in enumerate(order.tolist()):
        speed = float(speeds[original])
        if math.isfinite(width[place]):
            found[original] = Limit(speed, float(width[place]), float(where[place]), int(number[place]))
        else:
            found[original] = Limit(speed, math.inf)
    return found


def between_lines(frequency: FloatArray, response: Any) -> tuple[FloatArray, Any]:
    """Return a response with lines put in where its phase turns quickly from one to the next, near resonances.

    Between lines 1/G is a cubic: near a mode it is that of a spring, mass and damper, k - m w^2 + j c w, exactly.
    """
    response = np.asarray(response)
    size = np.abs(response)
    usable = np.minimum.reduce([size[:-3], size[1:-2], size[2:-1], size[3:]]) > 0.0 if len(size) > 3 else np.zeros(0, dtype=bool)
    turn = np.abs(np.angle(response[2:-1] / np.where(size[1:-2] > 0.0, response[1:-2], 1.0)))
    places = np.flatnonzero(usable & (turn > _QUICK_TURN) & (np.minimum(response.real[1:-2], response.real[2:-1]) < 0.0)) + 1
    if not len(places):
        return frequency, response
    part = np.arange(1, _BETWEEN) / _BETWEEN
    four = np.stack([places - 1, places, places + 1, places + 2])
    x, y = frequency[four], 1.0 / response[four]
    new = frequency[places, None] + part * (frequency[places + 1] - frequency[places])[:, None]
    total = np.zeros(new.shape, dtype=np.complex128)
    for i in range(4):
        weight = np.ones(new.shape)
        for j in range(4):
            if i != j:
                weight = weight * (new - x[j][:, None]) / (x[i] - x[j])[:, None]
        total += weight * y[i][:, None]
    merged = np.concatenate([frequency, new.ravel()])
    order = np.argsort(merged, kind="stable")
    return merged[order], np.concatenate([response, (1.0 / total).ravel()])[order]


def widths_of_lines(frequency: FloatArray, response: Any, stiffness: float, speeds: FloatArray) -> FloatArray:
    """Return only the limits [m] at rising speeds [rpm], infinite where none is met."""
    return np.asarray(_lowest(frequency, np.asarray(response), stiffness, speeds, None)[0])


def _lowest(frequency: FloatArray, response: Any, stiffness: float, speeds: FloatArray, lobes: int | None) -> tuple[Any, Any, Any]:
    width, where = np.full(len(speeds), math.inf), np.full(len(speeds), math.nan)
    number = np.zeros(len(speeds), dtype=np.int64)
    keep = (response.real < 0.0) & (frequency > 0.0)
    if not keep.any():
        return width, where, number
    places = np.flatnonzero(keep)
    f, g = frequency[places], response[places]
    limit = -0.5 / (stiffness * g.real)
    share = (np.angle(g) / np.pi - 0.5) % 1.0
    joined = (np.diff(places) == 1) & (np.abs(np.diff(share)) < 0.5)
    highest = math.ceil(60.0 * f[-1] / speeds[0]) if lobes is None else lobes - 1
    for lobe in range(highest + 1):
        speed = 60.0 * f / np.maximum(lobe + share, 1e-12)
        at = np.searchsorted(speeds, speed)
        crossed = np.flatnonzero(joined & (at[:-1] != at[1:]))
        if not len(crossed):
            continue
        low, high = np.minimum(at[crossed], at[crossed + 1]), np.maximum(at[crossed], at[crossed + 1])
        count = high - low
        line = np.repeat(crossed, count)
        target = np.repeat(low - np.concatenate([[0], np.cumsum(count)[:-1]]), count) + np.arange(int(count.sum()))
        part = (speeds[target] - speed[line]) / (speed[line + 1] - speed[line])
        found = limit[line] + part * (limit[line + 1] - limit[line])
        best = np.full(len(speeds), math.inf)
        np.minimum.at(best, target, found)
        first = found == best[target]
        target, line, part, found = target[first], line[first], part[first], found[first]
        lower = found < width[target]
        target, line, part, found = target[lower], line[lower], part[lower], found[lower]
        width[target], where[target], number[target] = found, f[line] + part * (f[line + 1] - f[line]), lobe
    return width, where, number
