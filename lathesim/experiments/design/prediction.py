"""What a diagnosis would say after the run: tried beforehand, on a recording that each rival would make."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from lathesim.diagnosis.diagnose import diagnose
from lathesim.diagnosis.question import Question
from lathesim.errors import LatheSimError
from lathesim.experiments.design.experiment import Designed, with_program
from lathesim.experiments.design.laying import Laid
from lathesim.experiments.design.rivals import NOTHING
from lathesim.experiments.design.scene import Scene
from lathesim.experiments.design.simulated_recording import recorded_rows, write_recording
from lathesim.identification.execution.budget import Deadline
from lathesim.identification.replay.loading import load_case
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import Registry


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
