"""Faults of a recording, each put into a sound one and asked about as a person asks: the answer names the fault, and no physics."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.diagnosis import preparation
from lathesim.diagnosis.diagnose import ask, diagnose
from lathesim.diagnosis.records.diagnosis import Diagnosis
from lathesim.engine.assembly import FloatArray
from lathesim.identification.replay.experiment import RecordedMachine, build_experiments, quickly_transformed
from lathesim.identification.replay.loading import Recorded, at_period, read_for
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry
from lathesim.record import Record
from tests.diagnosis.rigs.cases import case_of, write_case
from tests.diagnosis.small_case import CURRENT, POSITION, REFERENCE, VOLTAGE, controlled_axis

AT_FAULT = "The recording itself is at fault; no physics is named from it. "
LATE = "1 sample (1 ms) late: with its rows moved earlier by that x_controller.voltage follows from what its controller was given"
BEHIND, SCALE = "x_dac.voltage", "x_scale.position"
Axis = tuple[RecordedMachine, Record]


def with_bits(machine: RecordedMachine, bits: float) -> RecordedMachine:
    """Return a machine with another converter."""
    parts = [replace(one, parameters={**one.parameters, "bits": bits}) if one.name == "x_dac" else one for one in machine.assembly.parts]
    return replace(machine, assembly=replace(machine.assembly, parts=tuple(parts)))


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> Axis:
    """The shipped axis with a converter of 12 bits, whose mass is uncertain, and a sound recording of it."""
    machine, record = controlled_axis(tmp_path_factory.mktemp("axis"), (POSITION, VOLTAGE, CURRENT))
    mass = next(part for part in machine.assembly.parts if part.name == "x_axis").parameters["mass"]
    return replace(with_bits(machine, 12.0), uncertain={"x_axis.mass": 0.05 * mass}), record


@pytest.fixture(scope="module")
def from_the_motor(tmp_path_factory: pytest.TempPathFactory) -> tuple[RecordedMachine, Record, float]:
    """An axis written down from its motor, a sound recording of it, and how far it goes for each radian."""
    case = case_of("gear_pid_1k", "sound")
    folder = write_case(case, tmp_path_factory.mktemp("rig"))[1]
    registry = load_registry()
    machine, recorded = read_for(prepare(load_lesson(folder / "lesson.yaml"), registry), folder / "fit.csv", registry)
    return machine, recorded.record, case.rig.physics.ratio


@pytest.fixture(scope="module")
def from_a_motor(tmp_path_factory: pytest.TempPathFactory) -> Axis:
    """An axis under a PID controller, and a sound recording of it that ends in motion."""
    folder = write_case(case_of("servo_current_2k", "sound"), tmp_path_factory.mktemp("servo"))[1]
    registry = load_registry()
    machine, recorded = read_for(prepare(load_lesson(folder / "lesson.yaml"), registry), folder / "fit.csv", registry)
    record = recorded.record
    moving = int(np.argmax(np.abs(np.diff(record[POSITION][:4000]))))
    channels = {name: replace(channel, values=channel.values[:moving]) for name, channel in record.channels.items()}
    return machine, Record(record.time[:moving], channels, dict(record.meta))


def answered(machine: RecordedMachine, *records: Record) -> Diagnosis:
    """Return the answer to two recordings, or to one twice, with no effect as a candidate."""
    return diagnose(ask("An axis", machine, [Recorded(f"{place}.csv", records[place % len(records)], ()) for place in (0, 1)], ()))


def changed(record: Record, channel: str, values: FloatArray) -> Record:
    return record.with_channel(channel, record.unit(channel), np.asarray(values))


def levels(voltage: FloatArray) -> FloatArray:
    """Return the levels that a converter of 12 bits gives from -10 to 10 V."""
    step = 20.0 / (2.0**12 - 1.0)
    return np.asarray(-10.0 + step * np.floor((voltage + 10.0) / step + 0.5))


FAULTS: dict[str, tuple[str, Callable[[FloatArray], FloatArray], str]] = {
    "behind the converter": (
        VOLTAGE, levels, "x_controller.voltage holds only the levels of x_dac: the column was recorded behind that converter. Compare "
        "x_dac.voltage with it, and leave x_controller.voltage out.",
    ),
    "counts": (POSITION, lambda x: np.round(x / 50e-9), "x_encoder.position holds whole counts of the encoder, each worth 5e-08 m. "
               "Write unit: counts for its column."),
    "another unit": (POSITION, lambda x: 7.0 * x, "x_encoder.position is 7 times what its controller was given, so it is in another unit, "
                     "or of the other side of a transmission. Write scale: 0.142857 for its column."),
    "sign": (CURRENT, lambda x: -x, "x_drive.current has the other sign than what the machine makes. Write scale: -1 for its column."),
    "late position": (POSITION, lambda x: np.roll(x, 1), f"x_encoder.position is {LATE}"),
    "early position": (POSITION, lambda x: np.roll(x, -2), "x_encoder.position is 2 samples (2 ms) early: with its rows moved later by"),
    "late reference": (REFERENCE, lambda x: np.roll(x, 1), f"x_controller.reference is {LATE}"),
    "late command": (VOLTAGE, lambda x: np.roll(x, 1), f"x_controller.voltage is {LATE}"),
    "another zero": (REFERENCE, lambda x: x - 5e-3, "With 5 mm added to x_controller.reference x_controller.voltage follows"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_a_column_at_fault_is_told_with_what_mends_it(name: str, axis: Axis) -> None:
    """A late row is less than a fifth of the command: it is arithmetic, and tells one sample."""
    channel, spoil, sentence = FAULTS[name]
    found = answered(axis[0], changed(axis[1], channel, spoil(axis[1][channel])))
    assert (found.verdict, found.effects) == ("recording_fault", ())
    assert found.sentence.startswith(AT_FAULT + sentence)


def test_of_a_recording_that_ends_in_motion_the_late_column_is_told(from_a_motor: Axis) -> None:
    """A reading that stands still in its last row makes a large command of a derivative, and blamed the reference."""
    machine, record = from_a_motor
    late = changed(record, POSITION, np.r_[record[POSITION][0], record[POSITION][:-1]])
    assert faults(machine, late).startswith("x_encoder.position is 1 sample (0.5 ms) late")


def test_a_command_and_a_current_that_are_exchanged_are_told(axis: Axis) -> None:
    """A drive of 0.25 A/V. The current is no input of the controller: what that makes of its inputs is in the current's column."""
    machine, record = axis
    found = answered(machine, changed(changed(record, VOLTAGE, 0.25 * record[CURRENT]), CURRENT, record[VOLTAGE]))
    assert found.sentence.startswith(f"{AT_FAULT}{CURRENT} is what the lesson's controller makes of what it was given")


