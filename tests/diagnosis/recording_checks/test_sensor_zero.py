"""Motor encoder and table scale have each a zero of their own: that is no physics, whatever could make a constant of it."""

import numpy as np
import pytest

from lathesim.components.axes import LedAxis
from lathesim.components.sensors import LinearEncoder
from lathesim.diagnosis.location import compared
from lathesim.diagnosis.recording_checks.wrong_readings import sensor_zeros
from lathesim.effects.backlash_and_screw import CumulativePitchError, ThermalScrewGrowth
from lathesim.effects.sensor_errors import LostCounts
from lathesim.effects.time_shift import ChannelTimeShift
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.identification.replay.experiment import Experiment, RecordedMachine, build_experiments
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare, run_prepared
from lathesim.plugins import load_registry
from lathesim.record import Channel, Record
from tests.diagnosis.pushed_table import searched
from tests.diagnosis.small_case import write_lesson

REFERENCE, ENCODER, SCALE = "x_controller.reference", "x_encoder.position", "x_scale.position"
COUNT = 50e-9


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[RecordedMachine, Record]:
    """An axis with an encoder at the motor and a scale at the table, and a run of it."""
    prepared = prepare(load_lesson(write_lesson(tmp_path_factory.mktemp("lesson"))), load_registry(installed=False))
    run = run_prepared(prepared)
    asked = run.channels[next(name for name in run.channels if name.endswith("x_reference"))]
    record = Record(run.time, {REFERENCE: asked, ENCODER: run.channels[ENCODER], SCALE: run.channels[SCALE]}, dict(run.meta))
    mass = next(part for part in prepared.machinery.parts if part.name == "x_axis").parameters["mass"]
    return RecordedMachine(
        prepared.machinery, (REFERENCE,), (ENCODER, SCALE), {"x_axis.mass": 0.05 * mass}, {ENCODER: COUNT, SCALE: COUNT}
    ), record


def experiments(recorded: tuple[RecordedMachine, Record], *zeros: float) -> list[Experiment]:
    """Return the rigs of recordings whose scale has its zero elsewhere [m]."""
    machine, record = recorded
    moved = [record.with_channel(SCALE, "m", record[SCALE] + zero) for zero in zeros]
    return build_experiments(
        machine, zip(("fit.csv", "check.csv"), moved, strict=False), (LostCounts, ThermalScrewGrowth, CumulativePitchError)
    )


def test_another_zero_of_a_scale_leaves_nothing_to_explain(recorded: tuple[RecordedMachine, Record]) -> None:
    first, second = experiments(recorded, 3e-6, 4e-4)
    found = searched(first, second)
    assert found.model.candidates == ()
    for experiment in (first, second):
        fits = compared(experiment, [found.baseline.fitted.by_name], found.baseline.fitted.by_name).fit
        assert fits[SCALE].after == pytest.approx(fits[ENCODER].after, abs=2 * COUNT)


def test_a_zero_that_plainly_lies_elsewhere_is_told(recorded: tuple[RecordedMachine, Record]) -> None:
    same, beside = experiments(recorded, 0.0, 4e-4)
    assert sensor_zeros(same) == []
    assert sensor_zeros(beside) == [f"{SCALE} has its zero 0.4 mm beside that of {ENCODER}; taken for no error of either."]


def led_along(zero: float, seed: int) -> Record:
    """Return 10 Hz of a table that is led along a place [m], and of a sensor of 1 um whose zero lies elsewhere."""
    time = np.arange(400) * 0.1
    place = 5e-3 * (1.0 - np.cos(0.3 * seed * time)) + 2e-3 * np.sin(time)
    shown = np.round((place + zero + 0.5e-6 * np.random.default_rng(seed).standard_normal(len(time))) / 1e-6) * 1e-6
    columns = {"x_axis.reference": ("m", place), "x_axis.reference_velocity": ("m/s", np.gradient(place, 0.1)), ENCODER: ("m", shown)}
    return Record(time, {name: Channel(name, *column) for name, column in columns.items()}, {"sample_period": 0.1})


def test_a_constant_beside_the_place_that_a_table_is_led_along_is_the_zero_of_its_sensor() -> None:
    """It was lost counts of 0.2136 mm that explained 100 %, or a shift in time."""
    parts = (Part("x_axis", LedAxis), Part("x_encoder", LinearEncoder, {"resolution": 1e-6}))
    led = {"x_axis.reference": "m", "x_axis.reference_velocity": "m/s"}
    wires = (*(Wire(name, constant=0.0) for name in led), Wire("x_encoder.measured", "x_axis.position"))
    machine = RecordedMachine(Assembly(parts, wires, 0.1, 0.1), tuple(led), (ENCODER,), {"x_axis.mass": 1.0}, {ENCODER: 1e-6})
    records = [("fit.csv", led_along(0.2136e-3, 1)), ("check.csv", led_along(0.2136e-3, 2))]
    first, second = build_experiments(machine, records, (LostCounts, ChannelTimeShift, ThermalScrewGrowth))
    found = searched(first, second)
    assert found.model.candidates == ()
    assert np.std(found.baseline.fitted.residual[0]) < 1e-6
    assert sensor_zeros(first) == [f"{ENCODER} has its zero 0.214 mm beside that of the reference; taken for no error of either."]
    own = first.sensed.from_zero_of(first.own.outputs([], np.zeros((1, 0)))[0])
    assert np.max(np.abs(own[0] - first.own.recorded[0])) < 5e-6


def test_what_is_not_constant_stays(recorded: tuple[RecordedMachine, Record]) -> None:
    """Counts that are lost half way are a step, wherever the zero is."""
    machine, record = recorded
    step = np.where(np.arange(len(record)) < len(record) // 2, 0.0, 20e-6)
    lost = [record.with_channel(SCALE, "m", record[SCALE] + zero + step) for zero in (0.0, 1e-4)]
    found = searched(*build_experiments(machine, zip(("fit.csv", "check.csv"), lost, strict=True), (LostCounts, CumulativePitchError)))
    (candidate,) = found.model.candidates
    assert (candidate.name, candidate.at) == ("LostCounts", "x_scale")
    assert found.model.fitted.by_name[f"{candidate.part}.jump"] == pytest.approx(20e-6, rel=0.01)
