"""The generator of concealed cases: the same machine as the lesson's when nothing is hidden, the same files from the same seed."""

from __future__ import annotations

import dataclasses
import functools
import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from lathesim.component import Parameter
from lathesim.effects.register import stock_effects
from lathesim.identification.replay.experiment import Experiment, Machine, build_experiments
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry
from lathesim.record import Channel, Record
from tests.diagnosis.asking import in_words, truth_of
from tests.diagnosis.stored.answers import stored
from tests.diagnosis.suite import lessons
from tests.diagnosis.suite.axis_case import make_axis_case
from tests.diagnosis.suite.cases import write_case
from tests.diagnosis.suite.cutting_case import make_cutting_case
from tests.diagnosis.suite.limits import near, table
from tests.diagnosis.suite.recorded import MadeCase
from tests.diagnosis.suite.schedule import DRAWS, Entry, schedule
from tests.diagnosis.suite.spindle_case import make_spindle_case

DRAWINGS = (0, 1, 3, 4)
SI = {"mm": 1e-3, "m/min": 1.0 / 60.0}


def rig_of(made: MadeCase, folder: Path) -> Experiment:
    """Return the program's view of a case, with the true values in place of those the lesson gives."""
    path = folder / "lesson.yaml"
    told = dataclasses.replace(made.told, given=made.true_values, known_coulomb=made.true_values.get("coulomb", 0.0))
    path.write_text(lessons.lesson_text(told), encoding="utf-8")
    prepared = prepare(load_lesson(path), load_registry())
    columns = made.recordings["fit"].columns
    driven = lessons.DRIVE[told.template]
    seen = {target: (column, unit) for column, (target, unit) in lessons.COMPARE[told.template].items() if column in told.channels}
    channels = {
        target: Channel(target, unit, columns[column][1] * SI.get(unit, 1.0)) for target, (column, unit) in {**driven, **seen}.items()
    }
    record = Record(columns["time"][1], channels, {"sample_period": 1e-3})
    return build_experiments(Machine(prepared.machinery, tuple(driven), tuple(seen), {}, {}), [("fit", record)], ())[0]


def residuals_in_floors(made: MadeCase, folder: Path) -> dict[str, float]:
    """Return recorded less simulated of each channel, root mean square over the true noise."""
    residual = rig_of(made, folder).own.one({})
    floors = made.floors["fit"]
    return {channel: float(np.sqrt(np.mean(row**2))) / floors[channel] for channel, row in zip(made.told.channels, residual, strict=True)}


@functools.cache
def sound_axis(drawing: int) -> MadeCase:
    """Return an axis with nothing hidden in it."""
    return make_axis_case(np.random.default_rng([19, drawing]), [], "control")


@pytest.mark.parametrize("drawing", [DRAWINGS[1], *(pytest.param(other, marks=pytest.mark.slow) for other in (0, 3, 4))])
def test_axis_of_the_truth_is_that_of_the_lesson(drawing: int, tmp_path: Path) -> None:
    made = sound_axis(drawing)
    assert all(size < 2.0 for size in residuals_in_floors(made, tmp_path).values())


@pytest.mark.slow
def test_those_axes_differ_in_what_matters() -> None:
    made = [sound_axis(drawing) for drawing in DRAWINGS]
    assert {case.told.pid for case in made} == {True, False}
    assert {"current" in case.told.channels for case in made} == {True, False}
    assert {"scale" in case.told.channels for case in made} == {True, False}
    assert {case.told.known_coulomb > 0.0 for case in made} == {True, False}


def test_spindle_of_the_truth_is_that_of_the_lesson(tmp_path: Path) -> None:
    made = make_spindle_case(np.random.default_rng(3), [], "control")
    assert all(size < 1.1 for size in residuals_in_floors(made, tmp_path).values())


def test_cut_of_the_truth_is_that_of_the_lesson(tmp_path: Path) -> None:
    made = make_cutting_case(np.random.default_rng(3), [], "control")
    assert all(size < 1.1 for size in residuals_in_floors(made, tmp_path).values())


