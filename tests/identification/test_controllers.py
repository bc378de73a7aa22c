"""Controllers in a replay: what they remember at the start, and logs that hold fewer rows than they decide."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.recording_checks.command_consistency import contradicted
from lathesim.diagnosis.recording_checks.controllers import unexplained_share
from lathesim.diagnosis.recording_checks.sample_clock import of_another_period
from lathesim.engine.assembly import Assembly, Part
from lathesim.identification.replay.controller_memory import remembered_at_start
from lathesim.identification.replay.controller_rate import at_controllers_rate, decisions_for_each
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, build_experiments
from lathesim.identification.replay.loading import at_period
from lathesim.identification.replay.recorded_parts import LinearSignal
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.record import Record
from tests.diagnosis.pushed_table import machine
from tests.diagnosis.small_case import CURRENT, POSITION, REFERENCE, VOLTAGE, controlled_axis, write_lesson

CONTROLLERS = {
    "P-PI": "set: {x_controller.integral_rate: 20 1/s, x_controller.mean_share: 0}\n",
    "P-P": "",
    "PID": (
        "replace: {x_controller: PositionController}\n"
        "set: {x_controller.proportional: 20000 V/m, x_controller.integral: 40000 V/(m*s), x_controller.derivative_gain: 240 V*s/m}\n"
    ),
}


@pytest.fixture(scope="module", params=CONTROLLERS)
def recorded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[RecordedMachine, Record]:
    """An axis with one of the controllers, and a run of it with a load that the integral has to hold."""
    load = "insert: [{effect: ForceOffset, at: x_axis, offset: 60 N}]\n"
    lesson = write_lesson(tmp_path_factory.mktemp("lesson"), extra=CONTROLLERS[request.param] + load)
    prepared = prepare(load_lesson(lesson), load_registry(installed=False))
    run = run_prepared(prepared)
    asked = run.channels[next(name for name in run.channels if name.endswith("x_reference"))]
    record = Record(run.time, {REFERENCE: asked, POSITION: run.channels[POSITION], VOLTAGE: run.channels[VOLTAGE]}, dict(run.meta))
    return RecordedMachine(prepared.machinery, (REFERENCE,), (POSITION, VOLTAGE), {}, {}), record


def from_sample(record: Record, first: int) -> Record:
    """Return what a recorder has that was switched on late: its time begins at zero then."""
    channels = {name: replace(channel, values=channel.values[first:]) for name, channel in record.channels.items()}
    return Record(record.time[: len(record) - first], channels, dict(record.meta))


def unexplained(experiment: Experiment) -> float:
    """Return the share of the command that a replay of its controller leaves."""
    row = experiment.machine.compare.index(VOLTAGE)
    return float(np.std(experiment.sensed.one({})[row]) / np.std(experiment.record[VOLTAGE]))


def test_what_a_controller_remembers_is_found(recorded: tuple[RecordedMachine, Record]) -> None:
    machine, record = recorded
    (experiment,) = build_experiments(machine, [("late.csv", from_sample(record, 700))], [])
    assert unexplained(experiment) < 1e-3
    assert contradicted(experiment, {}) == ""


def test_a_recording_from_rest_is_taken_as_it_is(recorded: tuple[RecordedMachine, Record]) -> None:
    machine, record = recorded
    (experiment,) = build_experiments(machine, [("whole.csv", record)], [])
    assert experiment.machine is machine
    assert remembered_at_start(machine.assembly, machine.compare, experiment.sensed) == {}


def test_a_command_that_is_not_this_controllers_is_not_explained_by_memory(recorded: tuple[RecordedMachine, Record]) -> None:
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
    machine = RecordedMachine(prepared.machinery, (REFERENCE,), (POSITION, CURRENT), {}, {})
    (experiment,) = build_experiments(machine, [("late.csv", from_sample(record, 700))], [])
    row = experiment.machine.compare.index(CURRENT)
    assert np.std(experiment.sensed.one({})[row]) < 0.02 * np.std(experiment.record[CURRENT])


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> tuple[Assembly, Record]:
    """An axis under cascade control, and a run of it that holds every decision."""
    machine, record = controlled_axis(tmp_path_factory.mktemp("lesson"))
    return machine.assembly, record


def every_second(axis: tuple[Assembly, Record], decisions: int) -> Experiment:
    """Return the rig of a log that holds every second row, taken for one of controllers that decide so often for each."""
    assembly, record = axis
    channels = {name: replace(channel, values=channel.values[::2]) for name, channel in record.channels.items()}
    slow = Record(record.time[::2], channels)
    lesson = RecordedMachine(at_period(assembly, slow.sample_period), (REFERENCE,), (POSITION, VOLTAGE), {}, {}, decisions=decisions)
    (experiment,) = build_experiments(lesson, [("slow.csv", slow)], [])
    return experiment


def unexplained_of(experiment: Experiment) -> float:
    return dict(unexplained_share(experiment, {}))[1]


def test_a_log_at_half_the_rate_is_simulated_at_the_rate_of_the_controller(axis: tuple[Assembly, Record]) -> None:
    experiment, slow_loop = every_second(axis, 2), every_second(axis, 1)
    assert experiment.own.period == pytest.approx(2.0 * axis[0].sample_period)
    assert experiment.own.one({}).shape == experiment.own.recorded.shape
    assert np.abs(experiment.own.one({})[0]).max() < 0.1 * np.abs(slow_loop.own.one({})[0]).max()
    assert unexplained_of(experiment) < 0.5 * unexplained_of(slow_loop)
    assert of_another_period(experiment, {}) == ""


def test_controllers_decide_a_whole_number_of_times(axis: tuple[Assembly, Record]) -> None:
    assembly, _ = axis
    asked = [decisions_for_each(times * assembly.sample_period, assembly) for times in (0.5, 1.0, 1.25, 2.0, 3.003, 10.0, 11.0)]
    assert asked == [1, 1, 1, 2, 3, 10, 1]
    without_a_loop = machine().assembly
    assert decisions_for_each(2.0 * without_a_loop.sample_period, without_a_loop) == 1


def test_what_was_recorded_is_interpolated_between_the_samples() -> None:
    time = 0.1 * np.arange(60.0)
    signal = Part("recorded_place", LinearSignal.with_units({"signal": "m"}), tables={"recorded": np.sin(time)[:, None]})
    finer = at_controllers_rate(Assembly((signal,), (), 0.1, 0.03), 2)
    assert (finer.sample_period, finer.step) == (0.05, 0.025)
    (part,) = finer.parts
    assert part.tables["recorded"][::2, 0] == pytest.approx(np.sin(time), abs=1e-15)
    gap = np.sin(time)
    gap[20:30] = np.nan
    (held,) = at_controllers_rate(Assembly((replace(part, tables={"recorded": gap[:, None]}),), (), 0.1, 0.03), 2).parts
    assert held.tables["recorded"][:, 0] == pytest.approx(np.repeat(gap, 2)[:-1], nan_ok=True)
    (stairs,) = at_controllers_rate(Assembly((signal,), (), 0.1, 0.03), 2, {"recorded_place"}).parts
    assert stairs.tables["recorded"][:, 0] == pytest.approx(np.repeat(np.sin(time), 2)[:-1])
    assert part.tables["recorded"][11:-11, 0] == pytest.approx(np.sin(0.05 * np.arange(11, 108)), abs=1e-4)
