"""What ``lathesim diagnose`` answers to input it can name nothing from: one clear sentence, and no name."""

import json

import h5py
import numpy as np
import pytest

from lathesim.identification.replay import loading
from lathesim.recordings import delimited_text, raw_table
from tests.cli.command import call

LESSON = """\
lesson: A pushed table
machine: force_axis
recordings:
  time: {column: t, unit: s}
  drive: {x_axis.force: {column: force, unit: N, held: true}}
  compare: {x_encoder.position: {column: place, unit: mm, resolution: 1 um}}
"""
UNCERTAIN = "uncertain: {x_axis.mass: 5 %, x_axis.viscous: 20 %}\n"
WITH_PROGRAM = """\
lesson: A table that follows a program
machine: cascade_axis
dialect: linuxcnc
program: small.nc
duration: 2 s
add: {exercise: {component: ConstantAccelerationInterpolator, set: {acceleration: 2 m/s^2}}}
wires: {x_controller.reference: exercise.x_reference}
recordings:
  time: {column: t, unit: s}
  compare: {x_encoder.position: {column: place, unit: mm, resolution: 1 um}}
uncertain: {x_axis.mass: 5 %, x_axis.viscous: 20 %}
"""
PROGRAM = "G21 G90 G94 G18\nG01 X4.0 F1200\nX1.0\nX13.0 F3000\nX0.0\nM02\n"


def pushed_table(mass=95.1089, viscous=203.5034, samples=2000):
    """Return time [s], force [N] and place [mm] of a mass under a force, by exact steps of the linear equation."""
    time = np.arange(samples) * 1e-3
    force = 60.0 * np.sin(2.0 * np.pi * 1.5 * time) + 25.0 * np.sign(np.sin(2.0 * np.pi * 0.7 * time))
    decay = np.exp(-viscous / mass * 1e-3)
    speed, place = np.zeros(samples), np.zeros(samples)
    for now in range(1, samples):
        final = force[now - 1] / viscous
        speed[now] = final + (speed[now - 1] - final) * decay
        place[now] = place[now - 1] + final * 1e-3 + (speed[now - 1] - final) * (1.0 - decay) * mass / viscous
    return time, force, 1e3 * np.round(place / 1e-6) * 1e-6


