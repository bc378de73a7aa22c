"""The modes of a tool point and its receptance along the surface normal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lathesim.errors import LessonError

Complex = np.ndarray[Any, np.dtype[np.complex128]]


@dataclass(frozen=True)
class Mode:
    """One mode: natural frequency [Hz], damping ratio [1], stiffness [N/m], angle of its direction from the surface normal [rad]."""

    frequency: float
    damping: float
    stiffness: float
    direction: float = 0.0

    def __post_init__(self) -> None:
        for word, value in (("natural frequency", self.frequency), ("stiffness", self.stiffness)):
            if not value > 0.0 or not math.isfinite(value):
                raise LessonError(f"a mode has the {word} {value:g}.", remedy="Give a finite value above 0.")
        if not 0.0 <= self.damping < 1.0:
            raise LessonError(f"a mode has the damping ratio {self.damping:g}.", remedy="Give one from 0 to below 1.")

    @property
    def mass(self) -> float:
        """Modal mass [kg]: m = k/(2 pi f)^2."""
        return self.stiffness / (2.0 * math.pi * self.frequency) ** 2

    @property
    def viscous(self) -> float:
        """Modal damping [N*s/m]: c = 2 zeta sqrt(k m)."""
        return 2.0 * self.damping * math.sqrt(self.stiffness * self.mass)


@dataclass(frozen=True)
class ToolPoint:
    """Modes of a tool point with the factor of each: how much of the force acts along it, and how much of it counts along the normal.

    The factor is mu_i = cos(beta - alpha_i) cos(alpha_i), beta the angle of the cutting force from the normal, alpha_i that of the mode.
    A force along the normal, such as process damping, has the factor cos^2(alpha_i) instead. Source: Y. Altintas, Manufacturing
    Automation (2012), oriented transfer function; T. Schmitz, K. S. Smith, Machining Dynamics (2019).
    """

    modes: tuple[Mode, ...]
    factors: tuple[float, ...]

    @classmethod
    def of(cls, modes: Sequence[Mode], force_angle: float) -> ToolPoint:
        """Return the tool point of modes under a force at an angle [rad] from the surface normal."""
        factors = [math.cos(force_angle - mode.direction) * math.cos(mode.direction) for mode in modes]
        return cls(tuple(modes), tuple(factors))

    @property
    def normal_factors(self) -> tuple[float, ...]:
        """The factor of each mode for a force along the normal of the surface: cos^2(alpha_i)."""
        return tuple(math.cos(mode.direction) ** 2 for mode in self.modes)

    def receptance(self, frequency: Any) -> Complex:
        """Return displacement along the normal over the cutting force [m/N] at frequencies [Hz], (frequencies,)."""
        return self._sum(frequency, self.factors)

    def normal_receptance(self, frequency: Any) -> Complex:
        """Return displacement along the normal over a force along it [m/N] at frequencies [Hz], (frequencies,)."""
        return self._sum(frequency, self.normal_factors)

    def _sum(self, frequency: Any, factors: Sequence[float]) -> Complex:
        omega = 2.0 * np.pi * np.asarray(frequency, dtype=np.float64)
        total = np.zeros(omega.shape, dtype=np.complex128)
        for mode, factor in zip(self.modes, factors, strict=True):
            total += factor / (mode.stiffness - mode.mass * omega**2 + 1j * mode.viscous * omega)
        return total
