"""A designed experiment written down: program, lesson, prediction, picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.engine.assembly import Place
from lathesim.experiments.experiment import Designed
from lathesim.experiments.prediction import Foretold
from lathesim.experiments.rivals import NEXT_RUN
from lathesim.json_text import written_json
from lathesim.lessons.changed_lesson import changed_lesson
from lathesim.whole_file import make_folder, write_text

SCHEMA = "lathesim-experiment/1"


def program_of(found: Designed) -> str:
    """Return the text of the program, with what it is for on top."""
    names = " or ".join(rival.name for rival in found.scene.rivals)
    title = [f"Tells {names}".replace("@", " at "), f"Made of {found.program.candidate.title}; about {found.program.seconds:.1f} s"]
    return found.scene.lay(found.program.candidate, title).text


def write_program_and_lesson(found: Designed, folder: Path) -> Path:
    """Write program.nc and lesson.yaml, which maps a recording as the lesson does, and return the place of the lesson."""
    make_folder(folder)
    program = folder / "program.nc"
    write_text(program, program_of(found))
    names = ", ".join(rival.name for rival in found.scene.rivals)
    text = f"A run of this program tells apart {names}. Record it, and diagnose it with this lesson.\n"
    further: dict[str, Any] = {
        "variants": {},
        "try": [],
        "goals": [],
        "lesson": found.lesson.title.removesuffix(NEXT_RUN) + NEXT_RUN,
        "text": text,
    }
    if found.scene.room.needs_duration:
        further["duration"] = f"{np.ceil(10.0 * found.program.seconds) / 10.0:.1f} s"
    written = changed_lesson(found.lesson, [], {}, folder, program=program, further=further)
    place = folder / "lesson.yaml"
    write_text(place, written)
    return place


def as_json(found: Designed, foretold: Sequence[Foretold]) -> dict[str, Any]:
    """Return the prediction for programs, everything in SI."""
    chance = _chance(found, foretold)
    return {
        "schema": SCHEMA,
        "lesson": found.lesson.name,
        "program": "program.nc",
        "seconds": found.program.seconds,
        "decidable": found.decidable,
        "chance_to_decide": chance,
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
        "tried": len(found.tried),
        "runs": found.runs,
        "wall_time_s": found.wall_time,
        "stopped": found.stopped,
    }


def _rival_chance(found: Designed, foretold: Sequence[Foretold], number: int) -> float:
    """Return the chance for one rival: as :func:`_chance`."""
    own = [item for item in foretold if item.rival == found.scene.rivals[number].name]
    return 0.5 * found.worth.by_rival[number] + 0.5 * own[0].right if own else found.worth.by_rival[number]


def _chance(found: Designed, foretold: Sequence[Foretold]) -> float:
    """Return the chance to decide: the expected one, and what was seen on the simulated recordings, each counting as one half."""
    if not foretold:
        return found.worth.chance
    seen = sum(item.right for item in foretold) / len(foretold)
    return 0.5 * found.worth.chance + 0.5 * seen


def undecidable_sentence(found: Designed) -> str:
    """Return why no motion inside the limits tells the closest pair, and what would."""
    first, second, far = min(found.pairs, key=lambda pair: pair[2])
    place = next(number for number, pair in enumerate(found.pairs) if pair[:2] == (first, second))
    best = found.scene.channels[int(np.argmax(found.by_channel[place]))]
    fact = f"No program of at most {max(seconds for _, seconds, _ in found.tried):.0f} s inside the limits tells {first} from {second}"
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
    if found.stopped:
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
    names = [found.scene.channels[place] for place in order if found.by_channel[:, place].mean() > 0.05]
    if names:
        yield f"Record {', '.join(names)} at {1.0 / found.scene.period:.0f} Hz: there they differ."
    yield f"{len(found.tried)} programs, {found.runs} runs, {found.wall_time:.1f} s."
    yield f"Run {folder / 'program.nc'}, then: lathesim diagnose {folder / 'lesson.yaml'} RECORDING"


def write_experiment(found: Designed, foretold: Sequence[Foretold], folder: Path) -> dict[str, Path]:
    """Write prediction.json and the picture beside program and lesson."""
    from lathesim.analysis.experiment_figures import experiment_figure
    from lathesim.analysis.plots import save_figure

    places = {"prediction": folder / "prediction.json", "picture": folder / "experiment.png"}
    write_text(places["prediction"], written_json(as_json(found, foretold)))
    units = [found.scene.plan.unit(name) for name in found.scene.channels]
    names = [rival.name for rival in found.scene.rivals]
    chosen = (found.program.seconds, found.worth.chance)
    figure = experiment_figure(
        found.lesson.title, names, list(found.scene.channels), units, found.traces, found.program.seconds, found.floors, list(found.tried),
        chosen,
    )  # fmt: skip
    save_figure(figure, places["picture"])
    return places
