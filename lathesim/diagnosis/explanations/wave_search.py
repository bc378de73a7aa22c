"""Waves of a residual: periods over time and over the position of moving parts, found from the residual itself.

With z the whitened residual filtered backwards, the log likelihood that a wave exp(2 pi j k q) of the condition q adds is

    |sum_i z_i exp(-2 pi j k q_i)|^2 / (noise sum_i |H(k dq_i)|^2)

where H is the response of the whitening filter at the frequency with which sample i passes the wave: the generalised least-squares
periodogram. Chance reaches log(M) among M independent periods. Sources: Lomb, Astrophysics and Space Science 39 (1976); Scargle,
Astrophysical Journal 263 (1982), equation 14.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import numpy.typing as npt
from scipy.fft import rfft

from lathesim.diagnosis.explanations.colour import Colour
from lathesim.diagnosis.explanations.conditions import Conditions, Functions, Term, Wave
from lathesim.engine.assembly import FloatArray


@dataclass(frozen=True, eq=False)
class Way:
    """A condition (samples,) over which waves are looked for, and what they are multiplied with there."""

    of: str
    unit: str
    turning: bool
    values: FloatArray
    times: FloatArray


def ways_of(functions: Functions, conditions: Conditions) -> list[Way]:
    """Return the ways of a recording: each part's position, with and without its direction, and time."""
    one = np.ones_like(conditions.time)
    ways = []
    for motion in conditions.motions:
        for turning, times in ((False, one), (True, functions.direction(motion))):
            ways.append(Way(motion.name, motion.unit, turning, motion.position, times))
    return [*ways, Way("", "s", False, conditions.time, one)]


@dataclass(frozen=True, eq=False)
class _Spectrum:
    """The spectrum of a residual over a way."""

    CELLS: ClassVar[int] = 1 << 15
    """Cells of the way."""
    REPETITIONS: ClassVar[float] = 3.0
    """Repetitions on the way from which a function is a wave."""
    EACH: ClassVar[float] = 4.0
    """Samples, or cells, for a period."""
    STANDS: ClassVar[float] = 0.01
    """Share of the largest step below which nothing moves."""
    BESIDE: ClassVar[float] = 0.05
    """Share of a period within which a second wave is the first one, which is not pure."""
    STEPS: ClassVar[int] = 16
    """Speeds whose gains are averaged."""

    way: Way
    times: FloatArray
    colour: Colour

    @property
    def values(self) -> FloatArray:
        """The condition (samples,)."""
        return self.way.values

    @cached_property
    def span(self) -> float:
        return float(np.ptp(self.values))

    @cached_property
    def cells(self) -> npt.NDArray[np.int64]:
        return np.asarray(np.minimum((self.values - self.values.min()) / self.span * self.CELLS, self.CELLS - 1), dtype=np.int64)

    @cached_property
    def frequency(self) -> FloatArray:
        """Repetitions for each unit of the condition (frequencies,), twice as fine as they can be told apart."""
        return np.arange(self.CELLS + 1) / (2.0 * self.span)

    @cached_property
    def steps(self) -> FloatArray:
        return np.abs(np.gradient(self.values))

    @cached_property
    def highest(self) -> float:
        """The highest frequency of which a sample passes no more than a quarter of a period where the part moves."""
        moving = self.steps[self.steps > self.STANDS * float(self.steps.max())]
        return min(self.CELLS / (self.EACH * self.span), 1.0 / (self.EACH * float(np.median(moving))))

    @cached_property
    def power(self) -> FloatArray:
        """The sum of the squares of a whitened wave (frequencies,)."""
        passed = np.quantile(self.steps, (np.arange(self.STEPS) + 0.5) / self.STEPS)
        power = sum((self.colour.power(self.frequency * step) for step in passed), np.zeros(len(self.frequency)))
        return power / self.STEPS * float(self.times @ self.times)

    def strongest(self, matched: FloatArray, noise: float, known: Sequence[Wave]) -> tuple[float, Term] | None:
        """Return the strongest wave, with what it adds to the log likelihood beyond chance [nats]."""
        usable = (self.frequency >= self.REPETITIONS / self.span) & (self.frequency < self.highest)
        for wave in known:
            if wave.of == self.way.of:
                usable &= np.abs(self.frequency * wave.period - 1.0) > max(self.BESIDE, wave.period / self.span)
        if not usable.any():
            return None
        summed = np.bincount(self.cells, weights=matched * self.times, minlength=self.CELLS)
        gain = np.where(usable, np.abs(rfft(summed, 2 * self.CELLS)) ** 2 / np.maximum(self.power * noise, sys.float_info.min), 0.0)
        peak = int(np.argmax(gain))
        before, here, after = (float(gain[place]) for place in (max(peak - 1, 0), peak, min(peak + 1, len(gain) - 1)))
        bend = before - 2.0 * here + after
        shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
        period = 1.0 / float(self.frequency[peak] + shift * self.frequency[1])
        independent = max(2.0, self.span * self.highest)
        way = self.way
        wave = Wave(way.of, period, way.unit, way.turning)
        return here - math.log(independent), Term("position" if way.of else "time", way.of, wave)


class WaveSearch:
    """The ways over which waves of one recording are looked for; samples that are not ``counted`` are left out."""

    AS_WELL: ClassVar[float] = 0.95
    """Share of the best gain with which a way tells a wave as well."""

    def __init__(self, ways: Sequence[Way], colour: Colour, counted: npt.NDArray[np.bool_]) -> None:
        self.colour = colour
        self.ways = [_Spectrum(way, np.where(counted, way.times, 0.0), colour) for way in ways if np.ptp(way.values) > 0.0]

    def strongest(self, left: FloatArray, noise: float, known: Sequence[Wave]) -> tuple[float, Term] | None:
        """Return the strongest wave of a whitened residual (samples,), with what it adds beyond chance [nats]."""
        matched = self.colour.matched(left)
        found = [wave for way in self.ways if (wave := way.strongest(matched, noise, known)) is not None]
        best = max((gain for gain, _ in found), default=0.0)
        # of ways that tell it as well, as where a part moves one way only, the first is taken
        return next((wave for wave in found if wave[0] >= self.AS_WELL * best), None)