@pytest.mark.parametrize(
    "key", ["edge_force", *(pytest.param(key, marks=pytest.mark.slow) for key in ("coulomb", "backlash", "tacho_filter"))]
)
def test_hidden_effect_shows_as_large_as_the_truth_says(key: str, tmp_path: Path) -> None:
    maker = {"edge_force": make_cutting_case, "tacho_filter": make_spindle_case}.get(key, make_axis_case)
    made = maker(np.random.default_rng(3), [DRAWS[key]], "single")
    size = max(made.sizes[key]["fit"].plain[channel] for channel in made.told.channels)
    seen = max(residuals_in_floors(made, tmp_path).values())
    assert size > 3.0
    assert seen == pytest.approx(np.hypot(size, 1.0), rel=0.1)


def test_same_seed_gives_the_same_files(tmp_path: Path) -> None:
    numbers = [index for index, entry in enumerate(schedule(4)) if entry.rig == "cutting" and entry.category in ("single", "fault")][:2]
    for index in numbers:
        write_case(4, index, tmp_path / "once")
        write_case(4, index, tmp_path / "again")
        for name in ("lesson.yaml", "fit.csv", "validate.csv", "truth.json"):
            assert (tmp_path / "once" / name).read_bytes() == (tmp_path / "again" / name).read_bytes()


def test_truth_tells_what_a_score_needs(tmp_path: Path) -> None:
    index = next(index for index, entry in enumerate(schedule(4)) if entry == Entry("cutting", "poor", ("edge_force",), poor="one_setting"))
    write_case(4, index, tmp_path)
    truth = truth_of(tmp_path)
    assert (truth["kind"], truth["column"], truth["right"]) == ("poor", "cutting", {"edge_force": ["EdgeForce"]})
    assert set(truth["effects"][0]["size"]) == {"fit", "resolve"}
    assert set(truth["effects"][0]["parameters"]) == {"coefficient"}
    assert all((tmp_path / f"{name}.csv").is_file() for name in ("fit", "validate", "resolve", "resolve_validate"))


def test_schedule_has_the_shares_that_are_asked_for() -> None:
    entries = schedule(1)
    shares = Counter(entry.category for entry in entries)
    assert len(entries) >= 200
    assert (shares["control"] + shares["parameters"]) / len(entries) == pytest.approx(0.4, abs=0.02)
    assert {entry.rig for entry in entries[:12]} == {"axis", "spindle", "cutting"}


def test_every_name_that_is_right_is_an_effect_of_the_program() -> None:
    assert {name for one in lessons.NAMES.values() for name in (*one.right, *([one.mean] if one.mean else []))} <= set(stock_effects())


def test_parameters_of_hidden_effects_are_those_of_the_program() -> None:
    rig = {"rated": 500.0, "lead": 0.005, "top": 0.1, "acceleration": 2.0, "mass": 60.0, "viscous": 200.0, "bandwidth": 100.0, "known": 0.0,
           "resolution": 1e-7, "stroke": 0.1, "peak": 8.0, "load": 3.0}  # fmt: skip
    for key in sorted(set(DRAWS) & set(lessons.NAMES)):
        hidden = DRAWS[key](np.random.default_rng(1), rig)
        declared = stock_effects()[lessons.NAMES[hidden.key].effect].declared(Parameter)
        assert {factor for name in hidden.parameters for factor in name.split("*")} <= set(declared), key


@pytest.mark.slow
def test_margins_of_a_case_are_noted_without_a_change_of_its_answer(tmp_path: Path) -> None:
    write_case(26, 170, tmp_path)
    found = near([tmp_path])
    assert any(one.below[True] or one.above[True] for one in found.values())
    assert "| largest_size |" in "\n".join(table(found))
    told = json.loads((tmp_path / "margins.json").read_text(encoding="utf-8"))["told"]
    assert in_words(told) == in_words(stored()["suite 170"])
