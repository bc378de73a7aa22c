"""Free parameters and the outcome of a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from lathesim.engine.assembly import FloatArray

if TYPE_CHECKING:  # a fit of a few values is made without the transforms of scipy, which take half a second to load
    from lathesim.identification.noise.noise_model import NoiseModel

_WITHIN = 30.0
"""Scales of a value within which it is, whatever a recording tells."""


@dataclass(frozen=True)
class Free:
    """A parameter to be fitted [SI]: where it starts, its bounds, its scale, and how sure its given value is (infinite: not given)."""

    name: str
    start: float
    scale: float
    low: float = -np.inf
    high: float = np.inf
    uncertainty: float = np.inf
    given: float = 0.0


@dataclass(frozen=True)
class Fitted:
    """The outcome of a fit: values by name, their covariance, the residual (channels, samples), the noise models and the likelihood."""

    free: tuple[Free, ...]
    values: FloatArray
    covariance: FloatArray
    residual: FloatArray
    noise: tuple[NoiseModel, ...]
    log_likelihood: float
    penalty: float
    constant: Mapping[str, float] = field(default_factory=dict)
    sensitivity: FloatArray | None = None
    misfit: FloatArray | None = None
    """Factor by which each standard error is larger than the noise makes it, (values,): see ``estimation/covariance.py``."""

    @property
    def names(self) -> list[str]:
        """The fitted names in order."""
        return [item.name for item in self.free]

    @property
    def by_name(self) -> dict[str, float]:
        """All values that were set, fitted and constant."""
        return {**self.constant, **dict(zip(self.names, self.values.tolist(), strict=True))}

    @property
    def score(self) -> float:
        """Log-likelihood less half the penalty [nats]."""
        return self.log_likelihood - 0.5 * self.penalty

    def error(self, name: str) -> float:
        """Return one standard error of a fitted value [SI]."""
        return self.error_by_noise(name) * self.misfit_of(name)

    def error_by_noise(self, name: str) -> float:
        """Return one standard error of a fitted value [SI] as far as noise makes it."""
        position = self.names.index(name)
        return float(np.sqrt(max(self.covariance[position, position], 0.0)))

    def known_beforehand(self, position: int) -> float:
        """Return what was known of a free value before the recording, one over its variance."""
        return float(known_beforehand([self.free[position]])[0])

    def misfit_of(self, name: str) -> float:
        """Return by what factor a standard error is larger than noise makes it."""
        return 1.0 if self.misfit is None else float(self.misfit[self.names.index(name)])


def known_beforehand(free: Sequence[Free]) -> FloatArray:
    """Return one over the variance of each free value before the recording, (values,): what a recording leaves open is somewhere within its
    range, else a mixture that nothing shows would blur values that are sure."""
    deviations = np.array([item.uncertainty if np.isfinite(item.uncertainty) else np.inf for item in free], dtype=float)
    scales = np.array([item.scale for item in free], dtype=float)
    return np.asarray(1.0 / np.square(np.maximum(deviations, 1e-300)) + 1.0 / np.square(_WITHIN * scales))


def with_start(fitted: Fitted) -> list[Free]:
    """Return the free parameters of a fit, starting where it ended."""
    return [replace(item, start=float(value)) for item, value in zip(fitted.free, fitted.values, strict=True)]
