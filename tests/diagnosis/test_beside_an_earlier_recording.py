"""Asked what changed, a diagnosis names what is small beside the errors that the lesson has always had."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lathesim.record import Channel, FloatArray, Record
from lathesim.record_writer import save
from tests.cli.command import call
from tests.live import campaign
from tests.live.campaign.machines import PERIOD, axis, cut

CUT_LESSON = Path(campaign.__file__).parent / "cut.yaml"
LESSON = "22_what_is_wrong_with_this_machine"
AXIS = {
    "x_controller.reference": "m",
    "x_encoder.position": "m",
    "x_scale.position": "m",
    "x_controller.voltage": "V",
    "x_drive.current": "A",
}
CUT = {
    "cutting.feed": "m",
    "cutting.depth": "m",
    "cutting.speed": "m/s",
    "dynamometer.main": "N",
    "dynamometer.thrust": "N",
    "dynamometer.feed": "N",
}
FORCES = ("WearForceGrowth", "EdgeForce", "DynamometerCrosstalk", "ScaleFactorError")
PLAY = 50e-9


def save_run(place: Path, seed: int, play: float, warmth: float) -> Path:
    """Save 20 s of an axis whose viscous friction falls as it warms up."""
    time = np.arange(round(20.0 / PERIOD)) * PERIOD
    changes = {"play": np.full(len(time), play), "viscous": 1.0 + warmth * np.exp(-time / 200.0)}
    return as_file(place, AXIS, axis(20.0, seed, changes))


def save_cut(place: Path, seed: int, wear: float) -> Path:
    """Save 20 s of a turning cut whose edge has worn: the main force has grown by this share, thrust and feed force by more."""
    return as_file(place, CUT, cut(20.0, seed, {"wear": np.full(round(20.0 / PERIOD), wear)}))


def as_file(place: Path, names: Mapping[str, str], values: FloatArray) -> Path:
    """Save channels (rows) under their names."""
    channels = {name: Channel(name, unit, row) for (name, unit), row in zip(names.items(), values, strict=True)}
    save(Record(np.arange(values.shape[1]) * PERIOD, channels, {"sample_period": PERIOD, "status": "complete"}), place)
    return place


def answer(capsys: pytest.CaptureFixture[str], run: Path, *options: str | Path, lesson: str = LESSON) -> dict[str, Any]:
    """Return the answer (JSON) about a run."""
    said = call(capsys, "diagnose", lesson, run, "--json", "-", "--no-report", *options)
    assert said.code == 0, said.err
    found: dict[str, Any] = json.loads(said.out)
    return found


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_a_play_of_one_count_is_named_beside_a_run_from_before(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = save_run(tmp_path / "run.h5", 1, PLAY, 0.03)
    assert answer(capsys, run)["verdict"] == "parameters_only"
    found = answer(capsys, run, "--before", save_run(tmp_path / "before.h5", 2, 0.0, 0.06))
    assert found["verdict"] == "named"
    (effect,) = found["effects"]
    assert effect["effect"] == "Backlash"
    assert effect["parameters"]["width"]["low"] < PLAY < effect["parameters"]["width"]["high"]


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_where_nothing_changed_nothing_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run, earlier = save_run(tmp_path / "run.h5", 1, 0.0, 0.03), save_run(tmp_path / "before.h5", 2, 0.0, 0.06)
    assert answer(capsys, run, "--before", earlier)["verdict"] in ("no_mismatch", "parameters_only")


@pytest.mark.slow
@pytest.mark.parametrize(("wear", "verdict", "names"), [(0.03, "named", ["WearForceGrowth"]), (0.0, "no_mismatch", [])])
def test_three_forces_that_grew_are_one_edge_that_wore(
    wear: float, verdict: str, names: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The specific force takes what wear does to the main force; two crosstalks would take the rest."""
    only = [option for name in FORCES for option in ("--effect", name)]
    run, earlier = save_cut(tmp_path / "run.h5", 1, wear), save_cut(tmp_path / "before.h5", 2, 0.0)
    found = answer(capsys, run, "--before", earlier, *only, lesson=str(CUT_LESSON))
    assert found["verdict"] == verdict
    assert [effect["effect"] for effect in found["effects"]] == names
    # how fast the edge wears and what that does show in a product alone
    assert not any(effect["may_be_zero"] for effect in found["effects"])
