"""A designed experiment written down: program, lesson, prediction, picture.

What a diagnosis would say after the run: tried beforehand, on a recording that each rival would make.
"""

from __future__ import annotations

import dataclasses
import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from lathesim.diagnosis.diagnose import diagnose
from lathesim.diagnosis.preparation import Question
from lathesim.engine.assembly import Assembly, FloatArray, Place
from lathesim.engine.batch import Batch
from lathesim.engine.wiring import wire
from lathesim.errors import LatheSimError
from lathesim.experiments.candidate_programs import Laid
from lathesim.experiments.design_experiment import Designed, with_program, write_design
from lathesim.experiments.rivals import NEXT_RUN, NOTHING
from lathesim.experiments.scene import Scene
from lathesim.identification.execution import Deadline
from lathesim.identification.replay.loading import load_case
from lathesim.json_text import written_json
from lathesim.lessons.lesson import Lesson, load_lesson
from lathesim.lessons.sensor_sides import with_sensor_noise
from lathesim.plugins import Registry
from lathesim.units import conversion
from lathesim.whole_file import whole_file, write_text

_TELLS = 0.05
"""Share of what a program tells from which on a channel is named."""


def with_noise(assembly: Assembly) -> Assembly:
    """Return the machine with noise of one count before each sensor that counts."""
    sizes = {}
    for part in assembly.parts:
        ports = part.component.ports
        if {"measured", "resolution"} <= set(ports) and assembly.sources.get(f"{part.name}.{ports['measured']}"):
            sizes[part.name] = part.value(ports["resolution"])
    return with_sensor_noise(assembly, {name: size for name, size in sizes.items() if size > 0.0}, "noise_before_{}")


