"""A column of another axis, or of the other side of a transmission, is the recording's fault, and no missing physics."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis.recording_checks.mapping.another_place import of_another_place
from lathesim.identification.replay.experiment import Machine, build_experiments, quickly_transformed
from lathesim.identification.replay.loading import read_for
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry
from lathesim.record import Record
from tests.diagnosis.controlled_axis import CURRENT, POSITION, REFERENCE, VOLTAGE, controlled_axis
from tests.diagnosis.rigs.cases import schedule, write_case

COMMAND = "x_controller.voltage"


@pytest.fixture(scope="module")
def from_the_motor(tmp_path_factory: pytest.TempPathFactory) -> tuple[Machine, Record, float]:
    """An axis written down from its motor, a sound recording of it, and how far it goes for each radian."""
    case = next(case for case in schedule(1, {"sound": 1}) if case.rig.name == "gear_pid_1k")
    folder = write_case(case, tmp_path_factory.mktemp("rig"))[1]
    registry = load_registry()
    machine, recorded = read_for(prepare(load_lesson(folder / "lesson.yaml"), registry), folder / "fit.csv", registry)
    return machine, recorded.record, case.rig.physics.ratio


def told(machine: Machine, record: Record) -> str:
    return of_another_place(build_experiments(machine, [("run", record)], ())[0], {})


def scaled(record: Record, channel: str, factor: float) -> Record:
    return record.with_channel(channel, record.unit(channel), factor * record[channel])


def test_a_sound_recording_is_of_its_place(from_the_motor: tuple[Machine, Record, float]) -> None:
    machine, record, _ = from_the_motor
    assert told(machine, record) == ""


def test_a_place_that_a_friction_holds_is_no_column_of_the_scale(from_the_motor: tuple[Machine, Record, float]) -> None:
    """A replay without that friction drifts far from both, and the scale is held against the encoder."""
    machine, record, _ = from_the_motor
    pushed = record[COMMAND] + 0.3 * np.sign(np.gradient(record["x_encoder.position"]))
    assert told(machine, record.with_channel(COMMAND, "V", pushed)) == ""


@pytest.mark.parametrize(("unit", "name"), [(1.0, "radians"), (0.5 / np.pi, "turns")])
def test_an_encoder_on_the_motor_mapped_to_the_table(from_the_motor: tuple[Machine, Record, float], unit: float, name: str) -> None:
    machine, record, ratio = from_the_motor
    sentence = told(machine, scaled(record, "x_encoder.position", unit / ratio))
    assert sentence.startswith(f"x_encoder.position is {unit / ratio:.4g} times what its controller was given, as the motion of")
    assert f"x_axis.motor_velocity in {name} is: it was recorded on the other side of the transmission." in sentence
    assert f"Write scale: {ratio / unit:.6g} for its column." in sentence


def test_a_scale_that_no_controller_reads(from_the_motor: tuple[Machine, Record, float]) -> None:
    machine, record, ratio = from_the_motor
    assert told(machine, scaled(record, "x_scale.position", 1.0 / ratio)).startswith("x_scale.position is 250 times what the machine makes")
    assert told(machine, scaled(record, "x_scale.position", 3.0)) == ""


def test_a_transmission_that_the_lesson_does_not_know(tmp_path: Path) -> None:
    """The command follows from the column times a factor, so its controller was given that."""
    machine, record = controlled_axis(tmp_path, (POSITION, VOLTAGE, CURRENT))
    sentence = told(machine, scaled(record, POSITION, 7.0))
    assert sentence == (
        "x_encoder.position is 7 times what its controller was given, so it is in another unit, or of the other side of a transmission. "
        "Write scale: 0.142857 for its column."
    )
    assert "a lost or doubled milli" in told(machine, scaled(record, POSITION, 1e3))


def two_axes(folder: Path) -> tuple[Machine, Record]:
    """Return the shipped axis twice in one machine, the second one led elsewhere, with a sound recording of both."""
    machine, record = controlled_axis(folder)
    record = quickly_transformed(record)
    assembly, asked = machine.assembly, record[REFERENCE]
    led = record.with_channel(REFERENCE, "m", 0.7 * np.sin(np.linspace(0.0, 9.0, len(asked))) * np.ptp(asked))
    run = build_experiments(machine, [("run", led)], ())[0].own.outputs([], np.zeros((1, 0)))[0]
    columns = {REFERENCE: led[REFERENCE], **dict(zip(machine.compare, run, strict=True))}

    def of_z(name: str) -> str:
        return re.sub("^x_", "z_", name)

    for name, values in columns.items():
        record = record.with_channel(of_z(name), record.unit(name), np.asarray(values))
    axis = {part.name for part in assembly.parts if part.name.startswith("x_")}
    parts = tuple(replace(part, name=of_z(part.name)) for part in assembly.parts if part.name in axis)
    wires = tuple(
        replace(wire, target=of_z(wire.target), source=of_z(wire.source) if wire.source else wire.source)
        for wire in assembly.wires
        if wire.target.partition(".")[0] in axis
    )
    both = replace(assembly, parts=(*assembly.parts, *parts), wires=(*assembly.wires, *wires))
    compare = (*machine.compare, *map(of_z, machine.compare))
    return replace(machine, assembly=both, drive=(REFERENCE, of_z(REFERENCE)), compare=compare), record


def test_a_column_of_another_axis(tmp_path: Path) -> None:
    machine, record = two_axes(tmp_path)
    assert told(machine, record) == ""
    of_x, of_z = "x_encoder.position goes where z_controller.reference asks, ", "and not where x_controller.reference does: "
    both = record.with_channel(POSITION, "m", record["z_encoder.position"])
    assert told(machine, both) == f"{of_x}{of_z}the column is of another axis."
    commanded = record.with_channel(VOLTAGE, "V", record["z_controller.voltage"])
    assert told(machine, commanded).startswith("x_controller.voltage is what the machine makes of z_controller.voltage")
