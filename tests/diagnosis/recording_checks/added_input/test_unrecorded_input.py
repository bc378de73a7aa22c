"""A command that does not follow from its controller because something is added to it: worked out and placed."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.recording_checks.added_input import unrecorded_inputs, with_inputs, with_signals
from lathesim.diagnosis.recording_checks.controllers import unexplained_share
from lathesim.engine.assembly import FloatArray
from lathesim.identification.replay.experiment import Experiment, build_experiments
from tests.cli.command import call
from tests.diagnosis.rigs.cases import case_of, write_case
from tests.diagnosis.small_case import POSITION, REFERENCE, VOLTAGE, controlled_axis


@pytest.fixture(scope="module")
def controlled(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    machine, record = controlled_axis(tmp_path_factory.mktemp("lesson"))
    (experiment,) = build_experiments(machine, [("run.csv", record)], [])
    return experiment


def with_added(experiment: Experiment, values: FloatArray) -> Experiment:
    record = experiment.record
    return replace(experiment, record=record.with_channel(VOLTAGE, "V", record[VOLTAGE] + values))


def pulses(experiment: Experiment) -> FloatArray:
    time = experiment.record.time
    return np.where((time % 0.5 > 0.2) & (time % 0.5 < 0.26), 1.0, 0.0)


def test_a_sound_recording_has_no_unrecorded_input(controlled: Experiment) -> None:
    assert unrecorded_inputs((controlled,), {}, ()) == []


def test_pulses_are_worked_out_and_placed(controlled: Experiment) -> None:
    added = pulses(controlled)
    (found,) = unrecorded_inputs((with_added(controlled, added),), {}, ())
    assert found.values == pytest.approx(added, abs=1e-6)
    assert found.wire == "x_dac.command"
    assert found.shape.words == "4 pulses of 1 V, 59 ms long"
    assert str(found).startswith(f"A signal that nobody recorded is added to {VOLTAGE} on its way to x_dac.command: 4 pulses")


def test_with_the_signal_as_an_input_the_command_follows(controlled: Experiment) -> None:
    off = with_added(controlled, pulses(controlled))
    found = unrecorded_inputs((off,), {}, ())
    machine = with_inputs(off.machine, found)
    assert machine.drive == (REFERENCE, "added_x_controller_voltage.added")
    (known,) = build_experiments(machine, [("run.csv", with_signals(off, {}, found))], [])
    ((_, before),) = unexplained_share(off, {})
    ((_, after),) = unexplained_share(known, {})
    assert after < 1e-6 < 0.05 < before


def test_another_column_is_no_unrecorded_input(controlled: Experiment) -> None:
    """A reference that stands: the command would need all of the motion added to it."""
    record = controlled.record
    wrong = record.with_channel(REFERENCE, "m", np.full(len(record), float(record[POSITION][0])))
    assert unrecorded_inputs((replace(controlled, record=wrong),), {}, ()) == []


def answered(capsys: pytest.CaptureFixture[str], folder: Path, rig: str, number: int) -> tuple[dict[str, object], str]:
    case = case_of(rig, "input", seed=number)
    place = write_case(case, folder)[0]
    words = [place / "lesson.yaml", place / "fit.csv", "--validate", place / "validate.csv"]
    said = call(capsys, "diagnose", *words, "--no-report", "--json", "-", "--out", folder)
    assert said.code == 0, said.err
    return json.loads(said.out), case.fault


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1, 2])
def test_what_somebody_adds_to_a_command_is_unknown_there_and_no_fault(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, number: int
) -> None:
    """On a rig of another generator, closed loop and all: pulses, steps and a sine."""
    answer, shape = answered(capsys, tmp_path, "belt_pid_500", number)
    assert answer["verdict"] == "unknown"
    assert answer["location"]["components"] == ["x_dac"]  # type: ignore[index]
    assert shape in str(answer["sentence"])
    assert answer["effects"] == []
    assert str(answer["sentence"]).endswith("Everything else agrees with the lesson.")
