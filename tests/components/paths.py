"""Small paths for the tests of interpolators, and a walk along them without any engine."""

from __future__ import annotations

import math
from typing import Any

from lathesim.component import Component, DiscreteState, Input, Output, Parameter
from lathesim.path_columns import PATH_COLUMNS

RPM = 2.0 * math.pi / 60.0
SAMPLE_PERIOD = 0.005


def row(**columns: float) -> list[float]:
    """Return a row of the path table from the columns that are not zero."""
    assert set(columns) <= set(PATH_COLUMNS)
    return [columns.get(name, 0.0) for name in PATH_COLUMNS]


def line(start: tuple[float, float], end: tuple[float, float], **columns: float) -> list[float]:
    """Return a straight segment between two points (x, z) [m]; kind 1 unless told."""
    length = math.dist(start, end)
    points = {"start_x": start[0], "start_z": start[1], "end_x": end[0], "end_z": end[1]}
    return row(**{"kind": 1.0, "length": length, **points, **columns})


def polyline(*moves: tuple[float, float, float], spindle: float = 1000.0 * RPM) -> list[list[float]]:
    """Return a path from (0, 0) through points (x [mm], z [mm], feed [mm/min]); feed 0 is a rapid."""
    rows, point = [], (0.0, 0.0)
    for x, z, feed in moves:
        target = (x / 1000.0, z / 1000.0)
        kind = 1.0 if feed > 0.0 else 0.0
        rows.append(line(point, target, kind=kind, feed=feed / 60e3, spindle_mode=1.0, spindle_speed=spindle, direction=1.0))
        point = target
    return rows


EXAMPLE_1 = polyline((15, 10, 0), (15, 30, 120), (17, 40, 180), (17, 50, 180), (20, 50, 180), (20, 0, 0), (0, 0, 0))
"""The part program of Example 1 of Liu and Landers (2004)."""


class Walk:
    """Runs a sampled part with tables sample by sample; inputs and parameters at their defaults unless told."""

    def __init__(self, component: type[Component], tables: Any = None, **values: float) -> None:
        self.component = component
        self.values: dict[str, Any] = {name: item.default for name, item in component.declared(Parameter).items()}
        self.values |= {name: item.default for name, item in component.declared(Input).items()}
        self.values |= tables or {}
        self.values |= {"sample_period": SAMPLE_PERIOD, "step": SAMPLE_PERIOD / 10, "time": 0.0}
        self.values |= values
        self.discrete = {name: item.start for name, item in component.declared(DiscreteState).items()}

    def _call(self, law: str) -> tuple[float, ...]:
        return self.component.law_answer(law, {**self.values, **self.discrete})

    def sample(self, **inputs: float) -> dict[str, float]:
        """Update once and give the outputs."""
        self.values |= inputs
        if "update" in self.component.laws:
            self.discrete = dict(zip(self.discrete, self._call("update"), strict=True))
        self.values["time"] += self.values["sample_period"]
        return dict(zip(self.component.declared(Output), self._call("output"), strict=True))

    def to_the_end(self, **inputs: float) -> list[dict[str, float]]:
        """Sample until ``finished``; the last entry is the sample that finished."""
        samples = [self.sample(**inputs)]
        while samples[-1]["finished"] < 0.5:
            samples.append(self.sample())
            assert len(samples) < 100_000
        return samples
