"""A factor on a command: of its column, or of the gain of its controller."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lathesim.diagnosis.recording_checks.another_place import of_another_place
from lathesim.diagnosis.recording_checks.controllers import controller_value, with_commands_followed
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, build_experiments
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.record import Record
from tests.diagnosis.recording_checks.test_controller_value import with_value
from tests.diagnosis.small_case import POSITION, REFERENCE, write_lesson

GAIN, BEHIND = "x_controller.proportional", "x_dac.voltage"
P_CONTROL = """\
replace: {x_controller: PositionController}
set: {x_drive.back_emf: 120 V*s/m, x_drive.conductance: 6 A/V, x_controller.proportional: 2100 V/m, x_dac.bits: 16}
"""


@pytest.fixture(scope="module")
def proportional(tmp_path_factory: pytest.TempPathFactory) -> tuple[RecordedMachine, Record]:
    """An axis whose controller is a gain alone, and a run of it, with the command as its converter gives it."""
    prepared = prepare(load_lesson(write_lesson(tmp_path_factory.mktemp("lesson"), "1.2 s", P_CONTROL)), load_registry(installed=False))
    run = run_prepared(prepared)
    asked = run.channels[next(name for name in run.channels if name.endswith("x_reference"))]
    record = Record(run.time, {**{name: run.channels[name] for name in (POSITION, BEHIND)}, REFERENCE: asked}, dict(run.meta))
    return RecordedMachine(prepared.machinery, (REFERENCE,), (POSITION, BEHIND), {}, {}), record


def experiment(machine: RecordedMachine, record: Record) -> Experiment:
    (found,) = build_experiments(machine, [("run.csv", record)], [])
    return found


def test_a_gain_of_the_controller_is_no_factor_on_the_column_of_its_command(proportional: tuple[RecordedMachine, Record]) -> None:
    machine, record = proportional
    lesson, true = with_value(machine, GAIN, 1.0 / 0.7)
    lesson = replace(lesson, uncertain={GAIN: 0.08 * true / 0.7})
    one = experiment(lesson, record)
    assert of_another_place(one, {GAIN: true / 0.7}) == ""
    found = controller_value(one, one, with_commands_followed(one, {GAIN: true / 0.7}))
    assert found is not None
    assert found.name == GAIN
    assert found.value == pytest.approx(true, rel=1e-3)
    assert found.share > 0.3  # with the lesson's gain, and not with the nearest one that it holds possible


def test_a_command_in_another_unit_is_told_as_the_machine_behind_it_follows_from_what_it_was(
    proportional: tuple[RecordedMachine, Record],
) -> None:
    machine, record = proportional
    scaled = record.with_channel(BEHIND, "V", 0.7 * record[BEHIND])
    assert of_another_place(experiment(machine, scaled), {}).startswith(f"{BEHIND} is 0.7 times what its controller was given")
