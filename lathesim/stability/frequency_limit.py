"""The limit of the chip width in the frequency domain, at one speed and over all.

On the limit the tip vibrates at a frequency f and  1 + b [Ks (1 - exp(-j w tau)) G(w) + j w C/V N(w)] = 0,  tau = 60/n the delay of a
turn, C the process damping [N/m] and V the cutting speed. G is the receptance for the cutting force, N the receptance
for a force along the normal, such as process damping. At a speed, 1/b = D(w) = -[Ks (1 - exp(-j w tau)) G(w) + j w C/V N(w)] must be real
and positive: the zeros of Im D are found on a grid and refined, and the largest D gives the smallest limit.

Source: J. Tlusty, M. Polacek (1963); Y. Altintas, Manufacturing Automation (2012), analytical stability lobes; D-subdivision for the
process damping. Left out: the tool leaving the cut, and what is not linear.

Limits straight from the lines of a response, all lobes and speeds at once.

At each line with Re G < 0 the limit is b = -1/(2 Ks Re G), met at the speeds n = 60 f/(N + eps/(2 pi)), where eps = 2 arg G - pi, modulo a
turn. Between two lines limit and speed are taken as straight. At a speed the lowest branch of all lobes counts.

Source: J. Tlusty, M. Polacek (1963); T. Schmitz, K. S. Smith, Machining Dynamics (2019), chapter 3. Process damping counts in
:func:`widths_of_lines` alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.record import FloatArray
from lathesim.stability.tool_point import FrequencyResponse, ToolPoint

_POINTS_OF_A_TURN = 48
"""Points of the grid for each turn of exp(-j w tau), assumed: a zero between two of them is met, as Im D turns that slowly."""
_POINTS_OF_A_MODE = 40
"""Points of the grid within the width of the sharpest mode."""
_HIGHEST = 3.0
"""Frequencies up to so many times the highest natural frequency are looked at, and up to one vibration a turn: above, the receptance is
too small to chatter, and the first lobe ends at half a vibration a turn. The factor is assumed."""
_REFINED = 60
_HALF_A_LOBE = 0.5
"""Lobes by which neighbouring lines differ at most; beyond, the phase has wrapped."""


@dataclass(frozen=True)
class WidthLimit:
    """The smallest chip width that chatters [m] at a speed [rpm], the frequency [Hz] and the number of full waves between two turns.

    ``width`` is infinite where no width chatters.
    """

    speed: float
    width: float
    frequency: float = math.nan
    lobe: int = 0


def limit_at(tool: ToolPoint, stiffness: float, speed: float, *, process_damping: float = 0.0, diameter: float = 0.0) -> WidthLimit:
    """Return the limit at a speed [rpm] for a cutting stiffness Ks [N/m^2]; ``process_damping`` C [N/m] acts at ``diameter`` [m]."""
    delay = 60.0 / speed
    highest = max(_HIGHEST * max(mode.frequency for mode in tool.modes), speed / 60.0)
    sharpest = min(max(mode.damping, 1e-4) * mode.frequency for mode in tool.modes)
    count = max(2000, math.ceil(highest * delay * _POINTS_OF_A_TURN), math.ceil(_POINTS_OF_A_MODE * highest / sharpest))
    grid = np.linspace(highest / count, highest, count)
    return _smallest(grid, tool.receptance, tool.normal_receptance, stiffness, speed, process_damping, diameter)


def limit_of_response(
    response: FrequencyResponse,
    factor: float,
    normal_factor: float,
    stiffness: float,
    speed: float,
    *,
    process_damping: float = 0.0,
    diameter: float = 0.0,
) -> WidthLimit:
    """Return the limit at a speed [rpm] from a measured response, interpolated linearly between its lines.

    The response times ``factor`` applies to the cutting force, times ``normal_factor`` to the process damping.
    """
    count = math.ceil(response.highest * 60.0 / speed * _POINTS_OF_A_TURN)
    first = max(float(response.frequency[0]), 1e-6)
    grid = np.union1d(response.frequency[response.frequency >= first], np.linspace(first, response.highest, max(2, count)))

    def shared(share: float) -> Callable[[Any], Any]:
        return lambda frequency: share * response.receptance(frequency)

    return _smallest(grid, shared(factor), shared(normal_factor), stiffness, speed, process_damping, diameter)


def _smallest(
    grid: FloatArray,
    receptance: Callable[[Any], Any],
    normal: Callable[[Any], Any],
    stiffness: float,
    speed: float,
    process_damping: float,
    diameter: float,
) -> WidthLimit:
    """Return the smallest limit on a grid of frequencies [Hz] fine enough to see each zero of Im D."""
    delay = 60.0 / speed
    drag = process_damping / (math.pi * diameter * speed / 60.0) if process_damping > 0.0 else 0.0

    def inverse_width(frequency: Any) -> Any:
        omega = 2.0 * np.pi * np.asarray(frequency)
        whole = -stiffness * (1.0 - np.exp(-1j * omega * delay)) * receptance(frequency)
        return whole - 1j * omega * drag * normal(frequency) if drag else whole

    values = inverse_width(grid)
    crossed = np.flatnonzero((values.imag[:-1] * values.imag[1:] <= 0.0) & (np.maximum(values.real[:-1], values.real[1:]) > 0.0))
    low, high = grid[crossed], grid[crossed + 1]
    sign = np.sign(values.imag[crossed])
    for _ in range(_REFINED):
        middle = 0.5 * (low + high)
        same = np.sign(inverse_width(middle).imag) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    found = inverse_width(low).real
    if not len(found) or found.max() <= 0.0:
        return WidthLimit(speed, math.inf)
    place = int(np.argmax(found))
    return WidthLimit(speed, float(1.0 / found[place]), float(low[place]), int(low[place] * delay))


def smallest_limit(tool: ToolPoint, stiffness: float) -> WidthLimit:
    """Return the width below which no speed chatters: b = -1/(2 Ks min Re G), with its frequency; the speed is that of its first lobe."""
    highest = _HIGHEST * max(mode.frequency for mode in tool.modes)
    sharpest = min(max(mode.damping, 1e-4) * mode.frequency for mode in tool.modes)
    grid = np.linspace(0.0, highest, max(4000, math.ceil(_POINTS_OF_A_MODE * highest / sharpest)))
    place = int(np.argmin(tool.receptance(grid).real))
    low, high = float(grid[max(place - 1, 0)]), float(grid[min(place + 1, len(grid) - 1)])
    for _ in range(200):
        first, second = low + (high - low) * 0.381966, low + (high - low) * 0.618034
        low, high = (low, second) if tool.receptance(first).real < tool.receptance(second).real else (first, high)
    frequency = 0.5 * (low + high)
    response = complex(tool.receptance(frequency))
    if response.real >= 0.0:
        return WidthLimit(math.nan, math.inf)
    half = math.atan2(-(1.0 / response).real, -(1.0 / response).imag)
    return WidthLimit(60.0 * frequency / (half / math.pi), -1.0 / (2.0 * stiffness * response.real), frequency)


def speeds_of(limit: WidthLimit, lobes: int) -> list[float]:
    """Return the speeds [rpm] of the first lobes at which the width of :func:`smallest_limit` is reached."""
    share = 60.0 * limit.frequency / limit.speed
    return [60.0 * limit.frequency / (number + share) for number in range(lobes)]


_QUICK_TURN = 0.03
_BETWEEN = 12
_ROWS = 32
"""Phase from line to line [rad] above which lines are put in, into how many parts an interval is then cut, and how many speeds are looked
at together."""


def limits_of_lines(
    frequency: FloatArray, response: Any, stiffness: float, speeds: FloatArray, lobes: int | None = None
) -> list[WidthLimit]:
    """Return the limit at each speed [rpm] from an oriented response [m/N] at rising frequencies [Hz]; at most so many ``lobes``."""
    order = np.argsort(speeds)
    width, where, number = _lowest(frequency, np.asarray(response), stiffness, np.asarray(speeds, dtype=np.float64)[order], lobes)
    found: list[WidthLimit] = [WidthLimit(float(speeds[0]), math.inf)] * len(speeds)
    for place, original in enumerate(order.tolist()):
        speed = float(speeds[original])
        if math.isfinite(width[place]):
            found[original] = WidthLimit(speed, float(width[place]), float(where[place]), int(number[place]))
        else:
            found[original] = WidthLimit(speed, math.inf)
    return found


def between_lines(frequency: FloatArray, response: Any) -> tuple[FloatArray, Any]:
    """Return a response with lines put in where its phase turns quickly from one to the next, near resonances.

    Between lines 1/G is a cubic: near a mode it is that of a spring, mass and damper, k - m w^2 + j c w, exactly.
    """
    response = np.asarray(response)
    size = np.abs(response)
    inner = [size[place : len(size) - 3 + place] for place in range(4)]
    usable = np.minimum.reduce(inner) > 0.0 if len(size) >= len(inner) else np.zeros(0, dtype=bool)
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


def widths_of_lines(frequency: FloatArray, response: Any, normal: Any, stiffness: float, drag: float, speeds: FloatArray) -> FloatArray:
    """Return the limits [m] alone at speeds [rpm], infinite where none is met, with process damping.

    With G the oriented ``response``, N that for a force along the ``normal``, both (lines,), and A = G + j w drag/(Ks n) N, the limit b is
    met where A + l = G exp(-j w tau), l = 1/(Ks b) and tau = 60/n. At each line |A + l| = |G| leaves two values of l, and the phase tells
    the turns w tau/(2 pi). Where they pass a whole number between two lines, both are taken as straight. ``drag`` is the process damping
    over the cutting speed at 1 rpm [N*s*rpm/m^2]. Source: the equation of :mod:`lathesim.stability.frequency_limit`.
    """
    largest = np.concatenate(
        [_largest(frequency, response, normal, drag / stiffness, speeds[first : first + _ROWS]) for first in range(0, len(speeds), _ROWS)]
    )
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / (stiffness * largest))


def _largest(frequency: FloatArray, response: Any, normal: Any, drag: float, speeds: FloatArray) -> FloatArray:
    """Return the largest l [m/N] of :func:`widths_of_lines` at each speed, 0 where there is none."""
    whole = response + 2j * np.pi * frequency * (drag / speeds[:, None]) * normal
    square = np.abs(response) ** 2 - whole.imag**2
    root = np.sqrt(np.maximum(square, 0.0))
    best = np.zeros(len(speeds))
    for sign in (1.0, -1.0):
        value = np.where(square >= 0.0, sign * root - whole.real, -1.0)
        some = np.any(value > 0.0, axis=0)
        near = some.copy()
        near[1:] |= some[:-1]
        near[:-1] |= some[1:]
        if not some.any():
            continue
        value, lines = value[:, near], np.flatnonzero(near)
        share = np.angle((whole[:, near] + value) / response[near]) / (2.0 * np.pi)
        turns = frequency[near] * (60.0 / speeds[:, None])
        change = np.diff(share)
        begin = turns[:, :-1] + share[:, :-1]
        span = np.diff(turns) + change - np.round(change)
        low, high = np.ceil(np.minimum(begin, begin + span)), np.floor(np.maximum(begin, begin + span))
        slope = np.diff(value) / np.where(span == 0.0, 1.0, span)
        met = value[:, :-1] + np.maximum((low - begin) * slope, (high - begin) * slope)
        real = (square[:, near] >= 0.0)[:, :-1] & (square[:, near] >= 0.0)[:, 1:] & (np.diff(lines) == 1)
        best = np.maximum(best, np.max(np.where(real & (low <= high), met, 0.0), axis=1, initial=0.0))
    return best


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
    joined = (np.diff(places) == 1) & (np.abs(np.diff(share)) < _HALF_A_LOBE)
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