def record_run(
    lesson: Lesson,
    assembly: Assembly,
    seconds: float,
    place: Path,
    seed: int,
    overrides: Mapping[str, float],
    table: Mapping[str, FloatArray],
) -> None:
    """Run a machine with noise, and write what is recorded of it as the CSV file that the lesson's ``recordings:`` describes.

    A driven input is written from the output that feeds it.
    """
    settings = lesson.settings.recordings
    assert settings is not None
    sources = {target: assembly.sources[target] for target in settings.drive} | {target: target for target in settings.compare}
    channels = tuple(dict.fromkeys(sources.values()))
    samples = max(120, int(np.ceil(seconds / assembly.sample_period)))
    batch = Batch(wire(dataclasses.replace(with_noise(assembly), finish="", record=channels)), samples, seed=seed, threads=1)
    values = batch.run(list(overrides), np.array([list(overrides.values())]), np.copy, {name: [rows] for name, rows in table.items()})[0]
    by_name = dict(zip(channels, np.asarray(values), strict=True))
    columns: dict[str, FloatArray] = {}
    if settings.time.column is not None:
        times = np.arange(samples, dtype=np.float64) * np.float64(assembly.sample_period)
        columns[settings.time.column] = times / conversion(settings.time.unit, "s")
    for target, signal in {**settings.drive, **settings.compare}.items():
        columns[signal.column] = by_name[sources[target]] / (signal.scale * conversion(signal.unit, assembly.declared(target).unit))
    rows = np.column_stack(list(columns.values()))
    with whole_file(place) as part:
        np.savetxt(part, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.10g")


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
    for rival in scene.rivals:
        say(f"  what would be said if it were {rival.name} ...")
        row = scene.values(rival, rival.sizes[len(rival.sizes) // 2])
        row[: len(scene.uncertain)] += 0.5 * scene.deviation * random.standard_normal(len(scene.uncertain))
        overrides = dict(zip(scene.names, row, strict=True))
        with TemporaryDirectory() as folder:
            place = Path(folder) / "recording.csv"
            record_run(lesson, scene.plan.assembly, program.seconds, place, seed, overrides, {scene.path_name: program.table})
            try:
                case = load_case(lesson, [place], registry)
                question = Question(lesson.title, case.machine, case.recordings[0], None, tuple(effects))  # type: ignore[arg-type]
                told = diagnose(replace(question, ends=Deadline.after(longest)))
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


SCHEMA = "lathesim-experiment/1"


def program_of(found: Designed) -> str:
    """Return the text of the program, with what it is for on top."""
    names = " or ".join(rival.name for rival in found.scene.rivals)
    title = [f"Tells {names}".replace("@", " at "), f"Made of {found.program.candidate.title}; about {found.program.seconds:.1f} s"]
    return found.scene.lay(found.program.candidate, title).text


def write_program_and_lesson(found: Designed, folder: Path) -> Path:
    """Write program.nc and lesson.yaml, which maps a recording as the lesson does, and return the place of the lesson."""
    names = ", ".join(rival.name for rival in found.scene.rivals)
    text = f"A run of this program tells apart {names}. Record it, and diagnose it with this lesson.\n"
    further = {"lesson": found.lesson.title.removesuffix(NEXT_RUN) + NEXT_RUN, "text": text}
    return write_design(found.lesson, found.scene.room, found.program.seconds, program_of(found), folder, further)


def as_json(found: Designed, foretold: Sequence[Foretold]) -> dict[str, Any]:
    """Return the prediction for programs, everything in SI."""
    return {
        "schema": SCHEMA,
        "lesson": found.lesson.name,
        "program": "program.nc",
        "seconds": found.program.seconds,
        "decidable": found.decidable,
        "chance_to_decide": _chance(found, foretold),
        "rivals": [
            {
                "rival": rival.name,
                "chance_to_decide": _rival_chance(found, foretold, number),
                "apart": np.median(np.delete(found.worth.apart[number], number, axis=0).min(axis=0)),
                "explains": np.median(found.worth.explained[number]),
                "verdict": next((item.verdict for item in foretold if item.rival == rival.name), None),
                "named": next((item.named for item in foretold if item.rival == rival.name), ()),
            }
            for number, rival in enumerate(found.scene.rivals)
        ],
        "pairs": [
            {"rivals": [first, second], "apart": far, "chance_to_tell": found.worth.decided_pair(*places)}
            for (first, second, far), places in zip(found.pairs, combinations(range(len(found.scene.rivals)), 2), strict=True)
        ],
        "record": [
            {"channel": name, "at_least_hz": 1.0 / found.scene.period, "share": found.by_channel[:, place].mean()}
            for place, name in enumerate(found.scene.channels)
        ],
        "if_nothing_tells": None if found.decidable else undecidable_sentence(found),
        "tried": len(found.search.tried),
        "runs": found.search.runs,
        "wall_time_s": found.search.wall_time,
        "stopped": found.search.stopped,
    }


def _rival_chance(found: Designed, foretold: Sequence[Foretold], number: int) -> float:
    """Return the chance for one rival: as :func:`_chance`."""
    own = [item for item in foretold if item.rival == found.scene.rivals[number].name]
    return 0.5 * found.worth.by_rival[number] + 0.5 * own[0].right if own else found.worth.by_rival[number]


def _chance(found: Designed, foretold: Sequence[Foretold]) -> float:
    """Return the chance to decide: the expected one, and what was seen on the simulated recordings, each counting as one half."""
    if not foretold:
        return found.worth.chance
    return 0.5 * found.worth.chance + 0.5 * (sum(item.right for item in foretold) / len(foretold))


def undecidable_sentence(found: Designed) -> str:
    """Return why no motion inside the limits tells the closest pair, and what would."""
    first, second, far = min(found.pairs, key=lambda pair: pair[2])
    place = next(number for number, pair in enumerate(found.pairs) if pair[:2] == (first, second))
    best = found.scene.channels[int(np.argmax(found.by_channel[place]))]
    fact = (
        f"No program of at most {max(seconds for _, seconds, _ in found.search.tried):.0f} s inside the limits tells {first} from {second}"
    )
    return f"{fact} (T = {far:.3g}). {_what_would(found, first, second, best)}"


def _what_would(found: Designed, first: str, second: str, best: str) -> str:
    effects = [rival.term.effect for rival in found.scene.rivals if rival.name in (first, second) and rival.term is not None]
    sites = {effect.site for effect in effects}
    if "reading" in sites or "measured" in sites:
        return f"A second sensor of the same motion would, behind or before the one of {Place.of(best).part}."
    if any(effect.experiment for effect in effects):
        return f"What would: {' '.join(dict.fromkeys(effect.experiment for effect in effects if effect.experiment))}"
    return f"A finer sensor at {best}, a load, or a longer way would."


def told_lines(found: Designed, foretold: Sequence[Foretold], folder: Path) -> Iterator[str]:
    """Yield the experiment as a person reads it at a terminal."""
    if found.search.stopped:
        yield "Stopped: this is the best program so far."
    if not found.decidable:
        yield undecidable_sentence(found)
    yield f"Program: {found.program.candidate.title}, {found.program.seconds:.1f} s; chance to decide {_chance(found, foretold):.2f}."
    for first, second, far in found.pairs:
        yield f"  {first} and {second}: apart by T = {far:.4g} noise levels squared, each refitted to the other"
    for item in foretold:
        named = f" ({', '.join(item.named)})" if item.named else ""
        yield f"  If it is {item.rival}, the diagnosis says: {item.verdict}{named}."
    order = np.argsort(-found.by_channel.mean(axis=0))
    names = [found.scene.channels[place] for place in order if found.by_channel[:, place].mean() > _TELLS]
    if names:
        yield f"Record {', '.join(names)} at {1.0 / found.scene.period:.0f} Hz: there they differ."
    yield f"{len(found.search.tried)} programs, {found.search.runs} runs, {found.search.wall_time:.1f} s."
    yield f"Run {folder / 'program.nc'}, then: lathesim diagnose {folder / 'lesson.yaml'} RECORDING"


def write_experiment(found: Designed, foretold: Sequence[Foretold], folder: Path) -> dict[str, Path]:
    """Write prediction.json and the picture beside program and lesson."""
    from lathesim.analysis.experiment_figures import experiment_figure
    from lathesim.analysis.plots import save_figure

    places = {"prediction": folder / "prediction.json", "picture": folder / "experiment.png"}
    write_text(places["prediction"], written_json(as_json(found, foretold)))
    channels = list(zip(found.scene.channels, [found.scene.plan.unit(name) for name in found.scene.channels], found.floors, strict=True))
    names = [rival.name for rival in found.scene.rivals]
    chosen = (found.program.seconds, found.worth.chance)
    figure = experiment_figure(found.lesson.title, names, channels, found.traces, found.program.seconds, found.search.tried, chosen)
    save_figure(figure, places["picture"])
    return places
