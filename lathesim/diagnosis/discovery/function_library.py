"""The functions from which a formula for a missing force or signal is put together, each with its unit.

They come in groups that belong together (a power of the speed, sine and cosine of one wave). Every function is Python text in ``v``
(velocity), ``q`` (position) and ``t`` (time), and the same as numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lombscargle

from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import FloatArray


@dataclass(frozen=True)
class Column:
    """A function of the motion: its text, its unit in the letters of the motion (``v^2``), its values."""

    text: str
    unit: str
    values: Callable[[Mapping[str, FloatArray]], FloatArray]


def groups_of(motion: Mapping[str, FloatArray], signal: FloatArray, method: Method = STANDARD) -> list[list[Column]]:
    """Return the groups of functions to be tried on a signal; those whose letters the motion has."""
    slow = float(f"{method.discovery.smoothed_reversal * float(np.max(np.abs(motion['v']))) or 1.0:.3g}")
    simple = [
        Column("1.0", "1", lambda m: np.ones_like(m["t"])),
        Column("v", "v", lambda m: m["v"]),
        Column("v * abs(v)", "v^2", lambda m: m["v"] * np.abs(m["v"])),
        Column("v * v * v", "v^3", lambda m: m["v"] ** 3),
        Column("abs(v)", "v", lambda m: np.abs(m["v"])),
        Column("v * v", "v^2", lambda m: m["v"] ** 2),
        Column(f"tanh(v / {slow!r})", "1", lambda m: np.tanh(m["v"] / slow)),
        Column("q", "q", lambda m: m["q"]),
        Column("q * q", "q^2", lambda m: m["q"] ** 2),
        Column("q * q * q", "q^3", lambda m: m["q"] ** 3),
        Column("t", "t", lambda m: m["t"]),
        Column(f"q * tanh(v / {slow!r})", "q", lambda m: m["q"] * np.tanh(m["v"] / slow)),
        Column("q * v", "q*v", lambda m: m["q"] * m["v"]),
    ]
    groups = [[column] for column in simple]
    for letter in ("q", "t"):
        wave = strongest_wave(motion[letter], signal, method)
        if wave > 0.0:
            groups.append([_wave("sin", np.sin, wave, letter), _wave("cos", np.cos, wave, letter)])
    return groups


def _wave(name: str, function: Callable[[FloatArray], FloatArray], wave: float, letter: str) -> Column:
    return Column(f"{name}({wave!r} * {letter})", "1", lambda m: np.asarray(function(wave * m[letter])))


def strongest_wave(where: FloatArray, signal: FloatArray, method: Method = STANDARD) -> float:
    """Return the angular frequency over ``where`` at which the signal is strongest [rad a unit], 0 where ``where`` does not move.

    Source: Lomb, Least-squares frequency analysis of unequally spaced data, Astrophysics and Space Science 39 (1976).
    """
    span = float(np.ptp(where))
    if span <= 0.0:
        return 0.0
    thin = slice(None, None, max(1, len(where) // method.discovery.most_points))
    frequencies = 2.0 * np.pi / span * np.geomspace(1.5, 150.0, method.discovery.waves)
    power = lombscargle(where[thin], signal[thin] - np.mean(signal[thin]), frequencies)
    best = int(np.argmax(power))
    finer = np.linspace(frequencies[max(best - 1, 0)], frequencies[min(best + 1, method.discovery.waves - 1)], 41)
    power = lombscargle(where[thin], signal[thin] - np.mean(signal[thin]), finer)
    return float(f"{finer[int(np.argmax(power))]:.6g}")
