"""``lathesim compare``: tables for a person, JSON for a program, and one figure."""

from pathlib import Path

import pytest

from tests.cli.command import call, done, json_of, refused
from tests.diagnosis.small_case import write_lesson


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from lathesim.cli.main import run_command_line

    folder = tmp_path_factory.mktemp("case")
    lesson = str(write_lesson(folder))
    asked = ["--effect", "CoulombFriction:level=20 N@x_axis", "--seed", "4"]
    assert run_command_line(["conceal", lesson, "--out", str(folder / "case"), *asked]) == 0
    return folder / "case"


def test_compare_tells_how_far_off_where_and_on_what_it_depends(case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = done(capsys, "compare", case / "lesson.yaml", case / "recording.csv", "--out", tmp_path)
    assert said.out.splitlines()[0].split() == ["channel", "error,", "rms", "noise", "error", "/", "noise", "worst"]
    assert "The mismatch sits in x_axis. Values are as the lesson has them" in said.out
    assert "x_encoder <- x_axis <- x_drive <- x_dac" in said.out
    assert "velocity of x_axis" in said.out
    assert said.out.endswith(f"See {tmp_path / 'recording_compared.png'}\n")
    assert (tmp_path / "recording_compared.png").is_file()


def test_compare_as_json_is_json_and_nothing_else(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = json_of(capsys, "compare", case / "lesson.yaml", case / "recording.csv", "--json", "--no-plots")
    assert (told["schema"], told["lesson"], told["recording"]) == ("lathesim-compare/1", "lesson", "recording.csv")
    assert (told["suspect"], told["figure"]) == ("x_axis", None)


@pytest.mark.parametrize(
    ("recording", "sentence"),
    [("missing.csv", "there is no such file."), ("seal.json", "the file ends in .json and holds no recording of SINUMERIK Edge.")],
)
def test_what_cannot_be_compared_leaves_with_one(recording: str, sentence: str, case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = call(capsys, "compare", case / "lesson.yaml", case / recording, "--no-plots")
    assert (said.code, said.out) == (1, "")
    assert sentence in said.err


def test_a_lesson_without_mapping_is_asked_for_one(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(capsys, "compare", "01_contour_error", case / "recording.csv")
    assert "the lesson does not say what the columns of a recording mean. Add recordings:" in said.err
