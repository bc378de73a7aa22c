"""What a machine is made of before it is wired: parts, wires, and the two periods.

Everything here is plain data in SI. A lesson becomes an :class:`Assembly`, and ``wire`` makes a plan of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from lathesim.component import Component
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


@dataclass(frozen=True)
class Wire:
    """Feeds ``target`` (an input or a parameter, ``"part.name"``) from ``source`` (an output or a parameter) or with a constant [SI]."""

    target: str
    source: str = ""
    constant: float = 0.0


@dataclass(frozen=True)
class Assembly:
    """Parts and wires, the sample period [s], the RK4 step [s], the output that ends a run, and the channels to record (all by default)."""

    parts: tuple[Part, ...]
    wires: tuple[Wire, ...]
    sample_period: float
    step: float
    finish: str = ""
    record: tuple[str, ...] | None = None
