"""One case, from its number to a folder: recordings, lesson and the sealed truth."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from tests.diagnosis.suite import lessons
from tests.diagnosis.suite.axis_case import make_axis_case
from tests.diagnosis.suite.cutting_case import make_cutting_case
from tests.diagnosis.suite.faults import spoil
from tests.diagnosis.suite.recorded import MadeCase
from tests.diagnosis.suite.schedule import DRAWS, Entry, schedule
from tests.diagnosis.suite.spindle_case import make_spindle_case

MAKERS = {"axis": make_axis_case, "spindle": make_spindle_case, "cutting": make_cutting_case}
KINDS = {"control": "sound", "parameters": "values"}
"""Categories of the schedule that are called otherwise where answers are scored."""
SEEN_FROM = 3.0
"""Floors from which on an effect has to be found."""
CLEAR_DRAWS = 6
"""Drawings among which the first that is clearly seen is kept (the last one if none is: small effects belong to the suite too)."""


def write_case(seed: int, index: int, folder: Path) -> dict[str, Any]:
    """Make case ``index`` of the suite of ``seed`` in ``folder`` and give its truth; the same numbers always make the same files."""
    entry = schedule(seed)[index]
    folder.mkdir(parents=True, exist_ok=True)
    made = _clear(entry, seed, index)
    told: dict[str, Any] = {}
    for name, recording in made.recordings.items():
        if entry.fault and name in ("fit", "validate"):
            recording, told = spoil(np.random.default_rng([seed, index, 77]), entry.rig, entry.fault, recording)
        recording.write(folder / f"{name}.csv")
    (folder / "lesson.yaml").write_text(lessons.lesson_text(made.told), encoding="utf-8")
    truth = _truth(entry, seed, index, made, told)
    (folder / "truth.json").write_text(json.dumps(truth, indent=1), encoding="utf-8")
    return truth


def _clear(entry: Entry, seed: int, index: int) -> MadeCase:
    maker = MAKERS[entry.rig]
    draws = [DRAWS[key] for key in entry.keys]
    for attempt in range(CLEAR_DRAWS):
        made = maker(np.random.default_rng([seed, index, attempt]), draws, entry.category, entry.poor)
        sizes = [per_recording["resolve" if entry.poor else "fit"].largest for per_recording in made.sizes.values()]
        # one case in ten keeps its first drawing, however small
        if not sizes or min(sizes) >= SEEN_FROM or index % 10 == 3:
            return made
    return made


def _truth(entry: Entry, seed: int, index: int, made: MadeCase, fault: dict[str, Any]) -> dict[str, Any]:
    told, places, outputs = made.told, lessons.PLACES[made.told.template], lessons.outputs(made.told.template)
    names = {one.key: lessons.NAMES.get(one.key) for one in made.hidden}
    effects = [
        {
            "key": one.key, "effect": names[one.key].effect if names[one.key] else "", "note": one.note,
            "size": {name: sizes.largest for name, sizes in made.sizes[one.key].items()},
            "parameters": {name: {"value": value, "unit": unit} for name, (value, unit) in one.parameters.items()},
        }
        for one in made.hidden
    ]  # fmt: skip
    spoilt = fault.get("channel", "").split("|") if fault else []
    return {
        "schema": "concealed-case/2", "case": f"case_{index:03d}", "seed": seed, "index": index, "rig": entry.rig, "column": entry.rig,
        "half": "all", "kind": KINDS.get(entry.category, entry.category), "poor": entry.poor, "fault": entry.fault,
        "words": fault.get("words", ""), "channels": [*spoilt, *(outputs[column] for column in spoilt if column in outputs)],
        "right": {key: list(name.right) if name else [] for key, name in names.items()},
        "beside": [name.mean for name in names.values() if name and name.mean and not told.known_coulomb],
        "data": next((name.at for key, name in names.items() if name and key in lessons.THE_DATA and len(names) == 1), ""),
        "answerable": all(one["size"]["fit"] >= SEEN_FROM for one in effects), "effects": effects, "recordings": list(made.recordings),
        "baseline": {places[k][0]: {"true": v, "given": told.given[k], "sigma": told.sigma[k]} for k, v in made.true_values.items()},
    }  # fmt: skip
