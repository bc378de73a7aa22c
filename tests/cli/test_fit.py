"""``lathesim fit``: parameters of a lesson from a recording, as a table, as JSON and as a lesson."""

import json
from pathlib import Path

import pytest

from tests.cli.command import call, done, json_of, refused
from tests.diagnosis.driven_axis import MASS, VISCOUS, write_recording

Capture = pytest.CaptureFixture[str]


def test_a_table_with_errors_and_the_starts_that_agree(capsys: Capture, tmp_path: Path) -> None:
    lesson, recording = write_recording(tmp_path)
    said = done(capsys, "fit", lesson, recording, "--free", "x_axis.mass,x_axis.viscous", "--starts", "2")
    lines = said.out.splitlines()
    assert lines[0].split() == ["parameter", "value", "standard", "error", "unit", "given"]
    cells = {line.split()[0]: line.split() for line in lines[2:4]}
    assert float(cells["x_axis.mass"][1]) == pytest.approx(MASS, rel=1e-3)
    assert float(cells["x_axis.viscous"][1]) == pytest.approx(VISCOUS, rel=1e-3)
    assert cells["x_axis.mass"][3:] == ["kg", "95"]
    assert lines[-1].startswith("2 of 2 starts agree; ")


def test_json_and_nothing_else(capsys: Capture, tmp_path: Path) -> None:
    lesson, recording = write_recording(tmp_path)
    told = json_of(capsys, "fit", lesson, recording, "--free", "x_axis.mass", "--free", "x_axis.viscous", "--starts", "1", "--json")
    assert told["schema"] == "lathesim-fit/1"
    assert told["parameters"]["x_axis.mass"]["unit"] == "kg"
    assert told["parameters"]["x_axis.mass"]["determined"] is True
    assert told["fit"]["x_encoder.position"]["after"] < told["fit"]["x_encoder.position"]["before"]
    assert (told["starts"], told["agreeing"], told["undetermined"], told["findings"]) == (1, 1, [], [])


def test_the_lesson_is_written_with_the_fitted_values(capsys: Capture, tmp_path: Path) -> None:
    lesson, recording = write_recording(tmp_path)
    out = tmp_path / "fitted.yaml"
    said = call(capsys, "fit", lesson, recording, "--free", "x_axis.mass,x_axis.viscous", "--starts", "1", "--out", out)
    assert said.out.splitlines()[-1] == f"The lesson with these values is {out}"
    done(capsys, "check", out)
    again = call(capsys, "fit", out, recording, "--free", "x_axis.mass", "--starts", "1", "--json")
    assert json.loads(again.out)["parameters"]["x_axis.mass"]["given"] == pytest.approx(MASS, rel=1e-3)


def test_what_was_found_in_the_recording_comes_first(capsys: Capture, tmp_path: Path) -> None:
    lesson, recording = write_recording(tmp_path)
    rows = recording.read_text(encoding="utf-8").splitlines()
    recording.write_text("\n".join([*rows[:500], *rows[502:]]) + "\n", encoding="utf-8")
    said = call(capsys, "fit", lesson, recording, "--free", "x_axis.mass", "--starts", "1")
    assert said.out.splitlines()[0] == "Recording: 2 samples are missing in gaps of fewer than 5; interpolated linearly."


REFUSED = {
    "unknown parameter": (
        ["--free", "x_axis.mas"],
        "--free: no compared channel depends on a parameter 'x_axis.mas'. Did you mean 'x_axis.mass'?\n",
    ),
    "no folder": (
        ["--free", "x_axis.mass", "--starts", "1", "--out", "nowhere/a.yaml"],
        "nowhere/a.yaml: there is no folder 'nowhere'. Make it, or choose another place.\n",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_is_refused(kind: str, capsys: Capture, tmp_path: Path) -> None:
    arguments, sentence = REFUSED[kind]
    assert refused(capsys, "fit", *write_recording(tmp_path), *arguments).err.endswith(sentence)


def test_usage_without_free(capsys: Capture, tmp_path: Path) -> None:
    assert call(capsys, "fit", *write_recording(tmp_path)).code == 2
