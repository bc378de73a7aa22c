"""What a comparator may add to an equation: columns of an effect, over a grid of its one shape parameter."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from tests.diagnosis.real.comparators.equations import Array, Equation

MOST_WAVES = 500
"""Most periods over the travel that are tried."""
STANDING = 0.02
"""Share of the usual speed below which a part counts as standing."""


@dataclass(frozen=True)
class Candidate:
    """An effect of an equation; ``columns`` gives its filtered columns for a shape, of which ``shapes`` are tried.

    ``sizes`` names the parameters of the catalogue that a coefficient (or its amplitude) and a shape are; empty for none.
    """

    effect: str
    at: str
    columns: Callable[[Equation, float], Array]
    shapes: tuple[float, ...] = (0.0,)
    sizes: tuple[str, str] = ("", "")
    whole: bool = False
    """Whether its columns have the size of the effect, so that a coefficient far from 1 is another effect."""

    @property
    def name(self) -> str:
        """The effect at its place."""
        return f"{self.effect} at {self.at}"


def candidates(equation: Equation) -> list[Candidate]:
    """Return the candidates of an equation."""
    return list({"force": _of_force, "drive": _of_drive, "difference": _of_difference}[equation.kind](equation))


def _of_force(equation: Equation) -> Iterator[Candidate]:
    at, speeds = equation.part, np.quantile(np.abs(equation.velocity), (0.02, 0.05, 0.1, 0.2, 0.4))
    yield Candidate("CoulombFriction", at, _single(lambda one, _: _sign(one)), sizes=("level", ""))
    yield Candidate("AsymmetricFriction", at, _single(lambda one, _: np.abs(one.velocity)), sizes=("viscous_difference", ""))
    yield Candidate("ForceOffset", at, _single(lambda one, _: np.ones(len(one.time))), sizes=("offset", ""))
    yield Candidate("StribeckFriction", at, _single(_peak), tuple(speeds[speeds > 0.0]), ("excess", "stribeck_velocity"))
    yield Candidate("Cogging", at, _waves, _periods(equation), ("amplitude", "period"))
    yield Candidate("PositionDependentFriction", at, _rough, _periods(equation)[::4], ("amplitude", "period"))
    yield Candidate("AxialResonance", at, _single(_behind_spring), tuple(np.geomspace(0.5, 100.0, 60)), ("", "frequency"))


def _of_drive(equation: Equation) -> Iterator[Candidate]:
    at, sizes = equation.part, tuple(np.geomspace(0.01, 0.5, 30) * np.max(np.abs(equation.command)))
    yield Candidate("AmplifierDeadZone", at, _single(lambda one, half: np.clip(one.command, -half, half)), sizes, ("", "half_width"))
    yield Candidate("ConverterOffset", at, _single(lambda one, _: np.ones(len(one.time))))
    yield Candidate("TransportDelay", at, _single(lambda one, _: -np.gradient(one.command, one.time)))


def _of_difference(equation: Equation) -> Iterator[Candidate]:
    at = equation.part
    widths = tuple(np.geomspace(1e-5, 1e-1, 60) * np.ptp(equation.position))
    spans = tuple(np.geomspace(0.1, 2.0, 12) * equation.time[-1])
    yield Candidate("CumulativePitchError", at, _single(lambda one, _: one.command))
    yield Candidate("PeriodicPitchError", at, _waves, _periods(equation), ("amplitude", "lead"))
    yield Candidate("Backlash", at, _single(_play), widths, ("", "width"), whole=True)
    yield Candidate("ThermalScrewGrowth", at, _growth, spans, ("", "time_constant"))


def _single(column: Callable[[Equation, float], Array]) -> Callable[[Equation, float], Array]:
    return lambda equation, shape: equation.smooth(column(equation, shape))[:, None]


def _sign(equation: Equation) -> Array:
    speed = equation.velocity
    return np.sign(speed) * (np.abs(speed) > STANDING * np.sqrt(np.mean(speed**2)))


def _peak(equation: Equation, speed: float) -> Array:
    return _sign(equation) * np.exp(-np.abs(equation.velocity) / speed)


def _periods(equation: Equation) -> tuple[float, ...]:
    travel = float(np.ptp(equation.position))
    return tuple(travel / np.arange(3.0, MOST_WAVES, 0.5))


def _waves(equation: Equation, period: float) -> Array:
    angle = 2.0 * np.pi * equation.position / period
    return np.column_stack([equation.smooth(np.sin(angle)), equation.smooth(np.cos(angle))])


def _rough(equation: Equation, period: float) -> Array:
    angle, sign = 2.0 * np.pi * equation.position / period, _sign(equation)
    return np.column_stack([equation.smooth(sign * np.sin(angle)), equation.smooth(sign * np.cos(angle))])


def _behind_spring(equation: Equation, frequency: float, damping: float = 0.02) -> Array:
    """Return the acceleration of a mass behind a spring, (2 z w s + w^2) / (s^2 + 2 z w s + w^2) of the motor's, by the bilinear rule."""
    period = float(equation.time[1] - equation.time[0])
    omega, rate = 2.0 * np.pi * frequency, 2.0 / period
    first, last = 2.0 * damping * omega * rate, omega**2
    above = np.array([first + last, 2.0 * last, last - first])
    below = np.array([rate**2 + first + last, 2.0 * last - 2.0 * rate**2, rate**2 - first + last])
    return np.asarray(lfilter(above / below[0], below / below[0], np.gradient(equation.velocity, period)))


def _play(equation: Equation, width: float) -> Array:
    """Return the position behind a play less that before it."""
    before = equation.position
    behind = np.empty_like(before)
    place = before[0]
    for index, value in enumerate(before.tolist()):
        place = min(max(place, value - 0.5 * width), value + 0.5 * width)
        behind[index] = place
    return behind - before


def _growth(equation: Equation, time_constant: float) -> Array:
    warm = 1.0 - np.exp(-equation.time / time_constant)
    return np.column_stack([equation.smooth(warm * equation.position), equation.smooth(warm)])
