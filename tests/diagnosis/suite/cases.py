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
    effects = []
    for one in made.hidden:
        name = lessons.NAMES.get(one.key)
        sizes = {rec: {"plain": s.plain, "refitted": s.refitted, "largest": s.largest} for rec, s in made.sizes[one.key].items()}
        effects.append(
            {
                "key": one.key, "catalogue": name.catalogue if name else 0, "effect": name.effect if name else "", "note": one.note,
                "families": list(lessons.families(one.key)) if name else [], "at": name.at if name else "",
                "right": list(name.right) if name else [], "data": one.key in lessons.THE_DATA,
                "mean": name.mean if name and not made.told.known_coulomb else "",
                "tied": list(lessons.indistinguishable(one.key, made.told.channels)), "size": sizes,
                "seen": max((s.largest for s in made.sizes[one.key].values()), default=0.0) >= SEEN_FROM,
                "parameters": {k: {"value": v, "unit": u} for k, (v, u) in one.parameters.items()},
            }
        )  # fmt: skip
    told = made.told
    places = lessons.PLACES[told.template]
    outputs = lessons.outputs(made.told.template)
    if fault:
        fault = {**fault, "outputs": [outputs[column] for column in fault["channel"].split("|") if column in outputs]}
    return {
        "schema": "concealed-case/1", "seed": seed, "index": index, "rig": entry.rig, "category": entry.category, "poor": entry.poor,
        "fault": {"kind": entry.fault, **fault} if entry.fault else None, "channels": list(made.told.channels),
        "recordings": list(made.recordings),
        "outputs": {channel: outputs[channel] for channel in made.told.channels}, "effects": effects,
        "floors": made.floors, "removable": made.removable,
        "baseline": {places[k][0]: {"true": v, "given": told.given[k], "sigma": told.sigma[k]} for k, v in made.true_values.items()},
    }  # fmt: skip
