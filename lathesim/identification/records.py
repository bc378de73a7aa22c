"""The nouns of identification: a candidate, free parameters and their fit, a model of a recording."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from lathesim.component import Parameter
from lathesim.effects.effect import COMPUTED, Effect
from lathesim.engine.assembly import FloatArray, Place

WAVES = {"phase": ("amplitude", "share"), "second_phase": ("second",)}
"""The phase of a wave, and its sizes: one of negative size is the same wave half a turn on. A size whose phase an effect does not have
goes with the first phase."""


MOST_DAMPED = math.sqrt(0.5)
"""Damping ratio from which on the answer of a mass on a spring has no peak at any frequency: it is a lag and no resonance."""


@dataclass(frozen=True)
class Seat:
    """How an effect sits beside its host.

    It is put ``before`` an effect of the lesson, as behind a spring, if any. The host may be the ``second`` of two sensors of one motion:
    the one that closes no loop, else the later one. ``of_motion`` is the part whose motion a host measures that is a sensor. ``senses``
    says what feeds an input of the effect that its host does not (input -> ``part.output``). ``unsaid_side`` is the only sensor of a place
    with the setting by which it sees behind the effect's spring (sensor -> ``part.parameter``), where the lesson does not say its side.
    """

    before: str = ""
    second: bool = False
    of_motion: str = ""
    senses: Mapping[str, str] = field(default_factory=dict)
    unsaid_side: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Candidate:
    """A candidate: an effect inserted under the name ``part`` at a host.

    ``parameters`` are the free names (``part.parameter``), ``neutral`` their values without the effect [SI]; ``low`` and ``high`` are the
    bounds, ``least`` and ``usual`` the smallest and the largest sizes that are met, ``points`` starting values, shape (points, parameters),
    spread over typical ranges.
    """

    part: str
    effect: type[Effect]
    at: str
    parameters: tuple[str, ...]
    neutral: FloatArray
    low: FloatArray
    high: FloatArray
    least: FloatArray
    usual: FloatArray
    points: FloatArray
    seat: Seat = field(default_factory=Seat)
    shaped: Candidate | None = None
    """The candidate with the values of a finer shape free too; none where it has them or there are none."""

    @property
    def name(self) -> str:
        """The effect's name."""
        return self.effect.__name__

    @property
    def place(self) -> str:
        """Where a lesson inserts it."""
        return self.seat.before or self.at

    @property
    def otherwise(self) -> dict[str, float]:
        """Return the settings of a second form that is tried too: the sensor sits before the effect's spring, or the filter is computed."""
        flag = self.effect.identification.held_flag
        return dict.fromkeys(self.seat.unsaid_side.values(), 0.0) | ({f"{self.part}.{flag}": COMPUTED} if flag else {})

    @property
    def acts_elsewhere(self) -> bool:
        """Return whether the effect acts in several places, by a size in each."""
        return any(name in self.effect.neutral for name in self.effect.identification.extended)

    @property
    def spare(self) -> tuple[str, ...]:
        """The free names that are nothing unless they are given, and without which the effect is still there."""
        declared = self.effect.declared(Parameter)
        items = [(name, low, Place.of(name).port) for name, low in zip(self.parameters, self.low, strict=True)]
        return tuple(name for name, low, item in items if low == 0.0 and item not in self.effect.neutral and declared[item].default == 0.0)

    @property
    def counted(self) -> int:
        """How many of its values are not nothing by themselves."""
        return len(self.parameters) - len(self.spare)

    @property
    def family(self) -> str:
        """The family in which ties are reported."""
        return self.effect.family

    @property
    def nuisance(self) -> tuple[str, ...]:
        """The free names that belong to a recording and not to the machine."""
        return tuple(f"{self.part}.{name}" for name in self.effect.identification.nuisance)

    @property
    def remembered(self) -> tuple[str, ...]:
        """The names of what had happened before a recording began."""
        return tuple(f"{self.part}.{name}" for name in self.effect.identification.history)

    def named(self, items: Collection[str]) -> tuple[str, ...]:
        """Return the free names of some parameters of the effect, as far as they are free."""
        return tuple(name for name in self.parameters if Place.of(name).port in items)

    @property
    def waves(self) -> dict[str, tuple[str, ...]]:
        """The phases (free names), each with the sizes that change their sign where it is turned by pi: those that may be below 0."""
        signed = {name for name, low in zip(self.parameters, self.low, strict=True) if low < 0.0}
        phases = [f"{self.part}.{phase}" for phase in WAVES if f"{self.part}.{phase}" in self.parameters]
        found: dict[str, list[str]] = {phase: [] for phase in phases}
        for turning, sizes in WAVES.items():
            phase = f"{self.part}.{turning}"
            for size in (f"{self.part}.{name}" for name in sizes):
                if phases and size in signed:
                    found[phase if phase in found else phases[0]].append(size)
        return {phase: tuple(names) for phase, names in found.items() if names}


INSTANT = "instant"
FAR_BEYOND = 100.0
"""Times its usual sizes, or its value, that the neutral value of a limit is at least: it vanishes far beyond all that acts."""
QUARTER_TURNS = tuple(0.5 * np.pi * quarter for quarter in (0, 1, 2, -1))
"""Phases of a wave of which one is within an eighth of a turn of any [rad]."""


def instants_of(candidate: Candidate) -> list[str]:
    """Return the free names of a candidate that are instants of a recording: ``instant``, and others like ``second_instant``."""
    declared = candidate.effect.identification.instants
    return [name for name in candidate.parameters if Place.of(name).port.rpartition("_")[2] in declared]


def jump_at(instant: str) -> str:
    """Return the free name of what happens at an instant (a free name): ``second_jump`` at ``second_instant``."""
    return instant.removesuffix(INSTANT) + "jump"


if TYPE_CHECKING:  # a fit of a few values is made without the transforms of scipy, which take half a second to load
    from lathesim.identification.noise import NoiseModel

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

    @property
    def is_declared(self) -> bool:
        """Whether a lesson declares how sure this value is; how a recording begins has no bounds."""
        return bool(np.isfinite(self.low + self.high) and 0.0 < self.uncertainty < np.inf)


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


@dataclass(frozen=True)
class Model:
    """The baseline with some effects, fitted; in ``validation_fit`` only what belongs to a recording is fitted anew."""

    candidates: tuple[Candidate, ...]
    fitted: Fitted
    validation_fit: Fitted

    @property
    def free(self) -> list[Free]:
        """The free parameters, starting where they ended."""
        return with_start(self.fitted)


def is_full_band(candidates: Sequence[Candidate]) -> bool:
    """Return whether a model is to be fitted on all frequencies."""
    return any(candidate.effect.identification.full_band for candidate in candidates)


@dataclass(frozen=True)
class CandidateStanding:
    """A candidate with its gain in log-likelihood on the fitted and the held-out recording [nats] and the share of the error it removes.

    ``held_out`` is NaN before the candidate is judged on the held-out recording: it was only screened.
    """

    name: str
    gain: float
    held_out: float
    share: float


class Standing(str):
    """A line of progress that also carries what it says of candidates, for an onlooker that draws it."""

    candidates: tuple[CandidateStanding, ...]

    @classmethod
    def told(cls, text: str, candidates: Sequence[CandidateStanding]) -> Standing:
        """Return the line with its candidates."""
        standing = cls(text)
        standing.candidates = tuple(candidates)
        return standing
