"""A log that holds every second decision of a controller is held against the loop at its own rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lathesim.diagnosis.recording_checks.sample_clock import of_another_period
from lathesim.diagnosis.recording_checks.unexplained_command import unexplained_share
from lathesim.engine.assembly import Assembly, Part
from lathesim.identification.replay.controller_rate import at_controllers_rate, decisions_for_each
from lathesim.identification.replay.experiment import Experiment, Machine, build_experiments
from lathesim.identification.replay.loading import at_period
from lathesim.identification.replay.recorded_parts import LinearSignal
from lathesim.record import Record
from tests.diagnosis.controlled_axis import POSITION, REFERENCE, VOLTAGE, controlled_axis
from tests.diagnosis.pushed_table import machine


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
    lesson = Machine(at_period(assembly, slow.sample_period), (REFERENCE,), (POSITION, VOLTAGE), {}, {}, decisions=decisions)
    (experiment,) = build_experiments(lesson, [("slow.csv", slow)], [])
    return experiment


def unexplained(experiment: Experiment) -> float:
    return dict(unexplained_share(experiment, {}))[1]


def test_a_log_at_half_the_rate_is_simulated_at_the_rate_of_the_controller(axis: tuple[Assembly, Record]) -> None:
    experiment, slow_loop = every_second(axis, 2), every_second(axis, 1)
    assert experiment.own.period == pytest.approx(2.0 * axis[0].sample_period)
    assert experiment.own.one({}).shape == experiment.own.recorded.shape
    assert np.abs(experiment.own.one({})[0]).max() < 0.1 * np.abs(slow_loop.own.one({})[0]).max()
    assert unexplained(experiment) < 0.5 * unexplained(slow_loop)
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
    assert part.tables["recorded"][11:-11, 0] == pytest.approx(np.sin(0.05 * np.arange(11, 108)), abs=1e-4)
