"""A column on the other side of a converter, in counts or with the other sign is the recording's fault, and no missing physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lathesim.component import Parameter
from lathesim.diagnosis.recording_checks.mapping.mapped_elsewhere import has_other_sign, mapped_elsewhere
from lathesim.engine.assembly import FloatArray
from lathesim.identification.replay.experiment import Experiment, Machine, build_experiments
from lathesim.record import Record
from tests.diagnosis.controlled_axis import CURRENT, POSITION, REFERENCE, VOLTAGE, controlled_axis

BEHIND = "x_dac.voltage"


@pytest.fixture(scope="module")
def axis(tmp_path_factory: pytest.TempPathFactory) -> tuple[Machine, Record]:
    """The shipped axis with a converter of 12 bits, and a sound recording of it."""
    machine, record = controlled_axis(tmp_path_factory.mktemp("axis"), (POSITION, VOLTAGE, CURRENT))
    parts = [
        replace(part, parameters={**part.parameters, "bits": 12.0}) if part.name == "x_dac" else part for part in machine.assembly.parts
    ]
    return replace(machine, assembly=replace(machine.assembly, parts=tuple(parts))), record


def held(machine: Machine, voltage: FloatArray) -> FloatArray:
    """Return the levels that a converter from -10 to 10 V gives."""
    bits = next(part for part in machine.assembly.parts if part.name == "x_dac").parameters["bits"]
    step = 20.0 / (2.0**bits - 1.0)
    return np.asarray(-10.0 + step * np.floor((voltage + 10.0) / step + 0.5))


def made(machine: Machine, record: Record) -> Experiment:
    return build_experiments(machine, [("run", record)], ())[0]


def test_a_sound_recording_is_mapped_well(axis: tuple[Machine, Record]) -> None:
    assert mapped_elsewhere(made(*axis), {}) == ""


def test_a_command_that_was_recorded_behind_the_converter(axis: tuple[Machine, Record]) -> None:
    machine, record = axis
    behind = record.with_channel(VOLTAGE, "V", held(machine, record[VOLTAGE]))
    assert mapped_elsewhere(made(machine, behind), {}) == (
        "x_controller.voltage holds only the levels of x_dac: the column was recorded behind that converter. "
        "Compare x_dac.voltage with it, and leave x_controller.voltage out."
    )


def test_a_converter_finer_than_the_recording_tells_nothing(axis: tuple[Machine, Record]) -> None:
    machine, record = axis
    parts = [
        replace(part, parameters={**part.parameters, "bits": 24.0}) if part.name == "x_dac" else part for part in machine.assembly.parts
    ]
    fine = replace(machine, assembly=replace(machine.assembly, parts=tuple(parts)))
    logged = record.with_channel(VOLTAGE, "V", np.round(record[VOLTAGE] / 2e-4) * 2e-4)
    assert mapped_elsewhere(made(fine, logged), {}) == ""


def test_a_command_that_swings_from_limit_to_limit_lies_between_the_levels_of_a_fine_converter(axis: tuple[Machine, Record]) -> None:
    """A machine whose loop swings keeps its command at the ends of the converter, which are levels of any converter."""
    machine, record = axis
    parts = [
        replace(part, parameters={**part.parameters, "bits": 24.0}) if part.name == "x_dac" else part for part in machine.assembly.parts
    ]
    fine = replace(machine, assembly=replace(machine.assembly, parts=tuple(parts)))
    swinging = np.clip(40.0 * np.sin(0.7 * np.arange(record.time.size)), -10.0, 10.0)
    assert mapped_elsewhere(made(fine, record.with_channel(VOLTAGE, "V", np.round(swinging, 3))), {}) == ""


def test_a_command_that_was_recorded_before_the_converter(axis: tuple[Machine, Record]) -> None:
    machine, record = axis
    shown = replace(machine, compare=(POSITION, BEHIND))
    levels = held(machine, record[VOLTAGE])
    assert mapped_elsewhere(made(shown, record.with_channel(BEHIND, "V", levels)), {}) == ""
    assert mapped_elsewhere(made(shown, record.with_channel(BEHIND, "V", record[VOLTAGE])), {}).startswith(
        "x_dac.voltage holds what lies between the levels of x_dac: the column was recorded before that converter."
    )


def test_counts_of_the_encoder(axis: tuple[Machine, Record]) -> None:
    machine, record = axis
    encoder = next(part for part in machine.assembly.parts if part.name == "x_encoder")
    count = float(encoder.parameters.get("resolution", encoder.component.declared(Parameter)["resolution"].default))
    counted = record.with_channel(POSITION, "m", np.round(record[POSITION] / count))
    sentence = f"x_encoder.position holds whole counts of the encoder, each worth {count:.4g} m. Write unit: counts for its column."
    assert mapped_elsewhere(made(machine, counted), {}) == sentence


def test_a_sign_that_is_turned_round(axis: tuple[Machine, Record]) -> None:
    machine, record = axis
    turned = record.with_channel(CURRENT, "A", -record[CURRENT])
    sentence = "x_drive.current has the other sign than what the machine makes. Write scale: -1 for its column."
    assert mapped_elsewhere(made(machine, turned), {}) == sentence


def test_a_place_that_drifts_the_other_way_has_no_other_sign() -> None:
    """A replay of an open loop drifts: it may end on the other side of zero while all its motions go the right way."""
    time = np.linspace(0.0, 3.0, 3000)
    motion = 1e-4 * np.sin(30.0 * time)
    assert not has_other_sign(7e-3 + motion, -5e-3 - 8e-3 * time + motion)
    assert has_other_sign(7e-3 + motion, -5e-3 - 8e-3 * time - motion)


@pytest.mark.parametrize(
    ("channel", "rows", "told"),
    [
        (POSITION, 1, "x_encoder.position is 1 sample (1 ms) late: with its rows moved earlier"),
        (REFERENCE, 1, "x_controller.reference is 1 sample (1 ms) late: with its rows moved earlier"),
        (VOLTAGE, 1, "x_controller.voltage"),
        (POSITION, -2, "x_encoder.position is 2 samples (2 ms) early: with its rows moved later"),
    ],
    ids=["position", "reference", "command", "early"],
)
def test_rows_that_are_shifted(axis: tuple[Machine, Record], channel: str, rows: int, told: str) -> None:
    """Far less than a fifth of the command does not follow: it is arithmetic, and tells one sample."""
    machine, record = axis
    shifted = record.with_channel(channel, record.unit(channel), np.roll(record[channel], rows))
    sentence = mapped_elsewhere(made(machine, shifted), {})
    assert told in sentence
    assert sentence.endswith("(ChannelTimeShift).")
