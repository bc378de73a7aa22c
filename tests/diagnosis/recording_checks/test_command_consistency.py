"""A command that does not follow from what its controller was given; and the sample period with which it would."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.components.sensors import DAConverter
from lathesim.diagnosis.recording_checks.command_consistency import contradicted, swapped
from lathesim.diagnosis.recording_checks.sample_clock import of_another_period
from lathesim.diagnosis.recording_checks.wrong_readings import in_another_unit, wrong_unit
from lathesim.effects.offset_and_gain import ScaleFactorError
from lathesim.engine.assembly import FloatArray, Part, Wire
from lathesim.identification.catalogue import insert_candidates
from lathesim.identification.replay.controller_rate import clock_beside
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, build_experiments
from lathesim.identification.replay.loading import at_period
from lathesim.identification.replay.validation_split import parted
from lathesim.record import Record
from tests.diagnosis.one_cut import cut_machine, cut_record
from tests.diagnosis.pushed_table import machine, recording
from tests.diagnosis.small_case import CURRENT, POSITION, VOLTAGE, controlled_axis


@pytest.fixture(scope="module")
def controlled(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    """An axis under cascade control, with a run of it as its recording."""
    machine, record = controlled_axis(tmp_path_factory.mktemp("lesson"))
    (experiment,) = build_experiments(machine, [("run.csv", record)], [])
    return experiment


def with_period(experiment: Experiment, factor: float) -> Experiment:
    """Return the rig of one who takes the sample period for ``factor`` times as long as it is."""
    wrong = Record(factor * experiment.record.time, experiment.record.channels, dict(experiment.record.meta))
    assembly = at_period(experiment.machine.assembly, factor * experiment.machine.assembly.sample_period)
    (found,) = build_experiments(
        RecordedMachine(assembly, experiment.machine.drive, experiment.machine.compare, {}, {}), [("run.csv", wrong)], []
    )
    return found


def test_the_current_of_a_drive_tells_of_a_clock_too(tmp_path: Path) -> None:
    """Of a controller whose command was not logged; the noise of the current is as large as what the clock does to it."""
    machine, record = controlled_axis(tmp_path, (POSITION, CURRENT))
    noise = 0.01 * float(np.std(record[CURRENT])) * np.random.default_rng(1).standard_normal(len(record))
    noisy = record.with_channel(CURRENT, "A", record[CURRENT] + noise)
    (experiment,) = build_experiments(machine, [("run.csv", noisy)], [])
    off = with_period(experiment, 1.005)
    off = replace(off, machine=replace(off.machine, clock=1.005))
    assert of_another_period(off, {}).startswith("x_controller decides every 1 ms, and by the recording's clock every 1.005 ms")
    assert of_another_period(replace(experiment, machine=replace(experiment.machine, clock=1.005)), {}) == ""


def test_of_an_open_loop_the_converter_keeps_the_time() -> None:
    """No command tells which clock is right, and what follows is a speed that is off by as much as the clock."""
    table = machine()
    wires = (*table.assembly.wires, Wire("dac.command", constant=0.0))
    held = replace(table.assembly, parts=(*table.assembly.parts, Part("dac", DAConverter)), wires=wires)
    (experiment,) = build_experiments(replace(table, assembly=held), [("run.csv", recording(count=500))], [])
    assert clock_beside(1.003 * held.sample_period, held) == pytest.approx(1.003)
    sentence = of_another_period(replace(experiment, machine=replace(experiment.machine, clock=1.003)), {})
    assert sentence.startswith("dac decides every ") and "No command tells which of the two is right" in sentence


@pytest.mark.parametrize(("factor", "clock"), [(1.0001, 1.0), (1.25, 1.0), (2.01, 1.005), (0.995, 0.995)])
def test_a_clock_a_little_beside_that_of_the_controller(controlled: Experiment, factor: float, clock: float) -> None:
    assembly = controlled.machine.assembly
    assert clock_beside(factor * assembly.sample_period, assembly) == pytest.approx(clock)
    assert clock_beside(factor * assembly.sample_period, machine().assembly) == 1.0


@pytest.mark.parametrize(("factor", "told"), [(6.27, "turns and radians"), (1e-3, "milli"), (-0.999, "its sign"), (1.2, ""), (4.3, "")])
def test_a_gain_that_a_mistaken_unit_leaves_is_a_fault_of_the_recording(factor: float, told: str) -> None:
    _, candidates = insert_candidates(machine().assembly, (ScaleFactorError,))
    (gain,) = candidates
    sentence = wrong_unit([gain], {f"{gain.part}.factor": factor})
    assert told in sentence
    assert bool(sentence) == bool(told)
    assert not sentence or sentence.startswith("x_encoder reads ")


@pytest.mark.parametrize(
    ("factors", "told"),
    [((1.02, 0.218), True), ((1.02, 0.97), False), ((1.02, 0.5), False), ((1.02, 0.3), False), ((0.22, 0.22), False)],
    ids=["pounds", "newtons", "half of it", "no unit", "another machine"],
)
def test_a_force_in_pounds_beside_one_in_newtons_is_told(factors: tuple[float, float], told: bool) -> None:
    """A part of the main force that the thrust reads would make up for it, were it not for the factor."""
    simulated = np.abs(np.random.default_rng(1).standard_normal((2, 500)))
    recorded = np.array(factors)[:, None] * simulated
    sensed = SimpleNamespace(recorded=recorded, samples=500, one=lambda values: recorded - simulated)
    forces = SimpleNamespace(unit=lambda name: "N")
    experiment: Any = SimpleNamespace(
        sensed=sensed, record=forces, machine=SimpleNamespace(compare=("dynamometer.main", "dynamometer.thrust"))
    )
    sentence = in_another_unit(experiment, {})
    assert sentence.startswith("dynamometer.thrust is 0.218 times what the machine makes") == told
    assert sentence.endswith("the factor of a mistaken unit: pounds and newtons.") == told


def test_a_command_of_the_wrong_sign_is_told_as_one_of_several_faults(controlled: Experiment) -> None:
    record = controlled.record
    late = record.with_channel(VOLTAGE, "V", -record[VOLTAGE])
    (experiment,) = build_experiments(controlled.machine, [("run.csv", late)], [])
    assert "does not follow from what its controller was given: a channel is shifted" in contradicted(experiment, {})


def test_a_command_of_another_law_is_no_fault_unless_most_of_it_is_another_and_no_simple_one(controlled: Experiment) -> None:
    for factor, simple, told in ((0.75, False, False), (0.5, False, True), (0.5, True, False)):
        record = controlled.record.with_channel(VOLTAGE, "V", factor * controlled.record[VOLTAGE])
        (experiment,) = build_experiments(controlled.machine, [("run.csv", record)], [])
        assert "does not follow from what its controller was given" in contradicted(experiment, {})
        assert bool(contradicted(experiment, {}, {VOLTAGE: simple})) == told


def test_a_channel_that_was_recorded_late_is_told_with_its_delay(controlled: Experiment) -> None:
    number = np.arange(len(controlled.record), dtype=float)
    late = np.interp(number - 1.4, number, controlled.record[POSITION])
    (experiment,) = build_experiments(controlled.machine, [("run.csv", controlled.record.with_channel(POSITION, "m", late))], [])
    sentence = contradicted(experiment, {})
    assert "x_encoder.position" in sentence
    assert "(1.4 samples) earlier x_controller.voltage follows" in sentence


def test_two_columns_that_are_exchanged_are_told() -> None:
    """Thrust and feed force of one cut, of one unit."""
    columns = dict.fromkeys(("dynamometer.thrust", "dynamometer.feed"), "N")
    cut = cut_record()
    experiment = parted(cut_machine(), "cut.csv", cut, ())[2]
    assert swapped(experiment, {}) == ""
    pushed, other = 300.0 + 0.0 * cut.time, 90.0 + 0.0 * cut.time
    simulated = np.array([pushed, other])

    def with_recorded(recorded: FloatArray) -> Any:
        sensed = SimpleNamespace(recorded=recorded, one=lambda values: recorded - simulated)
        record = SimpleNamespace(channels={name: SimpleNamespace(unit=unit) for name, unit in columns.items()})
        return SimpleNamespace(sensed=sensed, record=record, machine=SimpleNamespace(compare=tuple(columns)))

    assert swapped(with_recorded(1.1 * simulated), {}) == ""
    assert swapped(with_recorded(1.1 * simulated[::-1]), {}).startswith("dynamometer.thrust and dynamometer.feed look swapped: ")
