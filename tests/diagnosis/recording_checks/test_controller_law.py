"""A controller of another law than the lesson's shows in what its command owes to the reference."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from lathesim.diagnosis.recording_checks.controllers import another_law
from lathesim.engine.assembly import FloatArray
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, build_experiments
from lathesim.record import Record
from tests.diagnosis.small_case import REFERENCE, VOLTAGE, controlled_axis


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[RecordedMachine, Record]:
    """An axis under cascade control, with a run of it."""
    return controlled_axis(tmp_path_factory.mktemp("lesson"))


def experiments(machine: RecordedMachine, record: Record, command: FloatArray) -> list[Experiment]:
    """Return the rigs of two recordings in which the controller commanded something else."""
    other = record.with_channel(VOLTAGE, "V", command)
    return build_experiments(machine, [("first.csv", other), ("second.csv", other)], [])


def test_the_controller_of_the_lesson_leaves_nothing(recorded: tuple[RecordedMachine, Record]) -> None:
    machine, record = recorded
    first, second = experiments(machine, record, record[VOLTAGE])
    assert another_law(first, second, {}) == []


def test_noise_on_the_command_is_no_other_law(recorded: tuple[RecordedMachine, Record]) -> None:
    machine, record = recorded
    noise = 0.1 * np.std(record[VOLTAGE]) * np.random.default_rng(1).standard_normal(len(record))
    first, second = experiments(machine, record, record[VOLTAGE] + noise)
    assert another_law(first, second, {}) == []


def test_a_command_that_was_filtered_is(recorded: tuple[RecordedMachine, Record]) -> None:
    machine, record = recorded
    first, second = experiments(machine, record, np.asarray(lfilter([0.3], [1.0, -0.7], record[VOLTAGE])))
    (found,) = another_law(first, second, {})
    assert (found.channel, found.controller) == (VOLTAGE, "x_controller")
    assert 0.01 < found.share < 0.5
    assert str(found).endswith("answers to its reference by another law than the lesson's controller")
    assert not found.feed_forward


def test_a_feed_forward_of_the_speed_is_told_as_one(recorded: tuple[RecordedMachine, Record]) -> None:
    machine, record = recorded
    period = machine.assembly.sample_period
    ahead = 200.0 * np.diff(record[REFERENCE], prepend=record[REFERENCE][0]) / period
    first, second = experiments(machine, record, record[VOLTAGE] + ahead)
    (found,) = another_law(first, second, {})
    assert found.feed_forward
    assert str(found).endswith("as with a feed-forward of its speed (or a reference that was recorded late)")
