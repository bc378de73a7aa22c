"""A command that does not follow from what its controller was given; and the sample period with which it would."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lathesim.diagnosis.contradiction import contradicted, wrong_unit
from lathesim.diagnosis.problem import Machine, Rig, build_rigs
from lathesim.diagnosis.terms import insert_candidates
from lathesim.effects.offset_and_gain import ScaleFactorError
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.record import Record
from tests.diagnosis.pushed_table import machine
from tests.diagnosis.small_case import write_lesson

REFERENCE, POSITION, VOLTAGE = "x_controller.reference", "x_encoder.position", "x_controller.voltage"


@pytest.fixture(scope="module")
def controlled(tmp_path_factory: pytest.TempPathFactory) -> Rig:
    """An axis under cascade control, with a run of it as its recording."""
    prepared = prepare(load_lesson(write_lesson(tmp_path_factory.mktemp("lesson"))), load_registry(installed=False))
    run = run_prepared(prepared)
    channels = {name: run.channels[name] for name in (POSITION, VOLTAGE)}
    asked = run.channels[next(name for name in run.channels if name.endswith("x_reference"))]
    record = Record(run.time, {**channels, REFERENCE: asked}, dict(run.meta))
    (rig,) = build_rigs(Machine(prepared.machinery, (REFERENCE,), (POSITION, VOLTAGE), {}, {}), [("run.csv", record)], [])
    return rig


def with_period(rig: Rig, factor: float) -> Rig:
    """Give the rig of one who takes the sample period for ``factor`` times as long as it is."""
    wrong = Record(factor * rig.record.time, rig.record.channels, dict(rig.record.meta))
    assembly = replace(rig.machine.assembly, sample_period=factor * rig.machine.assembly.sample_period)
    (found,) = build_rigs(Machine(assembly, rig.machine.drive, rig.machine.compare, {}, {}), [("run.csv", wrong)], [])
    return found


def test_a_recording_of_the_machine_contradicts_nothing(controlled: Rig) -> None:
    assert contradicted(controlled, {}) == ""


@pytest.mark.parametrize(("factor", "told"), [(0.5, "0.5"), (2.0, "2")])
def test_a_wrong_period_is_told_with_the_right_one(controlled: Rig, factor: float, told: str) -> None:
    sentence = contradicted(with_period(controlled, factor), {})
    right = 1e3 * controlled.machine.assembly.sample_period
    assert sentence.startswith(f"With a sample period of {right:.4g} ms x_controller.voltage follows")
    assert sentence.endswith(f"the time column, or its unit, is off by a factor of {told}.")


@pytest.mark.parametrize(("factor", "told"), [(6.27, "turns and radians"), (1e-3, "milli"), (1.2, ""), (4.3, "")])
def test_a_gain_that_a_mistaken_unit_leaves_is_a_fault_of_the_recording(factor: float, told: str) -> None:
    _, terms = insert_candidates(machine().assembly, (ScaleFactorError,))
    (gain,) = terms
    sentence = wrong_unit([gain], {f"{gain.part}.factor": factor})
    assert told in sentence
    assert bool(sentence) == bool(told)
    assert not sentence or sentence.startswith("x_encoder reads ")


def test_a_shifted_channel_is_told_as_one_of_several_faults(controlled: Rig) -> None:
    record = controlled.record
    late = record.with_channel(VOLTAGE, "V", -record[VOLTAGE])
    (rig,) = build_rigs(controlled.machine, [("run.csv", late)], [])
    assert "does not follow from what its controller was given: a channel is shifted" in contradicted(rig, {})