def faults(machine: RecordedMachine, record: Record) -> str:
    """Return the faults that are found before anything is searched."""
    recorded = [Recorded(name, record, ()) for name in ("0.csv", "1.csv")]
    return " ".join(map(str, preparation.prepare(ask("An axis", machine, recorded, ())).faults))


def test_a_sound_recording_is_no_fault_whatever_converter_is_finer_than_it(axis: Axis) -> None:
    """A command that swings from limit to limit lies between the levels of a fine converter too."""
    machine, record = axis
    assert faults(machine, record) == ""
    assert faults(with_bits(machine, 24.0), changed(record, VOLTAGE, np.round(record[VOLTAGE] / 2e-4) * 2e-4)) == ""
    swinging = np.round(np.clip(40.0 * np.sin(0.7 * np.arange(record.time.size)), -10.0, 10.0), 3)
    assert "levels" not in faults(with_bits(machine, 24.0), changed(record, VOLTAGE, swinging))


@pytest.mark.parametrize("before", [False, True])
def test_a_voltage_of_a_converter_holds_its_levels(before: bool, axis: Axis) -> None:
    machine, record = axis
    behind = record.with_channel(BEHIND, "V", record[VOLTAGE] if before else levels(record[VOLTAGE]))
    said = "x_dac.voltage holds what lies between the levels of x_dac: the column was recorded before that converter."
    assert (said in faults(replace(machine, compare=(POSITION, BEHIND)), behind)) == before


