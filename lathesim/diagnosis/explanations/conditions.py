"""What a machine was doing at each sample, and the functions of it that a residual may be made of.

Every function is scaled by the estimation recording and evaluated on any other: smooth ones are sums of cosines over the range that the
estimation recording covers, and go on flat beyond it. Source: Solin, Saerkkae, Hilbert space methods for reduced-rank Gaussian process
regression, Statistics and Computing 30 (2020), equation 14.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from scipy.signal import lfilter

from lathesim.analysis.display_unit import display_unit
from lathesim.diagnosis.method import STANDARD, Method
from lathesim.engine.assembly import FloatArray

PROPORTION = "proportion to "
"""How a term that is a multiple of a condition begins."""


@dataclass(frozen=True, eq=False)
class Motion:
    """How a part moved: its ``name``, the ``unit`` of its place ("m" or "rad"), and position, velocity, acceleration (samples,) [SI]."""

    name: str
    unit: str
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, eq=False)
class Conditions:
    """What a machine was doing at each sample: ``time`` since the start (samples,) [s], how its parts moved, ``others`` by name.

    ``absorbed`` (number, samples) is what may be there anyway and is no finding: what a standard deviation of each uncertain value adds.
    """

    time: FloatArray
    motions: tuple[Motion, ...] = ()
    others: Mapping[str, FloatArray] = field(default_factory=dict)
    absorbed: FloatArray | None = None
    rings: bool = False
    """Whether what swings as a part accelerates is looked for: what hangs on it by a spring."""

    def motion(self, name: str) -> Motion:
        """Return the motion of a part."""
        return next(motion for motion in self.motions if motion.name == name)

    def at(self, thin: slice) -> Conditions:
        """Return the conditions at some of the samples."""
        motions = tuple(Motion(one.name, one.unit, one.position[thin], one.velocity[thin], one.acceleration[thin]) for one in self.motions)
        absorbed = None if self.absorbed is None else self.absorbed[:, thin]
        return Conditions(self.time[thin], motions, {name: values[thin] for name, values in self.others.items()}, absorbed, self.rings)


@dataclass(frozen=True)
class Wave:
    """A wave over the position of part ``of``, or over time where that is empty, of a ``period`` [``unit``: m, rad, s]; a ``turning`` one
    changes its sign with the direction of the part."""

    of: str
    period: float
    unit: str
    turning: bool = False

    @property
    def often(self) -> str:
        """How often it repeats, in words."""
        if self.unit == "rad":
            return f"{2.0 * math.pi / self.period:.4g} times a turn"
        factor, unit = display_unit(self.unit, self.period)
        return f"every {self.period / factor:.4g} {unit}" if self.of else f"at {1.0 / self.period:.4g} Hz"


@dataclass(frozen=True)
class Term:
    """A function of a condition: ``on`` says which, ``of`` is the part that moves (empty where none does); or a ``wave``, or what
    swings with a ``frequency`` [Hz] as the part accelerates."""

    on: str
    of: str = ""
    wave: Wave | None = None
    frequency: float = 0.0

    @property
    def is_line(self) -> bool:
        """Whether it is a wave over time, whatever the machine does."""
        return self.wave is not None and not self.wave.of

    @property
    def condition(self) -> tuple[str, str]:
        """What it is a function of, whatever the function is, and the part that moves."""
        return self.on.removeprefix(PROPORTION), self.of

    @property
    def variable(self) -> str:
        """What it is a function of: "velocity of x_axis", "position of x_axis, every 5 mm"."""
        name = self.on.removeprefix(PROPORTION) + (f" of {self.of}" if self.of else "")
        if self.wave is not None:
            return f"{name}, {self.wave.often}"
        return f"{name}, swinging at about {self.frequency:.2g} Hz" if self.frequency else name

    def __str__(self) -> str:
        """Return what it is, after "it": "depends on sign of velocity of x_axis"."""
        where = f" of {self.of}" if self.of else ""
        if self.wave is not None:
            turning = ", and changes its sign with the direction" if self.wave.turning else ""
            return f"is periodic in {self.on}{where}, {self.wave.often}{turning}"
        if self.frequency:
            return f"swings at about {self.frequency:.2g} Hz as {self.of} accelerates"
        on = self.on.removeprefix(PROPORTION)
        return f"depends on {on}{where}" if on == self.on else f"is in proportion to {on}{where}"


@dataclass(frozen=True)
class _Range:
    """The range of a condition on the estimation recording, without its outermost thousandths."""

    FINE: ClassVar[int] = 16
    """Cosines of a function of the place or the speed ..."""
    COARSE: ClassVar[int] = 6
    """... and of one of anything else."""
    ROUGHNESS: ClassVar[float] = 1.5
    """Power of the frequency with which cosines get smaller: between that of a random walk and that of its integral."""

    low: float
    high: float

    @classmethod
    def of(cls, values: FloatArray) -> _Range:
        low, high = np.quantile(values, [0.001, 0.999])
        return cls(float(low), float(high) if high > low else float(low) + 1.0)

    def centred(self, values: FloatArray) -> FloatArray:
        """Return values over half the range, 0 in its middle (samples, 1)."""
        half = 0.5 * (self.high - self.low)
        return np.asarray((values[:, None] - self.low) / half - 1.0)

    def cosines(self, values: FloatArray, number: int) -> FloatArray:
        """Return the cosines of a smooth function (samples, number), each of its usual size."""
        first = np.cos(np.pi * np.clip(0.5 + 0.5 * self.centred(values)[:, 0], 0.0, 1.0))
        found = [np.ones_like(first), first]
        for _ in range(number - 1):
            found.append(2.0 * first * found[-1] - found[-2])
        return np.asarray(np.stack(found[1:], axis=1) * np.arange(1.0, number + 1.0) ** -self.ROUGHNESS)


@dataclass(frozen=True, eq=False)
class Functions:
    """The functions of the operating conditions, in the ranges of the estimation recording."""

    time: _Range
    others: Mapping[str, _Range]
    motions: Mapping[str, _Usual]
    frequencies: tuple[float, ...] = ()

    @classmethod
    def of(cls, conditions: Conditions) -> Functions:
        """Take the ranges from the conditions of the estimation recording."""
        others = {name: _Range.of(values) for name, values in conditions.others.items()}
        frequencies = _frequencies(conditions.time) if conditions.rings else ()
        return cls(_Range.of(conditions.time), others, {one.name: _Usual.of(one) for one in conditions.motions}, frequencies)

    @property
    def terms(self) -> list[Term]:
        """Return the terms that are no waves."""
        found = [Term("time")] + [Term(on) for name in self.others for on in (PROPORTION + name, name)]
        found += [Term("acceleration", name, frequency=frequency) for name in self.motions for frequency in self.frequencies]
        return found + [Term(on, name) for name in self.motions for on in _OF_MOTION]

    def columns(self, conditions: Conditions, term: Term) -> FloatArray:
        """Return the columns of a term (samples, functions)."""
        if term.wave is not None:
            return self._wave(conditions, term.wave)
        if term.frequency:
            return _swing(conditions.motion(term.of).acceleration, term.frequency, float(conditions.time[1] - conditions.time[0]))
        if term.of:
            moved = _Moved(conditions.motion(term.of), self.motions[term.of], self.time.cosines(conditions.time, _Range.COARSE))
            return _OF_MOTION[term.on](moved)
        if term.on == "time":
            return self.time.cosines(conditions.time, _Range.COARSE)
        name = term.on.removeprefix(PROPORTION)
        values, usual = np.nan_to_num(conditions.others[name]), self.others[name]
        return usual.cosines(values, _Range.COARSE) if name == term.on else usual.centred(values)

    def _wave(self, conditions: Conditions, wave: Wave) -> FloatArray:
        angle = 2.0 * np.pi / wave.period * (conditions.motion(wave.of).position if wave.of else conditions.time)
        columns = np.stack([np.sin(angle), np.cos(angle)], axis=1)
        return columns * self.direction(conditions.motion(wave.of))[:, None] if wave.turning else columns

    def direction(self, motion: Motion) -> FloatArray:
        """Return the sign of a velocity (samples,), less than 1 where the part next to stands still."""
        return np.clip(motion.velocity / (_Usual.STANDSTILL * self.motions[motion.name].fastest), -1.0, 1.0)


@dataclass(frozen=True)
class _Usual:
    """The usual highest speed of a part and the ranges of its position, its bent velocity and its acceleration."""

    STANDSTILL: ClassVar[float] = 0.01
    """Share of the usual highest speed below which a part next to stands still."""

    fastest: float
    position: _Range
    velocity: _Range
    acceleration: _Range

    @classmethod
    def of(cls, motion: Motion) -> _Usual:
        fastest = float(np.quantile(np.abs(motion.velocity), 0.99)) or 1.0
        return cls(fastest, _Range.of(motion.position), _Range.of(_bent(motion.velocity, fastest)), _Range.of(motion.acceleration))


def _frequencies(time: FloatArray, turns: float = 4.0, samples: float = 40.0, ratio: float = 1.5) -> tuple[float, ...]:
    """Return frequencies [Hz], each a ``ratio`` above the one before, with so many ``turns`` in a recording and ``samples`` in a turn."""
    slowest, fastest = turns / float(time[-1] - time[0]), 1.0 / (samples * float(time[1] - time[0]))
    return tuple(float(one) for one in np.geomspace(slowest, fastest, max(2, round(math.log(fastest / slowest) / math.log(ratio)))))


def _swing(acceleration: FloatArray, frequency: float, period: float, damping: float = 0.15) -> FloatArray:
    """Return what hangs on a part by a spring: stretch and its rate (samples, 2), each as large as the acceleration [m/s^2].

    z'' + 2 damping w z' + w^2 z = a, as it answers to impulses of the samples; a band of that damping is as wide as frequencies are apart.
    """
    own = 2.0 * math.pi * frequency
    swung = own * math.sqrt(1.0 - damping**2)
    decay, angle = math.exp(-damping * own * period), swung * period
    below = [1.0, -2.0 * decay * math.cos(angle), decay**2]
    stretch = lfilter([0.0, own * period * decay * math.sin(angle)], below, acceleration)
    rate = lfilter([own * period, -own * period * decay * math.cos(angle)], below, acceleration)
    return np.stack([stretch, rate], axis=1)


def _bent(velocity: FloatArray, fastest: float) -> FloatArray:
    """Return a velocity on a scale that is finer at low speeds, where friction changes most."""
    return np.arcsinh(velocity / (10.0 * _Usual.STANDSTILL * fastest))


@dataclass(frozen=True, eq=False)
class _Moved:
    """A motion, its usual ranges, and cosines of the time (samples, functions)."""

    DISTANCES: ClassVar[tuple[float, ...]] = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2)
    """Shares of the way over which what a reversal leaves may die out."""

    motion: Motion
    usual: _Usual
    slow: FloatArray

    @property
    def place(self) -> FloatArray:
        """The position over half its range (samples, 1)."""
        return self.usual.position.centred(self.motion.position)

    @property
    def speed(self) -> FloatArray:
        """The velocity over the usual highest one (samples, 1)."""
        return self.motion.velocity[:, None] / self.usual.fastest

    @property
    def direction(self) -> FloatArray:
        """The sign of the velocity (samples, 1)."""
        return np.clip(self.speed / _Usual.STANDSTILL, -1.0, 1.0)

    @property
    def side(self) -> FloatArray:
        """The direction in which the part moved last (samples,), 0 before it did."""
        direction = self.direction[:, 0]
        return np.trunc(direction[np.maximum.accumulate(np.where(np.abs(direction) >= 1.0, np.arange(len(direction)), 0))])

    @property
    def since_reversal(self) -> FloatArray:
        """What dies out over some ways from a reversal, with the sign of the direction (samples, ways)."""
        side, position = self.side, self.motion.position
        changed = np.concatenate([[True], side[1:] != side[:-1]])
        begun = np.maximum.accumulate(np.where(changed, np.arange(len(side)), 0))
        way = np.abs(position - position[begun]) / (self.usual.position.high - self.usual.position.low)
        return np.asarray(np.exp(-way[:, None] / np.array(self.DISTANCES)) * side[:, None])

    @property
    def places(self) -> FloatArray:
        """Cosines of the position (samples, functions)."""
        return self.usual.position.cosines(self.motion.position, _Range.FINE)

    @property
    def speeds(self) -> FloatArray:
        """Cosines of the bent velocity (samples, functions)."""
        return self.usual.velocity.cosines(_bent(self.motion.velocity, self.usual.fastest), _Range.FINE)


_OF_MOTION: dict[str, Callable[[_Moved], FloatArray]] = {
    "sign of velocity": lambda one: one.direction,
    "direction of the last motion": lambda one: one.side[:, None],
    f"{PROPORTION}velocity": lambda one: one.speed,
    "velocity": lambda one: one.speeds,
    f"{PROPORTION}position": lambda one: one.place,
    "position": lambda one: one.places,
    f"{PROPORTION}acceleration": lambda one: one.usual.acceleration.centred(one.motion.acceleration),
    "acceleration": lambda one: one.usual.acceleration.cosines(one.motion.acceleration, _Range.COARSE),
    "position and direction": lambda one: np.hstack([one.place, one.places[:, : _Range.COARSE]]) * one.direction,
    "distance since reversal": lambda one: one.since_reversal,
    "position and time": lambda one: one.place * one.slow,
    "velocity and time": lambda one: one.speed * one.slow,
}
"""The functions of a motion, by what they depend on."""


ONE_SPEED = "At constant speed a wave over time and one over position look the same: record other speeds."


def at_one_speed(term: Term, conditions: Conditions, method: Method = STANDARD) -> str:
    """Return what a wave over a position, or over time, is too where parts move at one speed for the larger part of a recording:
    ``" (or time, at 50 Hz)"``; empty where their speeds tell the two apart."""
    wave, others = term.wave, []
    for motion in conditions.motions if wave is not None else ():
        speed = np.abs(motion.velocity)
        usual = float(np.median(speed))
        steady = float(np.mean(np.abs(speed - usual) < method.little * usual)) > method.larger_part
        if wave is not None and steady and wave.of in ("", motion.name):
            other = Wave("", wave.period / usual, "s") if wave.of else Wave(motion.name, wave.period * usual, motion.unit)
            others.append(f"{f'position of {motion.name}' if other.of else 'time'}, {other.often}")
    return f" (or {', or '.join(others)})" if others else ""


class Rules:
    """How a flexible explanation is looked for; of these numbers only ``sure`` decides."""

    sure = Method.tie_errors
    """Standard errors above which a term that predicts the validation recording better holds there; chance does so in 2.3 % of terms."""
    blocks = 40
    most_terms = 8
    most_waves = 3
    fitted = 3
    """Terms that are fitted jointly with those before in each round: the likeliest."""
    iterations = 30
    settled = 0.02
    """Change of the logarithms of all strengths with which they are found."""
    new = 1e-6
    """Share of a term that those before do not explain, for it to be another one."""
