"""Ties as ``isolable`` predicts them, held against those that were answered: each case from a sound recording of the same rig alone."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lathesim.diagnosis.isolation.apart import rivals_of
from lathesim.diagnosis.isolation.visible import Looking, shapes, smallest_visible
from lathesim.engine.assembly import FloatArray, Place
from lathesim.experiments.isolable import Means, looking_at
from lathesim.identification.records import Candidate
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
from tests.diagnosis.asking import Answer, kept, truth_of
from tests.diagnosis.scoring import effects_of, share

KEPT = "isolable.json"


@dataclass(frozen=True)
class Predicted:
    """What was predicted of an effect, and what was answered: the names of its ties."""

    case: str
    effect: str
    predicted: tuple[str, ...]
    answered: tuple[str, ...]


def compared(folders: Sequence[Path], name: str) -> list[Predicted]:
    """Return for each kept answer that names the one effect which a case hides what is predicted of that effect, and what was answered."""
    sound, found = sound_of(folders), []
    for folder, answer in kept(folders, name).items():
        truth = truth_of(folder)
        named = named_right(truth, answer) if truth["kind"] == "single" and truth.get("answerable", True) else None
        if named is not None and truth["rig"] in sound:
            ties = kept_prediction(folder, sound[truth["rig"]], named)
            found.append(Predicted(folder.name, named["effect"], names_of(ties), names_of(named["tied_with"])))
    return found


def sound_of(folders: Sequence[Path]) -> dict[str, Path]:
    """Return for each rig the folder of its first sound case."""
    found: dict[str, Path] = {}
    for folder in folders:
        if truth_of(folder)["kind"] == "sound":
            found.setdefault(truth_of(folder)["rig"], folder)
    return found


def named_right(truth: dict[str, Any], answer: Answer) -> dict[str, Any] | None:
    """Return the named effect that a case hides, or that is tied with what it hides."""
    right = {name for names in truth["right"].values() for name in names}
    return next((one for one in effects_of(answer.told) if right & {one["effect"], *names_of(one["tied_with"])}), None)


def names_of(ties: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted({tie.partition(" at ")[0] for tie in ties}))


def kept_prediction(folder: Path, sound: Path, named: dict[str, Any]) -> list[str]:
    """Return the ties of an effect of the answered size, predicted from a sound recording; kept beside the answer."""
    file = folder / KEPT
    if not file.is_file():
        file.write_text(json.dumps(predicted_ties(folder, sound / "fit.csv", named)), encoding="utf-8")
    return list(json.loads(file.read_text(encoding="utf-8")))


def with_answer(
    folder: Path, recording: Path, named: dict[str, Any], effects: tuple[str, ...] = ()
) -> tuple[Looking, Candidate, FloatArray]:
    """Return a recording beside the lesson in a folder, and an effect with the values of an answer; of ``effects`` (empty: of all)."""
    parts = folder / "parts"
    registry = load_registry([parts] if parts.is_dir() else [])
    looking, _ = looking_at(load_lesson(str(folder / "lesson.yaml")), registry, Means(recording=recording, effects=effects))
    candidates = looking.study.estimation.candidates
    truth = next(one for one in candidates if one.name == named["effect"] and named["at"] in (one.at, one.seat.before))
    values = [
        named["parameters"].get(Place.of(name).port, {"value": neutral})["value"]
        for name, neutral in zip(truth.parameters, truth.neutral.tolist(), strict=True)
    ]
    return looking, truth, np.array(values)


def predicted_ties(folder: Path, recording: Path, named: dict[str, Any]) -> list[str]:
    """Return what a recording of the lesson in a folder could not tell from an effect with the values of an answer."""
    looking, truth, values = with_answer(folder, recording, named)
    (change,) = looking.changes([(truth, values)])
    assert change is not None
    searched = smallest_visible(looking, shapes(looking.study, looking.study.estimation.candidates))
    others = [one.nearest for one in searched if one.nearest is not None]
    (rivals,) = rivals_of(looking, [change], others)
    return [f"{one.candidate.name} at {one.candidate.place}" for one in rivals if one.is_tied]


def table(found: Sequence[Predicted]) -> list[str]:
    """Return how often a tie was predicted and answered, alike in its names, and the cases that differ."""
    lines = [
        f"Tied or not, as predicted: {share([bool(one.predicted) == bool(one.answered) for one in found])}.",
        f"The same names: {share([one.predicted == one.answered for one in found])}.",
        f"Of the answered ties predicted: {share([bool(one.predicted) for one in found if one.answered])}.",
        f"Of the predicted ties answered: {share([bool(one.answered) for one in found if one.predicted])}.",
    ]
    for one in (one for one in found if one.predicted != one.answered):
        named = [", ".join(names) or "-" for names in (one.predicted, one.answered)]
        lines.append(f"- {one.case} {one.effect}: predicted {named[0]}, answered {named[1]}")
    return lines
