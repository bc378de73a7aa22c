"""What a machine is made of before it is wired: parts, wires, and the two periods.

Everything here is plain data in SI. A lesson becomes an :class:`Assembly`, and ``wire`` makes a plan of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self, TypeVar

import numpy as np

from lathesim.component import Component, Declaration, Parameter
from lathesim.record import Place as Place

Value = TypeVar("Value")
FloatArray = np.ndarray[Any, np.dtype[np.float64]]


def of_part(part: str, named: Mapping[str, Value]) -> dict[str, Value]:
    """Return by port the values that are named ``part.port``, of one part."""
    return {place.port: value for name, value in named.items() if (place := Place.of(name)).part == part}


SIDES = ("motor", "", "load")
"""On which side of a spring a sensor sits, in the order of the drive; empty where nobody says it."""


@dataclass(frozen=True)
class Part:
    """One component placed in a machine under a name.

    ``parameters`` and ``start`` hold what differs from the defaults [SI]; ``tables`` the arrays (rows, columns); ``memory_lengths`` other
    lengths than declared; ``every`` n means that the part is sampled at each n-th sample instant of the machine. ``side`` says on which
    side of a spring a sensor sits, one of ``SIDES``; empty where nobody says it.
    """

    name: str
    component: type[Component]
    parameters: Mapping[str, float] = field(default_factory=dict)
    start: Mapping[str, float] = field(default_factory=dict)
    tables: Mapping[str, FloatArray] = field(default_factory=dict)
    memory_lengths: Mapping[str, int] = field(default_factory=dict)
    every: int = 1
    side: str = ""

    def value(self, parameter: str) -> float:
        """Return the value of a parameter [SI]: the own one, else the default of its declaration."""
        return float(self.parameters.get(parameter, getattr(self.component.declarations[parameter], "default", 0.0)))

    @property
    def values(self) -> dict[str, float]:
        """Return the values of all parameters [SI]."""
        return {name: self.value(name) for name in self.component.declared(Parameter)}


@dataclass(frozen=True)
class Wire:
    """Feeds ``target`` (an input or a parameter, ``"part.name"``) from ``source`` (an output or a parameter) or with a constant [SI]."""

    target: str
    source: str = ""
    constant: float = 0.0


Timing = tuple[float, float, int]
"""Sample period [s], step [s], steps a sample."""


@dataclass(frozen=True)
class Assembly:
    """Parts and wires, the sample period [s], the RK4 step [s], the output that ends a run, and the channels to record (all by default)."""

    parts: tuple[Part, ...]
    wires: tuple[Wire, ...]
    sample_period: float
    step: float
    finish: str = ""
    record: tuple[str, ...] | None = None

    @property
    def steps_per_sample(self) -> int:
        """The number of steps from one sample to the next."""
        return max(1, round(self.sample_period / self.step))

    @property
    def timing(self) -> Timing:
        """The times of a run."""
        return self.sample_period, self.step, self.steps_per_sample

    @cached_property
    def by_name(self) -> Mapping[str, Part]:
        """The parts by their names."""
        return {part.name: part for part in self.parts}

    @cached_property
    def wired(self) -> Mapping[str, Wire]:
        """The wires by their targets."""
        return {wire.target: wire for wire in self.wires}

    @cached_property
    def sources(self) -> Mapping[str, str]:
        """What feeds each target of a wire; empty for a constant."""
        return {wire.target: wire.source for wire in self.wires}

    def declared(self, place: str) -> Declaration:
        """Return how ``part.name`` is declared."""
        part, item = Place.of(place)
        return self.by_name[part].component.declarations[item]

    def ports(self, place: str) -> Mapping[str, str]:
        """Return the ports by role of the part of a place; none where the machine has no such part."""
        part = self.by_name.get(Place.of(place).part)
        return part.component.ports if part is not None else {}

    def with_parameters(self, values: Mapping[str, float]) -> Self:
        """Return the assembly with other values [SI] of parameters, by ``part.parameter``."""
        given = {part.name: of_part(part.name, values) for part in self.parts}
        parts = (replace(part, parameters={**part.parameters, **given[part.name]}) if given[part.name] else part for part in self.parts)
        return replace(self, parts=tuple(parts))


Wired = TypeVar("Wired", bound=Assembly)


class Rewiring:
    """Parts and wires of an assembly by name and target, while some of them are exchanged."""

    def __init__(self, assembly: Assembly) -> None:
        self.parts, self.wires = dict(assembly.by_name), dict(assembly.wired)

    def add(self, part: Part) -> None:
        """Add a part, or put it in the place of one of its name."""
        self.parts[part.name] = part

    def feed(self, source: str, *targets: str) -> None:
        """Feed targets (``part.name``) from an output or a parameter, whatever fed them before."""
        self.wires |= {target: Wire(target, source) for target in targets}

    def pass_on(self, target: str, own: str) -> None:
        """Feed the input ``own`` with what feeds a target."""
        self.wires[own] = replace(self.wires[target], target=own)

    def fed_by(self, output: str) -> list[str]:
        """Return the targets that an output feeds."""
        return [target for target, wire in self.wires.items() if wire.source == output]

    def made(self, assembly: Wired) -> Wired:
        """Return the assembly with these parts and wires."""
        return replace(assembly, parts=tuple(self.parts.values()), wires=tuple(self.wires.values()))