@pytest.mark.parametrize(
    ("factor", "sentence"),
    [
        (0.5, "With a sample period of 1 ms x_controller.voltage follows .*off by a factor of 0.5."),
        (1.25, "With a sample period of 1 ms x_controller.voltage follows .*off by a factor of 1.25."),
        (1.005, "x_controller decides every 1 ms, and by the recording's clock every 1.005 ms: that runs 0.50% fast."),
    ],
)
def test_a_wrong_period_is_told_with_the_right_one(factor: float, sentence: str, axis: Axis) -> None:
    """Whatever value of the controller would make up for it: at 1.25 times the period a gain of 0.8 times nearly does."""
    machine, record = axis
    assembly = at_period(machine.assembly, factor * machine.assembly.sample_period)
    wrong = Record(factor * record.time, record.channels, dict(record.meta))
    clock = factor if factor == 1.005 else 1.0  # the reader tells a clock that is a little off
    found = answered(replace(machine, assembly=assembly, clock=clock), wrong)
    assert re.match(re.escape(AT_FAULT) + sentence, found.sentence)


@pytest.mark.parametrize(("channel", "made"), [(POSITION, "its controller was given"), (SCALE, "the machine makes")])
def test_a_reading_on_the_motor_mapped_to_the_table(from_the_motor: tuple[RecordedMachine, Record, float], channel: str, made: str) -> None:
    machine, record, ratio = from_the_motor
    sentence = answered(machine, changed(record, channel, 0.5 / np.pi / ratio * record[channel])).sentence
    assert sentence.startswith(f"{AT_FAULT}{channel} is {0.5 / np.pi / ratio:.4g} times what {made}, as the motion of")
    assert "x_axis.motor_velocity in turns is: it was recorded on the other side of the transmission." in sentence
    scale = re.search(r"Write scale: ([\d.]+) for its column\.", sentence)
    assert scale is not None and float(scale[1]) == pytest.approx(2.0 * np.pi * ratio, rel=1e-4)


def test_a_place_that_a_friction_holds_is_no_column_of_the_scale(from_the_motor: tuple[RecordedMachine, Record, float]) -> None:
    """A replay without that friction drifts far from both, and the scale is held against the encoder."""
    machine, record, _ = from_the_motor
    pushed = record[VOLTAGE] + 0.3 * np.sign(np.gradient(record[POSITION]))
    assert "times" not in faults(machine, changed(record, VOLTAGE, pushed))


def two_axes(folder: Path) -> Axis:
    """Return the shipped axis twice in one machine, the second one led elsewhere, with a sound recording of both."""
    machine, record = controlled_axis(folder)
    record = quickly_transformed(record)
    assembly, asked = machine.assembly, record[REFERENCE]
    led = record.with_channel(REFERENCE, "m", 0.7 * np.sin(np.linspace(0.0, 9.0, len(asked))) * np.ptp(asked))
    run = build_experiments(machine, [("run", led)], ())[0].own.outputs([], np.zeros((1, 0)))[0]

    def of_z(name: str) -> str:
        return re.sub("^x_", "z_", name)

    for name, values in {REFERENCE: led[REFERENCE], **dict(zip(machine.compare, run, strict=True))}.items():
        record = record.with_channel(of_z(name), record.unit(name), np.asarray(values))
    mirrored = {part.name for part in assembly.parts if part.name.startswith("x_")}
    parts = tuple(replace(part, name=of_z(part.name)) for part in assembly.parts if part.name in mirrored)
    wires = tuple(
        replace(wire, target=of_z(wire.target), source=of_z(wire.source) if wire.source else wire.source)
        for wire in assembly.wires
        if wire.target.partition(".")[0] in mirrored
    )
    both = replace(assembly, parts=(*assembly.parts, *parts), wires=(*assembly.wires, *wires))
    return replace(
        machine, assembly=both, drive=(REFERENCE, of_z(REFERENCE)), compare=(*machine.compare, *map(of_z, machine.compare))
    ), record  # fmt: skip


def test_a_column_of_another_axis(tmp_path: Path) -> None:
    machine, record = two_axes(tmp_path)
    of_x, of_z = "x_encoder.position goes where z_controller.reference asks, ", "and not where x_controller.reference does: "
    told = answered(machine, changed(record, POSITION, record["z_encoder.position"])).sentence
    assert told == f"{AT_FAULT}{of_x}{of_z}the column is of another axis."
    told = answered(machine, changed(record, VOLTAGE, record["z_controller.voltage"])).sentence
    assert told.startswith(f"{AT_FAULT}x_controller.voltage is what the machine makes of z_controller.voltage")
