"""A controller with another value than the lesson's is told, with the value that its command follows from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.diagnosis.recording_checks.command_consistency import contradicted
from lathesim.diagnosis.recording_checks.controllers import controller_value, with_commands_followed
from lathesim.identification.replay.experiment import RecordedMachine, build_experiments
from lathesim.identification.replay.loading import Recorded
from lathesim.record import Record
from tests.diagnosis.small_case import VOLTAGE, controlled_axis


@pytest.fixture(scope="module")
def controlled(tmp_path_factory: pytest.TempPathFactory) -> tuple[RecordedMachine, Record]:
    """An axis under cascade control as a lesson has it, and a run of it with a little noise on the command."""
    machine, record = controlled_axis(tmp_path_factory.mktemp("lesson"))
    voltage = record[VOLTAGE] + 1e-3 * np.random.default_rng(1).standard_normal(len(record))
    mass = next(part for part in machine.assembly.parts if part.name == "x_axis").parameters["mass"]
    return replace(machine, uncertain={"x_axis.mass": 0.05 * mass}), record.with_channel(VOLTAGE, "V", voltage)


def with_value(machine: RecordedMachine, name: str, factor: float) -> tuple[RecordedMachine, float]:
    """Return the machine of a lesson whose controller has another value, and the value that the recorded one has."""
    part, _, item = name.partition(".")
    true = next(one for one in machine.assembly.parts if one.name == part).parameters[item]
    parts = tuple(
        replace(one, parameters={**one.parameters, item: factor * true}) if one.name == part else one for one in machine.assembly.parts
    )
    return replace(machine, assembly=replace(machine.assembly, parts=parts)), true


@pytest.mark.parametrize(("item", "factor"), [("velocity_gain", 0.78), ("position_gain", 1.3)])
def test_the_value_of_the_controller_is_found(controlled: tuple[RecordedMachine, Record], item: str, factor: float) -> None:
    machine, record = controlled
    lesson, true = with_value(machine, f"x_controller.{item}", factor)
    first, second = build_experiments(lesson, [("fit", record), ("check", record)], [])
    found = controller_value(first, second, {})
    assert found is not None
    assert found.name == f"x_controller.{item}"
    assert found.value == pytest.approx(true, rel=1e-3)
    assert abs(found.value - true) < 6.0 * found.error
    assert f"x_controller.voltage follows from what its controller was given with x_controller.{item} of" in str(found)
    (right,) = build_experiments(found.in_machine(lesson), [("fit", record)], [])
    assert contradicted(right, {}) == ""


def test_a_controller_that_is_the_lessons_is_left_alone(controlled: tuple[RecordedMachine, Record]) -> None:
    machine, record = controlled
    first, second = build_experiments(machine, [("fit", record), ("check", record)], [])
    assert controller_value(first, second, {}) is None


def test_no_value_explains_a_command_of_the_wrong_sign(controlled: tuple[RecordedMachine, Record]) -> None:
    machine, record = controlled
    turned = record.with_channel(VOLTAGE, "V", -record[VOLTAGE])
    first, second = build_experiments(machine, [("fit", turned), ("check", turned)], [])
    assert controller_value(first, second, {}) is None


def test_the_answer_names_the_value_and_no_physics(controlled: tuple[RecordedMachine, Record]) -> None:
    machine, record = controlled
    lesson, true = with_value(machine, "x_controller.velocity_gain", 0.78)
    question = ask("An axis", lesson, (Recorded("fit.csv", record, ()), Recorded("check.csv", record, ())), ())
    found = diagnose(question)
    assert (found.verdict, found.effects) == ("parameters_only", ())
    assert "x_controller.velocity_gain is further off than the lesson declares possible" in found.sentence
    told = found.baseline["x_controller.velocity_gain"]
    assert told.refit_with == pytest.approx(true, rel=1e-3)
    assert told.low < told.refit_with < told.high
    assert any("x_controller.velocity_gain" in line for line in found.question.findings)
    assert found.location.components == ("x_controller",)
    # before is the lesson as it is written
    assert found.fit[VOLTAGE].before > 10.0 * found.fit[VOLTAGE].after


def test_an_uncertain_value_of_an_integrating_controller_is_fitted_before_anything_is_called_wrong(
    controlled: tuple[RecordedMachine, Record],
) -> None:
    """A hundredth of a gain, added up over a recording, is more than the command; within its uncertainty it is no finding."""
    machine, record = controlled
    lesson, true = with_value(machine, "x_controller.position_gain", 0.99)
    known = replace(lesson, uncertain={**lesson.uncertain, "x_controller.position_gain": 0.02 * true})
    first, second = build_experiments(known, [("fit", record), ("check", record)], [])
    followed = with_commands_followed(first, {"x_controller.position_gain": 0.99 * true})
    assert followed["x_controller.position_gain"] == pytest.approx(true, rel=1e-3)
    assert controller_value(first, second, followed) is None
    assert with_commands_followed(build_experiments(lesson, [("fit", record)], [])[0], {"x_axis.mass": 1.0}) == {"x_axis.mass": 1.0}
