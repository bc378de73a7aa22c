"""A recording that begins in the middle of a motion is no contradiction: its controllers remember what they did before."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.recording_checks.command_consistency import contradicted
from lathesim.identification.replay.controller_memory import remembered_at_start
from lathesim.identification.replay.experiment import Experiment, Machine, build_experiments
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.record import Record
from tests.diagnosis.small_case import write_lesson

REFERENCE, POSITION, VOLTAGE = "x_controller.reference", "x_encoder.position", "x_controller.voltage"
CURRENT = "x_drive.current"
CONTROLLERS = {
    "P-PI": "set: {x_controller.integral_rate: 20 1/s, x_controller.mean_share: 0}\n",
    "P-P": "",
    "PID": (
        "replace: {x_controller: PositionController}\n"
        "set: {x_controller.proportional: 20000 V/m, x_controller.integral: 40000 V/(m*s), x_controller.derivative_gain: 240 V*s/m}\n"
    ),
}


@pytest.fixture(scope="module", params=CONTROLLERS)
def recorded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Machine, Record]:
    """An axis with one of the controllers, and a run of it with a load that the integral has to hold."""
    load = "insert: [{effect: ForceOffset, at: x_axis, offset: 60 N}]\n"
    lesson = write_lesson(tmp_path_factory.mktemp("lesson"), extra=CONTROLLERS[request.param] + load)
    prepared = prepare(load_lesson(lesson), load_registry(installed=False))
    run = run_prepared(prepared)
    asked = run.channels[next(name for name in run.channels if name.endswith("x_reference"))]
    record = Record(run.time, {REFERENCE: asked, POSITION: run.channels[POSITION], VOLTAGE: run.channels[VOLTAGE]}, dict(run.meta))
    return Machine(prepared.machinery, (REFERENCE,), (POSITION, VOLTAGE), {}, {}), record


def from_sample(record: Record, first: int) -> Record:
    """Return what a recorder has that was switched on late: its time begins at zero then."""
    channels = {name: replace(channel, values=channel.values[first:]) for name, channel in record.channels.items()}
    return Record(record.time[: len(record) - first], channels, dict(record.meta))


def unexplained(experiment: Experiment) -> float:
    """Return the share of the command that a replay of its controller leaves."""
    row = experiment.machine.compare.index(VOLTAGE)
    return float(np.std(experiment.sensed.one({})[row]) / np.std(experiment.record[VOLTAGE]))


def test_what_a_controller_remembers_is_found(recorded: tuple[Machine, Record]) -> None:
    machine, record = recorded
    (experiment,) = build_experiments(machine, [("late.csv", from_sample(record, 700))], [])
    assert unexplained(experiment) < 1e-3
    assert contradicted(experiment, {}) == ""


def test_a_recording_from_rest_is_taken_as_it_is(recorded: tuple[Machine, Record]) -> None:
    machine, record = recorded
    (experiment,) = build_experiments(machine, [("whole.csv", record)], [])
    assert experiment.machine is machine
    assert remembered_at_start(machine.assembly, machine.compare, experiment.sensed) == {}


def test_a_command_that_is_not_this_controllers_is_not_explained_by_memory(recorded: tuple[Machine, Record]) -> None:
    machine, record = recorded
    turned = record.with_channel(VOLTAGE, "V", -record[VOLTAGE])
    (experiment,) = build_experiments(machine, [("turned.csv", from_sample(turned, 700))], [])
    assert "does not follow from what its controller was given" in contradicted(experiment, {})


@pytest.mark.parametrize("converter", ["", "set: {x_dac.bits: 12, "], ids=["as the lesson has it", "in steps of 5 mV"])
def test_the_current_of_a_drive_tells_what_its_controller_remembers(converter: str, tmp_path: Path) -> None:
    """Without the command a friction of steady sliding, which the integral held, was missing twice: at the drive and at the table. A
    converter's steps hide what a microvolt more in the integral does."""
    load = "insert: [{effect: ForceOffset, at: x_axis, offset: 60 N}]\n"
    controller = CONTROLLERS["P-PI"].replace("set: {", converter) if converter else CONTROLLERS["P-PI"]
    prepared = prepare(load_lesson(write_lesson(tmp_path, extra=controller + load)), load_registry(installed=False))
    run = run_prepared(prepared)
    asked = run.channels[next(name for name in run.channels if name.endswith("x_reference"))]
    record = Record(run.time, {REFERENCE: asked, POSITION: run.channels[POSITION], CURRENT: run.channels[CURRENT]}, dict(run.meta))
    machine = Machine(prepared.machinery, (REFERENCE,), (POSITION, CURRENT), {}, {})
    (experiment,) = build_experiments(machine, [("late.csv", from_sample(record, 700))], [])
    row = experiment.machine.compare.index(CURRENT)
    assert np.std(experiment.sensed.one({})[row]) < 0.02 * np.std(experiment.record[CURRENT])
