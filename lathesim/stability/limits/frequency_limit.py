"""The limit of the chip width in the frequency domain, at one speed and over all.

On the limit the tip vibrates at a frequency f and  1 + b [Ks (1 - exp(-j w tau)) G(w) + j w C/V N(w)] = 0,  tau = 60/n the delay of a
turn, C the process damping [N/m] and V the cutting speed. G is the receptance for the cutting force, N the receptance
for a force along the normal, such as process damping. At a speed, 1/b = D(w) = -[Ks (1 - exp(-j w tau)) G(w) + j w C/V N(w)] must be real
and positive: the zeros of Im D are found on a grid and refined, and the largest D gives the smallest limit.

Source: J. Tlusty, M. Polacek (1963); Y. Altintas, Manufacturing Automation (2012), analytical stability lobes; D-subdivision for the
process damping. Left out: the tool leaving the cut, and what is not linear.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.record import FloatArray
from lathesim.stability.tool_point.frequency_response import FrequencyResponse
from lathesim.stability.tool_point.modes import ToolPoint

_POINTS_OF_A_TURN = 48
"""Points of the grid for each turn of exp(-j w tau), assumed: a zero between two of them is met, as Im D turns that slowly."""
_POINTS_OF_A_MODE = 40
"""Points of the grid within the width of the sharpest mode."""
_HIGHEST = 3.0
"""Frequencies up to so many times the highest natural frequency are looked at, and up to one vibration a turn: above, the receptance is
too small to chatter, and the first lobe ends at half a vibration a turn. The factor is assumed."""
_REFINED = 60


@dataclass(frozen=True)
class Limit:
    """The smallest chip width that chatters [m] at a speed [rpm], the frequency [Hz] and the number of full waves between two turns.

    ``width`` is infinite where no width chatters.
    """

    speed: float
    width: float
    frequency: float = math.nan
    lobe: int = 0


def limit_at(tool: ToolPoint, stiffness: float, speed: float, *, process_damping: float = 0.0, diameter: float = 0.0) -> Limit:
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
) -> Limit:
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
) -> Limit:
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
        return Limit(speed, math.inf)
    place = int(np.argmax(found))
    return Limit(speed, float(1.0 / found[place]), float(low[place]), int(low[place] * delay))


def smallest_limit(tool: ToolPoint, stiffness: float) -> Limit:
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
        return Limit(math.nan, math.inf)
    half = math.atan2(-(1.0 / response).real, -(1.0 / response).imag)
    return Limit(60.0 * frequency / (half / math.pi), -1.0 / (2.0 * stiffness * response.real), frequency)


def speeds_of(limit: Limit, lobes: int) -> list[float]:
    """Return the speeds [rpm] of the first lobes at which the width of :func:`smallest_limit` is reached."""
    share = 60.0 * limit.frequency / limit.speed
    return [60.0 * limit.frequency / (number + share) for number in range(lobes)]
