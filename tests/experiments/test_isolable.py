"""What a recording could tell, before it is made: sizes that are just seen, effects that are alike, and why."""

import re
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.isolation.answerable import isolated
from lathesim.experiments.isolable import Means, looking_at
from lathesim.lessons.lesson import load_lesson
from lathesim.plugins import load_registry
from tests.cli.command import json_of, refused
from tests.diagnosis.small_case import write_lesson

ONE_SPEED = "(One way at one speed)\nG21 G90 G94 G18\nG01 X1000.0 F3000\nM02\n"


def only(*names: str) -> list[str]:
    return [word for name in names for word in ("--effect", name)]


@pytest.fixture
def one_speed(tmp_path: Path) -> Path:
    """A lesson whose axis goes one way at one speed for as long as it lasts, faster than it can be seen to begin."""
    path = write_lesson(tmp_path)
    (tmp_path / "small.nc").write_text(ONE_SPEED, encoding="utf-8")
    return path


def test_an_effect_of_its_smallest_size_is_just_seen(tmp_path: Path) -> None:
    means = Means(effects=("CoulombFriction", "AmplifierDeadZone"))
    looking, notes = looking_at(load_lesson(write_lesson(tmp_path)), load_registry(installed=False), means)
    assert notes == ()
    found = isolated(looking)
    for one, candidate in zip(found.effects, looking.study.estimation.candidates, strict=True):
        assert one.is_visible
        sizes = (0.8 * one.smallest, 1.25 * one.smallest)
        assert candidate.parameters[0].endswith(one.parameter)
        below, above = looking.changes([(candidate, np.array([size, *candidate.points[0][1:]])) for size in sizes])
        assert below is not None
        assert above is not None
        assert below.above < 1.0 < above.above


def test_one_way_at_one_speed_answers_little_and_says_why(
    one_speed: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    effects = only("CoulombFriction", "AsymmetricFriction")
    told = json_of(capsys, "isolable", one_speed, *effects, "--json", "--save", tmp_path / "matrix.png")
    assert told["schema"] == "lathesim-isolation/1"
    assert told["sensors"] == ["x_encoder.position", "x_controller.voltage"]
    assert (tmp_path / "matrix.png").stat().st_size > 5_000
    names, behind = told["matrix"]["names"], told["matrix"]["behind"]
    assert names == [f"{one['effect']} at {one['at']}" for one in told["effects"]]
    assert [len(row) for row in behind] == [len(names)] * len(names)
    by_name = {one["effect"]: one for one in told["effects"]}
    assert not by_name["AsymmetricFriction"]["visible"]
    assert by_name["AsymmetricFriction"]["smallest"] is None
    assert "x_axis moves in one direction only" in by_name["AsymmetricFriction"]["why"]
    friction = by_name["CoulombFriction"]
    assert [one["effect"] for one in friction["tied_with"]] == ["AsymmetricFriction"]
    assert friction["why"] == "x_axis moves in one direction only; x_axis moves at one speed"


def test_a_sensor_that_is_not_there_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(capsys, "isolable", write_lesson(tmp_path), "--sensors", "x_encoder.positon")
    assert said.err == "--sensors: the machine has no output 'x_encoder.positon'. Did you mean 'x_encoder.position'?\n"


def test_the_sensor_and_the_program_that_tell_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    effects, sensors = only("ForceOffset", "ConverterOffset"), ("--sensors", "x_encoder.position")
    told = json_of(capsys, "isolable", write_lesson(tmp_path), *effects, *sensors, "--json")
    ((channel, pairs),) = [(one["channel"], one["tells"]) for one in told["sensors_that_tell"]]
    assert channel == "x_drive.current"
    assert ["ForceOffset at x_axis", "ConverterOffset at x_drive"] in pairs
    assert told["program_that_tells"] is None or told["program_that_tells"]["seconds"] <= 10.0
    said = json_of(capsys, "isolable", write_lesson(tmp_path), *effects, "--sensors", f"x_encoder.position,{channel}", "--json")
    assert not [one for one in said["effects"] if one["effect"] == "ForceOffset" and one["tied_with"]]


def test_a_lesson_that_a_recording_drives_asks_for_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_lesson(tmp_path)
    text = path.read_text(encoding="utf-8").replace("program: small.nc\n", "").replace("duration: 2.2 s\n", "")
    text = re.sub(r"(?m)^(add|wires):.*\n(  exercise.*\n)?", "", text)
    path.write_text(text, encoding="utf-8")
    said = refused(capsys, "isolable", path)
    assert said.err.startswith("small: nothing says how this machine is moved: a recording drives it, and none is given.")
