"""A recording that a rival would make of a program: the machine with it, noise before its sensors, written as the lesson's file is."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter
from lathesim.engine.assembly import Assembly, FloatArray, Part, Wire
from lathesim.engine.running.batch import Batch
from lathesim.engine.wiring import wire
from lathesim.lessons.lesson import Lesson
from lathesim.units import conversion
from lathesim.whole_file import whole_file


class ReadingNoise(Component):
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


def with_noise(assembly: Assembly) -> Assembly:
    """Return the machine with noise of one count before each sensor that counts."""
    parts, wires = list(assembly.parts), list(assembly.wires)
    for part in assembly.parts:
        ports = part.component.ports
        if "measured" not in ports or "resolution" not in ports:
            continue
        target, name = f"{part.name}.{ports['measured']}", ports["resolution"]
        declared = part.component.declarations[name]
        size = float(part.parameters.get(name, getattr(declared, "default", 0.0)))
        source = next((item for item in wires if item.target == target and item.source), None)
        if source is None or size <= 0.0:
            continue
        unit = part.component.declarations[ports["measured"]].unit
        before = f"noise_before_{part.name}"
        parts.append(Part(before, ReadingNoise.with_units({"signal": unit}), {"size": size}))
        wires[wires.index(source)] = Wire(target, f"{before}.outgoing")
        wires.append(Wire(f"{before}.incoming", source.source))
    return dataclasses.replace(assembly, parts=tuple(parts), wires=tuple(wires))


def recorded_rows(
    assembly: Assembly, channels: tuple[str, ...], overrides: Mapping[str, float], table: Mapping[str, FloatArray], samples: int, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return times (samples,) [s] and values (channels, samples) [SI] of one noisy run."""
    machine = dataclasses.replace(with_noise(assembly), finish="", record=channels)
    plan = wire(machine)
    batch = Batch(plan, samples, seed=seed, threads=1)
    values = batch.run(list(overrides), np.array([list(overrides.values())]), np.copy, {name: [rows] for name, rows in table.items()})[0]
    return np.arange(samples, dtype=np.float64) * np.float64(machine.sample_period), np.asarray(values)


def write_recording(lesson: Lesson, assembly: Assembly, place: Path, run: tuple[tuple[str, ...], FloatArray, FloatArray]) -> None:
    """Write a run (channels, times, values) as the CSV file that the lesson's ``recordings:`` describes.

    A driven input is written from the output that feeds it.
    """
    settings = lesson.settings.recordings
    assert settings is not None
    channels, times, values = run
    by_name = dict(zip(channels, values, strict=True))
    units = {f"{part.name}.{name}": item.unit for part in assembly.parts for name, item in part.component.declarations.items()}
    columns: dict[str, FloatArray] = {}
    if settings.time.column is not None:
        columns[settings.time.column] = times / conversion(settings.time.unit, "s")
    feeding = {item.target: item.source for item in assembly.wires}
    for target, entry in settings.drive.items():
        columns[entry.column] = by_name[feeding[target]] / (entry.scale * conversion(entry.unit, units[target]))
    for target, signal in settings.compare.items():
        columns[signal.column] = by_name[target] / (signal.scale * conversion(signal.unit, units[target]))
    table = np.column_stack(list(columns.values()))
    with whole_file(place) as part:
        np.savetxt(part, table, delimiter=",", header=",".join(columns), comments="", fmt="%.10g")
