"""What a case hides: an effect by its number in the catalogue with its parameters, or physics outside the catalogue."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

PERIOD = 1e-3

Draw = Callable[[np.random.Generator, dict[str, float]], "Hidden"]


@dataclass(frozen=True)
class Hidden:
    """One hidden effect.

    ``key`` is its name here; ``changes`` the fields of the truth's physics [SI] that make it; ``parameters`` its numbers in the words of
    the catalogue (value [SI], unit).
    """

    key: str
    changes: dict[str, float]
    parameters: dict[str, tuple[float, str]] = field(default_factory=dict)


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw evenly over the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def either_sign(rng: np.random.Generator) -> float:
    """Draw +1 or -1."""
    return float(rng.choice([-1.0, 1.0]))


def angle(rng: np.random.Generator) -> float:
    """Draw a phase [rad]."""
    return float(rng.uniform(-np.pi, np.pi))


def coloured_noise(rng: np.random.Generator, samples: int, deviation: float, corner: float) -> np.ndarray:
    """Return first-order (Ornstein-Uhlenbeck) noise of the standard deviation and corner frequency [Hz]."""
    keep = float(np.exp(-2.0 * np.pi * corner * PERIOD))
    white = rng.standard_normal(samples) * deviation * np.sqrt(1.0 - keep * keep)
    white[0] = rng.standard_normal() * deviation
    return np.asarray(lfilter([1.0], [1.0, -keep], white))
