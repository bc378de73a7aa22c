"""What a diagnosis would say after the run: tried beforehand, on a recording that each rival would make."""

from __future__ import annotations

import dataclasses
import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from lathesim.component import Component, DiscreteState, Input, Noise, Output, Parameter
from lathesim.diagnosis.diagnose import diagnose
from lathesim.diagnosis.question import Question
from lathesim.engine.assembly import Assembly, FloatArray, Part, Wire
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import wire
from lathesim.errors import LatheSimError
from lathesim.experiments.candidate_programs import Laid
from lathesim.experiments.experiment import Designed, with_program
from lathesim.experiments.rivals import NOTHING
from lathesim.experiments.scene import Scene
from lathesim.identification.execution.budget import Deadline
from lathesim.identification.replay.loading import load_case
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.plugins import Registry
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


@dataclass(frozen=True)
class Foretold:
    """What a diagnosis says of a recording that one rival would make: verdict, effects named, and whether that is right."""

    rival: str
    verdict: str
    named: tuple[str, ...]
    right: bool


def tried_design(
    found: Designed, write: Callable[[Designed], Path], registry: Registry, seed: int, say: Callable[[str], None], longest: float = 40.0
) -> tuple[Designed, list[Foretold]]:
    """Return the design whose program did best when the diagnosis was tried on it, and what was said.

    The best program is tried first. Where a rival is not named rightly, the next best one is, while the time [s] lasts. ``write`` writes
    program and lesson of a design and returns the place of the lesson.
    """
    began = clock.perf_counter()
    best, said = found, foretell(found.scene, found.program, write(found), registry, seed, say, longest)
    for program, worth in found.others:
        if all(item.right for item in said) or clock.perf_counter() - began > longest:
            break
        say("The diagnosis would err; trying the next best program ...")
        other = with_program(found, program, worth)
        told = foretell(other.scene, program, write(other), registry, seed, say, longest)
        if sum(item.right for item in told) > sum(item.right for item in said):
            best, said = other, told
    write(best)
    return best, said


def foretell(
    scene: Scene, program: Laid, lesson_file: Path, registry: Registry, seed: int, say: Callable[[str], None], longest: float
) -> list[Foretold]:
    """Return for each rival what a diagnosis with the rivals' effects says of its simulated recording.

    Sizes are the middle of those drawn; the machine's uncertain values are drawn within half of what the lesson says of them.
    """
    found = []
    lesson = load_lesson(lesson_file)
    effects = [registry.effect(name) for name in dict.fromkeys(rival.effect for rival in scene.rivals if rival.term is not None)]
    random = np.random.default_rng(seed)
    assembly = scene.plan.assembly
    feeding = {item.target: item.source for item in assembly.wires}
    driven = tuple(feeding[name] for name in (lesson.settings.recordings.drive if lesson.settings.recordings else ()))
    channels = tuple(dict.fromkeys((*scene.channels, *driven)))
    for rival in scene.rivals:
        say(f"  what would be said if it were {rival.name} ...")
        row = scene.values(rival, rival.sizes[len(rival.sizes) // 2])
        row[: len(scene.uncertain)] += 0.5 * scene.deviation * random.standard_normal(len(scene.uncertain))
        overrides = dict(zip(scene.names, row, strict=True))
        samples = max(120, int(np.ceil(program.seconds / scene.period)))
        times, values = recorded_rows(assembly, channels, overrides, {scene.path_name: program.table}, samples, seed)
        with TemporaryDirectory() as folder:
            place = Path(folder) / "recording.csv"
            write_recording(lesson, assembly, place, (channels, times, values))
            try:
                case = load_case(lesson, [place], registry)
                question = Question(lesson.title, case.machine, case.recordings[0], None, tuple(effects))  # type: ignore[arg-type]
                told = diagnose(replace(question, method=replace(question.method, ends=Deadline.after(longest))))
            except LatheSimError as error:
                found.append(Foretold(rival.name, f"none: {error.fact}", (), False))
                continue
        named = tuple(f"{item.effect}@{item.at}" for item in told.effects) if told.verdict in ("named", "tied") else ()
        if rival.name == NOTHING:
            right = told.verdict in ("no_mismatch", "parameters_only")
        else:
            right = told.verdict == "named" and [name.partition("@")[0] for name in named] == [rival.effect]
        found.append(Foretold(rival.name, told.verdict, named, right))
    return found
