"""Rounds of design, run and diagnosis, until the rivals are told apart or a further round is worth less than its seconds."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lathesim.diagnosis.diagnose import diagnose
from lathesim.diagnosis.question import Question
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.engine.wiring import wire
from lathesim.experiments.design.experiment import Designed, Wish, design_experiment
from lathesim.experiments.design.experiment_files import write_program_and_lesson
from lathesim.experiments.design.rivals import NOTHING, Named
from lathesim.experiments.design.simulated_recording import recorded_rows, write_recording
from lathesim.experiments.evidence import Other, diagnose_together
from lathesim.identification.replay.loading import LoadedCase, load_case
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import Registry

Say = Callable[[str], None]
RECORDING = "recording.csv"


@dataclass(frozen=True)
class Round:
    """One round: its folder, how long its program lasts [s], the verdict of all recordings so far, and what was named."""

    folder: Path
    seconds: float
    verdict: str
    named: tuple[str, ...]


@dataclass(frozen=True)
class RunRounds:
    """All rounds, and why no further one was run."""

    rounds: tuple[Round, ...]
    ended: str

    @property
    def seconds(self) -> float:
        """How long all programs last together [s]."""
        return sum(item.seconds for item in self.rounds)


def run_rounds(
    lesson: Lesson, machine: Lesson, named: Sequence[Named], registry: Registry, wish: Wish, most: int, folder: Path, place: str, say: Say,
    stop: threading.Event | None = None,
) -> RunRounds:  # fmt: skip
    """Return the rounds of a sequence; ``machine`` is the lesson that plays the real machine, with noise before its sensors.

    Each round designs with another seed, runs the program on the machine, and diagnoses the new recording together with those before.
    """
    done: list[Round] = []
    for number in range(1, most + 1):
        found = design_experiment(lesson, named, registry, replace(wish, seed=wish.seed + number - 1), None, place, say, stop)
        if found.stopped:
            return RunRounds(tuple(done), "Stopped.")
        if not found.decidable:
            return RunRounds(tuple(done), "No program inside the limits tells these rivals apart.")
        if done and found.worth.score <= 0.0:
            return RunRounds(tuple(done), "A further round is worth less than its seconds.")
        own = folder / f"round_{number}"
        file = write_program_and_lesson(found, own)
        _record(machine, own, found, registry, wish.seed + number)
        say(f"Round {number}: {found.program.seconds:.1f} s run; diagnosing ...")
        before = [Other(str(item.folder / "lesson.yaml"), item.folder / RECORDING) for item in done]
        told = _diagnose(file, own / RECORDING, before, found, registry)
        names = tuple(f"{effect.effect}@{effect.at}" for effect in told.effects)
        done.append(Round(own, found.program.seconds, told.verdict, names))
        say(f"Round {number}: {told.verdict} {', '.join(names)}".strip())
        nothing = told.verdict in ("no_mismatch", "parameters_only") and any(item.effect == NOTHING for item in named)
        if told.verdict == "named" or nothing:
            return RunRounds(tuple(done), "Decided.")
    return RunRounds(tuple(done), f"Not decided after {most} rounds.")


def _record(machine: Lesson, folder: Path, found: Designed, registry: Registry, seed: int) -> None:
    """Run a program on the lesson that plays the machine, and write what would have been recorded."""
    prepared = prepare(machine, registry, program=folder / "program.nc")
    mapped = machine.settings.recordings or found.lesson.settings.recordings
    assembly = prepared.machinery
    feeding = {item.target: item.source for item in assembly.wires}
    driven = tuple(feeding[name] for name in (mapped.drive if mapped else ()))
    channels = tuple(dict.fromkeys((*found.scene.channels, *driven)))
    samples = max(120, math.ceil(found.program.seconds / wire(assembly).assembly.sample_period))
    times, values = recorded_rows(assembly, channels, {}, {}, samples, seed)
    write_recording(found.lesson, assembly, folder / RECORDING, (channels, times, values))


def _diagnose(file: Path, recording: Path, others: Sequence[Other], found: Designed, registry: Registry) -> Diagnosis:
    lesson = load_lesson(file)
    effects = [registry.effect(name) for name in dict.fromkeys(rival.effect for rival in found.scene.rivals if rival.term is not None)]
    case = load_case(lesson, [recording], registry)

    def ask(loaded: LoadedCase) -> Question:
        return Question(lesson.title, loaded.machine, loaded.recordings[0], None, tuple(effects))  # type: ignore[arg-type]

    if others:
        return diagnose_together(case, others, registry, ask, lambda text: None)
    return diagnose(ask(case))
