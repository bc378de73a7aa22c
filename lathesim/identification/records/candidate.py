"""A candidate: an effect of the catalogue placed at a part of a machine, neutral until its parameters are fitted."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from lathesim.component import Parameter
from lathesim.effects.effect import Effect
from lathesim.engine.assembly import FloatArray, Place

WAVES = {"phase": ("amplitude", "share"), "second_phase": ("second",)}
"""The phase of a wave, and its sizes: one of negative size is the same wave half a turn on. A size whose phase an effect does not have
goes with the first phase."""


MOST_DAMPED = math.sqrt(0.5)
"""Damping ratio from which on the answer of a mass on a spring has no peak at any frequency: it is a lag and no resonance."""


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
    second: bool = False
    """Whether the host is the second of two sensors of one motion: the one that closes no loop, else the later one."""
    of_motion: str = ""
    """The part whose motion the host measures, where it is a sensor."""
    senses: Mapping[str, str] = field(default_factory=dict)
    """What feeds an input of the effect that its host does not: input -> ``part.output``."""
    unsaid_side: Mapping[str, str] = field(default_factory=dict)
    """The only sensor of a place and the setting by which it sees behind the effect's spring (sensor -> ``part.parameter``), where the
    lesson does not say on which side it sits."""
    shaped: Candidate | None = None
    """The candidate with the values of a finer shape free too; none where it has them or there are none."""

    @property
    def name(self) -> str:
        """The effect's name."""
        return self.effect.__name__

    @property
    def motor_side(self) -> dict[str, float]:
        """Return the settings with which the sensor whose side nobody says sits before the effect's spring."""
        return dict.fromkeys(self.unsaid_side.values(), 0.0)

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