def written(folder, columns, name="recording.csv"):
    """Write columns as a CSV file and give its path."""
    path = folder / name
    rows = np.column_stack(list(columns.values()))
    path.write_text("\n".join([",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in rows)]) + "\n", encoding="utf-8")
    return path


def lesson_in(folder, text=LESSON + UNCERTAIN):
    path = folder / "pushed.yaml"
    path.write_text(text, encoding="utf-8")
    (folder / "small.nc").write_text(PROGRAM, encoding="utf-8")
    return path


def asked(capsys, folder, lesson, recording, *more):
    return call(capsys, "diagnose", lesson, recording, *more, "--no-report", "--json", "-", "--out", folder / "out")


def refused(said, *words):
    """Check that a call ends with one sentence that holds the words."""
    assert said.code == 1
    assert said.out == ""
    assert len(said.err.strip().splitlines()) == 1
    for word in words:
        assert word in said.err


def unnamed(said, verdict):
    """Return the answer, checked to be the verdict and to name no effect."""
    assert said.code == 0, said.err
    answer = json.loads(said.out)
    assert answer["verdict"] == verdict
    assert answer["effects"] == []
    assert answer["insert"] == []
    return answer


def test_a_missing_column_is_said_with_the_nearest_name(capsys, tmp_path):
    time, force, place = pushed_table(500)
    recording = written(tmp_path, {"t": time, "force": force, "palce": place})
    refused(asked(capsys, tmp_path, lesson_in(tmp_path), recording), "'place'", "palce")


def test_ten_samples_are_too_few(capsys, tmp_path):
    time, force, place = pushed_table(samples=10)
    refused(asked(capsys, tmp_path, lesson_in(tmp_path), written(tmp_path, {"t": time, "force": force, "place": place})), "10 ", "samples")


@pytest.mark.parametrize("lost", [("place",), ("force",), ("force", "place")])
def test_a_channel_of_nothing_but_missing_values_is_a_fault_of_the_recording(capsys, tmp_path, lost):
    time, force, place = pushed_table(samples=500)
    columns = {"t": time, "force": force, "place": place} | {name: np.full(500, np.nan) for name in lost}
    answer = unnamed(asked(capsys, tmp_path, lesson_in(tmp_path), written(tmp_path, columns)), "recording_fault")
    assert "none of the 500 values is a number" in answer["sentence"]


def test_a_file_longer_than_the_memory_bears_is_refused(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(raw_table, "MOST_ROWS", 400)
    time, force, place = pushed_table(samples=500)
    recording = written(tmp_path, {"t": time, "force": force, "place": place})
    refused(asked(capsys, tmp_path, lesson_in(tmp_path), recording), "500", "rows")


def test_a_text_of_more_rows_than_a_diagnosis_takes_is_refused_before_it_is_read(capsys, tmp_path, monkeypatch):
    def read(*given):
        raise AssertionError("the rows are counted, and not read")

    monkeypatch.setattr(loading, "MOST_SAMPLES", 400)
    monkeypatch.setattr(delimited_text, "read_rows", read)
    recording = tmp_path / "long.csv"
    recording.write_text("t,force,place\n" + "0.1,2,3\n" * 600, encoding="utf-8")
    refused(asked(capsys, tmp_path, lesson_in(tmp_path), recording), "601 rows", "400", "part of the time")


def test_a_recording_of_more_samples_than_a_diagnosis_takes_is_refused(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(loading, "MOST_SAMPLES", 400)
    time, force, place = pushed_table(samples=450)
    recording = written(tmp_path, {"t": time, "force": force, "place": place})
    refused(asked(capsys, tmp_path, lesson_in(tmp_path), recording), "450 samples", "part of the time")


@pytest.mark.slow
def test_ten_million_rows_are_refused(capsys, tmp_path):
    rows = 10_000_000
    recording = tmp_path / "long.h5"
    with h5py.File(recording, "w") as file:
        file["t"] = np.arange(rows) * 1e-3
        file["force"] = np.sin(np.arange(rows) * 1e-2)
        file["place"] = np.cos(np.arange(rows) * 1e-2)
    refused(asked(capsys, tmp_path, lesson_in(tmp_path), recording), "10 000 000 samples")


def test_a_lesson_without_uncertainties_is_refused(capsys, tmp_path):
    time, force, place = pushed_table(samples=500)
    recording = written(tmp_path, {"t": time, "force": force, "place": place})
    refused(asked(capsys, tmp_path, lesson_in(tmp_path, LESSON), recording), "how sure its values are", "uncertain")


def test_a_recording_that_does_not_overlap_the_program_names_nothing(capsys, tmp_path):
    time, force, place = pushed_table(samples=500)
    recording = written(tmp_path, {"t": 1000.0 + time, "force": force, "place": place})
    said = asked(capsys, tmp_path, lesson_in(tmp_path, WITH_PROGRAM), recording)
    refused(said, "1000", "2 s")


@pytest.mark.slow
def test_a_validation_file_of_another_machine_names_nothing(capsys, tmp_path):
    time, force, place = pushed_table()
    _, _, other = pushed_table(mass=400.0, viscous=30.0)
    first = written(tmp_path, {"t": time, "force": force, "place": place})
    second = written(tmp_path, {"t": time, "force": force, "place": other}, "other.csv")
    said = asked(capsys, tmp_path, lesson_in(tmp_path), first, "--validate", second)
    assert said.code in (0, 1)
    if said.code == 0:
        answer = json.loads(said.out)
        assert answer["effects"] == []
        assert "of another machine" in answer["sentence"]
    else:
        assert "another machine" in said.err
