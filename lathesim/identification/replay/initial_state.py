"""Where the states of a machine part start, as the recorded motion shows it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lathesim.component import Parameter, State
from lathesim.engine.assembly import FloatArray, Part
from lathesim.identification.signal import SLOPE_ROUNDING

_SPREAD = 0.01
"""How far the smoothed recording may be off at its first sample, as a share of the motion's standard deviation (its end effect)."""


def start_from(part: Part, state: str, motion: Mapping[str, FloatArray]) -> tuple[float, float] | None:
    """Return the recorded start of a state, and how sure it is; none where no recorded output of the part (``part.output`` -> values)
    tells.

    An output shows a state as it is (``position`` showing ``travel``), or in proportion, output = a + b state: the speed of a table that of
    its motor.
    """
    component = part.component
    unit = component.declarations[state].unit
    shown = [component.ports[role] for role in ("displacement", "flow") if role in component.ports]
    for output in (name for name in shown if component.declarations[name].unit == unit):
        values = motion.get(f"{part.name}.{output}")
        if values is not None:
            return float(values[0]), _SPREAD * float(np.std(values)) + 1e-12
    for output in shown:
        values, line = motion.get(f"{part.name}.{output}"), line_of(part, output, state)
        if values is not None and line is not None:
            constant, slope = line
            return (float(values[0]) - constant) / slope, _SPREAD * float(np.std(values)) / abs(slope) + 1e-12
    return None


def line_of(part: Part, output: str, state: str) -> tuple[float, float] | None:
    """Return a and b of an output that is a + b times a state and nothing else that moves; none of any other one."""
    component = part.component
    parameters, states = component.declared(Parameter), component.declared(State)
    taken = component.taken_for(output)
    if state not in taken or any(name not in parameters and name not in states for name in taken):
        return None
    given = {name: item.default for name, item in parameters.items()} | dict(part.parameters)

    def output_at(value: float, others: float) -> float:
        return component.value_of(output, given | dict.fromkeys(states, others) | {state: value})

    at = [output_at(value, 0.0) for value in (0.0, 1.0, 2.0)]
    slope = at[1] - at[0]
    straight = abs(at[2] - at[1] - slope) <= SLOPE_ROUNDING * abs(slope) and output_at(1.0, 1.0) == at[1]
    return (at[0], slope) if slope and straight else None
