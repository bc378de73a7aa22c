"""The next part program: written inside the lesson's limits, or refused in one sentence."""

import json
from pathlib import Path

import pytest

from lathesim.errors import LatheSimError
from lathesim.experiments.candidate_programs import lay_those_that_fit
from lathesim.experiments.families import CandidateProgram
from lathesim.experiments.room import DesignedMove, room_of
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry
from tests.cli.command import call, done, json_of, refused
from tests.experiments.separation.alike import written_lesson

LESSON = "22_what_is_wrong_with_this_machine"


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_program_tells_play_from_friction(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    said = call(
        capsys, "experiment", LESSON, "--between", "Backlash@x_axis,PreslidingFriction@x_axis", "--at-most", "7 s", "--programs", "6",
        "--no-trial", "--out", tmp_path / "next", "--json",
    )  # fmt: skip
    assert said.code == 0, said.err
    told = json.loads((tmp_path / "next" / "prediction.json").read_text())
    assert told == json.loads(said.out)
    assert told["schema"] == "lathesim-experiment/1"
    assert [item["rival"] for item in told["rivals"]] == ["Backlash@x_scale", "PreslidingFriction@x_axis"]
    assert told["decidable"]
    assert told["chance_to_decide"] > 0.7
    assert told["seconds"] <= 7.5
    assert {item["channel"] for item in told["record"]} >= {"x_scale.position", "x_drive.current"}
    assert (tmp_path / "next" / "experiment.png").stat().st_size > 10_000
    moves = json_of(capsys, "program", tmp_path / "next" / "program.nc", "--json")["moves"]
    assert len(moves) > 10
    done(capsys, "check", tmp_path / "next" / "lesson.yaml")


def test_the_same_thing_twice_cannot_be_told_apart(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    rivals = "ForceOffset@x_axis,ForceOffset@x_axis"
    said = refused(capsys, "experiment", LESSON, "--between", rivals, "--out", tmp_path / "next")
    assert said.err == "--between: two rivals are the same: ForceOffset@x_axis. Name another effect, or another part.\n"
    assert not (tmp_path / "next").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--between", "Backlash@x_axis"], "one rival alone needs no experiment."),
        (["--between", "Backlash@y_axis,nothing"], "Backlash does not sit at 'y_axis'. Did you mean 'x_axis'?"),
        (["--between", "Backlsh@x_axis,nothing"], "there is no effect 'Backlsh'. Did you mean 'Backlash'?"),
        (["--between", "Backlash@x_axis,nothing", "--at-most", "1 s"], "a program of 1 s is too short to decide anything."),
        (["--between", "Backlash@x_axis,nothing", "--at-most", "1e9 s"], "--at-most: a program of 1e+09 s is too long to be designed."),
        (["--between", "Backlash@x_axis,nothing", "--at-most", "3 mm"], "--at-most: '3 mm' is given in mm, but s is wanted."),
        (["--for", "x_axis.mass", "--rate", "0 Hz"], "--rate: a recording cannot take a row 0 times a second."),
        ([Path(__file__), "--for", "x_axis.mass"], "this is no emulation. Give the emulation.json of 'lathesim emulate'."),
        (["--for", "x_axis.mas"], "--for: the machine has no parameter 'x_axis.mas'. Did you mean 'x_axis.mass'?"),
    ],
)
def test_wishes_that_cannot_be_met(capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: list[str | Path], message: str) -> None:
    assert message in refused(capsys, "experiment", LESSON, *arguments, "--out", tmp_path / "next").err
    assert not (tmp_path / "next").exists()


def test_effect_at_a_sensor_that_is_not_recorded(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    lesson = written_lesson(tmp_path, ("x_scale.position",))
    said = refused(capsys, "experiment", lesson, "--between", "TorsionalWindUp@x_scale,Backlash@x_scale", "--out", tmp_path / "next")
    assert "nothing that is recorded reads 'x_scale', so TorsionalWindUp shows nowhere. Record x_scale.position too." in said.err


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{}", "this is no diagnosis. Give what 'lathesim diagnose --json FILE' wrote."),
        ("[", "this is no diagnosis."),
        (
            '{"schema": "lathesim-diagnosis/1", "verdict": "no_mismatch", "effects": []}',
            "(no_mismatch) leaves no explanations to distinguish.",
        ),
        (
            '{"schema": "lathesim-diagnosis/1", "lesson": "The forged sensor", "verdict": "tied", "effects": []}',
            "this is a diagnosis of another lesson: 'The forged sensor', not 'What is wrong with this machine?'.",
        ),
    ],
)
def test_files_that_are_no_tied_diagnosis(capsys: pytest.CaptureFixture[str], tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "d.json").write_text(text)
    assert message in refused(capsys, "experiment", LESSON, tmp_path / "d.json", "--out", tmp_path / "next").err


def test_machine_that_no_program_moves(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    lesson = tmp_path / "still.yaml"
    lesson.write_text(
        "lesson: Still\nmachine: voltage_axis\nduration: 1 s\nrecordings:\n  time: {column: t, unit: s}\n"
        "  compare: {x_encoder.position: {column: x, unit: m}}\n"
    )
    said = refused(capsys, "experiment", lesson, "--between", "CoulombFriction@x_axis,nothing", "--out", tmp_path / "next")
    assert "no part program moves this machine: nothing follows the reference of an interpolator." in said.err


def test_no_program_fits_into_the_time() -> None:
    room = room_of(prepare(load_lesson(LESSON), load_registry(installed=False)))
    too_far = CandidateProgram("far away", (DesignedMove({"X": 1e3}, 0.01),), 1.0)
    with pytest.raises(LatheSimError, match="no program of at most 2 s fits into the travel"):
        lay_those_that_fit([too_far], room, 2.0)


@pytest.mark.parametrize(
    "between",
    [
        "CumulativePitchError@x_scale,ScaleFactorError@x_scale",
        pytest.param("PeriodicPitchError@x_scale,EncoderEccentricity@x_scale", marks=pytest.mark.slow),
    ],
)
def test_effects_of_one_equation_are_not_called_decidable(capsys: pytest.CaptureFixture[str], tmp_path: Path, between: str) -> None:
    said = call(
        capsys, "experiment", LESSON, "--between", between, "--at-most", "6.5 s", "--programs", "4", "--out", tmp_path / "next", "--json"
    )
    told = json.loads(said.out)
    assert not told["decidable"]
    assert told["pairs"][0]["apart"] < 1.0
    assert "A second sensor of the same motion would" in told["if_nothing_tells"]
