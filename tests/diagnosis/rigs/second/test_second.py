"""The rigs of the second set are sound machines in each of their descriptions, and hide what their channels show."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.effects.register import stock_effects
from lathesim.identification.replay.experiment import build_experiments
from lathesim.identification.replay.loading import read_for
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry
from tests.diagnosis.rigs.describe import Given
from tests.diagnosis.rigs.faults import write_table
from tests.diagnosis.rigs.scoring import Answer, marks, table
from tests.diagnosis.rigs.second.cases import COUNTS, VISIBLE, draw, record, schedule, shown, write_case
from tests.diagnosis.rigs.second.describe import PARTS, files, lesson
from tests.diagnosis.rigs.second.hidden import BESIDE, KNOWN, NEW, hide, possible, right_names
from tests.diagnosis.rigs.second.machines import RIGS
from tests.diagnosis.rigs.second.rig import Rig

BY_NAME = {rig.name: rig for rig in RIGS}


def simulated(rig: Rig, description: str, table: dict[str, np.ndarray], folder: Path) -> dict[str, np.ndarray]:
    """Return what a lesson that has the true values makes of the set-points of a recording: column -> values."""
    write_table(folder / "fit.csv", table)
    for name, text in files(rig, description).items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "lesson.yaml").write_text(lesson(rig, description, Given(), Given()), encoding="utf-8")
    registry = load_registry()
    registry.add_folder(PARTS)
    machine, recorded = read_for(prepare(load_lesson(folder / "lesson.yaml"), registry), folder / "fit.csv", registry)
    (experiment,) = build_experiments(machine, [("fit.csv", recorded.record)], ())
    run = experiment.own.outputs([], np.zeros((1, 0)))[0]
    columns = [name for name in ("u", "q", "i", "s", "u_2", "q_2", "i_2") if name in table][: len(machine.compare)]
    return dict(zip(columns, run, strict=True))


QUICK = ("belt_gear_500",)
"""The rig that every run of the tests simulates; the others take more than a minute together."""


@pytest.mark.parametrize("name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in BY_NAME])
def test_each_description_simulates_a_sound_recording_to_within_its_noise(name: str, tmp_path: Path) -> None:
    """A simulation is no further from a recording than another recording with other noise."""
    rig = replace(BY_NAME[name], seconds=3.0)
    rng = np.random.default_rng(7)
    drawn, other = draw(rig, rng), draw(rig, rng)
    here, again = (record(rig, rig.physics, one) for one in (drawn, replace(other, asked=drawn.asked, cut=drawn.cut)))
    for description in rig.descriptions:
        folder = tmp_path / description
        folder.mkdir()
        for column, values in simulated(rig, description, here, folder).items():
            noise, apart = (float(np.sqrt(np.mean((one - here[column]) ** 2))) for one in (again[column], values))
            assert apart < 1.1 * noise < 0.2 * float(np.std(here[column])), (description, column)


def test_half_of_the_rigs_are_held_out() -> None:
    assert sum(rig.calibrating for rig in RIGS) == len(RIGS) / 2 == 5
    assert len(BY_NAME) == len(RIGS)


def test_a_seed_fixes_the_cases() -> None:
    first, again, other = schedule(1), schedule(1), schedule(2)
    assert first == again
    assert [case.seed for case in first] != [case.seed for case in other]
    assert len({case.name for case in first}) == len(first) == len(RIGS) * sum(COUNTS.values())


def test_every_name_that_is_right_is_an_effect_of_the_program() -> None:
    known = set(stock_effects())
    assert {name for names in (KNOWN | NEW | BESIDE).values() for name in names} <= known


@pytest.mark.parametrize("name", ["coarse_200", "spindle_speed_500"])
def test_hidden_effects_show_in_what_is_recorded(name: str) -> None:
    rig = replace(BY_NAME[name], seconds=6.0)
    rng = np.random.default_rng(3)
    drawn, other = draw(rig, rng), draw(rig, rng)
    for key in possible(rig):
        ratio = shown(rig, hide(rig, (key,), rng), (key,), drawn, other)[key]
        assert ratio > VISIBLE, key


def test_without_a_current_an_offset_of_the_converter_is_a_force() -> None:
    assert right_names(BY_NAME["coarse_200"], "gravity") == ["ForceOffset", "ConverterOffset"]
    assert right_names(BY_NAME["worm_table_1k"], "gravity") == ["ForceOffset"]


def test_a_case_brings_its_controller_and_its_truth(tmp_path: Path) -> None:
    case = next(case for case in schedule(1, {"pair": 1}) if case.rig.name == "worm_table_1k")
    folders = write_case(case, tmp_path)
    assert [folder.name.rpartition("__")[2] for folder in folders] == ["table", "motor"]
    for folder in folders:
        assert (folder / "parts" / "angle_controller.py").is_file()
        truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        assert set(truth["visible"]) == set(case.keys) == set(truth["right"])


def test_what_no_channel_shows_is_not_asked() -> None:
    truth = {"kind": "sound", "rig": "a", "description": "table", "calibrating": True, "answerable": False}
    assert marks(Answer(truth, {"verdict": "unknown"}, 1.0)) == {}


def test_a_case_is_right_when_it_is_right_in_every_description() -> None:
    truth = {"kind": "sound", "rig": "a", "calibrating": True, "case": "a__sound_00"}
    told = {"table": {"verdict": "no_mismatch"}, "motor": {"verdict": "unknown"}}
    answers = [Answer(truth | {"description": side}, one, 1.0) for side, one in told.items()]
    rows = table(answers).splitlines()
    assert "| sound called sound | 1/1 (21 to 100 %) | 0/1 (0 to 79 %) |" in rows
    assert "| sound called sound | 0/1 (0 to 79 %) | - |" in rows
