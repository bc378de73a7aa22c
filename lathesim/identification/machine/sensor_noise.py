"""Noise before the sensors of a machine, where it is part of the loops that they close."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter
from lathesim.engine.assembly import Assembly, Part, Wire

Placed = TypeVar("Placed", bound=Assembly)


class SensorNoise(Component):
    """Noise before a sensor, new in each sample and held until the next:  out = in + size n_k."""

    incoming = Input("{signal}", doc="what is measured")
    outgoing = Output("{signal}", doc="what the sensor sees")
    size = Parameter("{signal}", 0.0, low=0.0, doc="one standard deviation of the noise")
    number = Noise(doc="standard normal number of the sample")
    noise = DiscreteState("{signal}", doc="noise of this sample")

    @staticmethod
    def update(number: float, size: float) -> float:
        return size * number

    @staticmethod
    def output(incoming: float, noise: float) -> float:
        return incoming + noise


def with_sensor_noise(assembly: Placed, sizes: Mapping[str, float]) -> Placed:
    """Return the assembly with noise before each sensor of ``sizes``, one standard deviation [unit of what it measures]."""
    parts, wires = list(assembly.parts), {wire.target: wire for wire in assembly.wires}
    by_name = {part.name: part for part in parts}
    for sensor, size in sizes.items():
        part = by_name[sensor]
        target = f"{sensor}.{part.component.ports['measured']}"
        unit = part.component.declarations[part.component.ports["measured"]].unit
        name = f"{sensor}_noise"
        parts.append(Part(name, SensorNoise.with_units({"signal": unit}), {"size": size}))
        wires[f"{name}.incoming"] = replace(wires[target], target=f"{name}.incoming")
        wires[target] = Wire(target, f"{name}.outgoing")
    return replace(assembly, parts=tuple(parts), wires=tuple(wires.values()))
