"""A machine made ready to be held against one recording: many runs, residuals, and what a second sensor adds."""

from dataclasses import replace
from pathlib import Path
from textwrap import dedent

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from lathesim.components.sensors import LinearEncoder
from lathesim.effects.effect import Effect
from lathesim.effects.time_shift import ChannelTimeShift, ClockSkew
from lathesim.engine.assembly import Part, Wire
from lathesim.identification.replay.experiment import RecordedMachine, build_experiments
from lathesim.identification.replay.simulator import LOST, RedundantSensor
from lathesim.lessons.lesson import load_lesson
from lathesim.lessons.simulate import prepare
from lathesim.plugins import load_registry
from lathesim.record import Channel, Record
from tests.diagnosis.pushed_table import (
    FORCE,
    MASS,
    PERIOD,
    POSITION,
    RESOLUTION,
    VISCOUS,
    Hidden,
    experiments,
    machine,
    pair,
    recording,
)  # fmt: skip

NAMES = ["x_axis.mass", "x_axis.viscous"]


def test_one_run_a_row() -> None:
    simulator = pair(Hidden())[0].sensed
    rows = np.array([[MASS, VISCOUS], [MASS, 2.0 * VISCOUS], [MASS, VISCOUS]])
    right, slower, again = simulator.outputs(NAMES, rows)
    assert right.shape == (1, simulator.samples)
    assert np.array_equal(right, again)
    assert np.std(slower) < np.std(right)


def test_the_residual_is_recorded_minus_simulated() -> None:
    simulator = pair(Hidden())[0].sensed
    output = simulator.outputs(NAMES, np.array([[MASS, VISCOUS]]))[0]
    assert np.array_equal(simulator.one({"x_axis.mass": MASS, "x_axis.viscous": VISCOUS}), simulator.recorded - output)


def test_nothing_recorded_is_no_residual() -> None:
    record = recording(count=500)
    holes = record[POSITION].copy()
    holes[100:150] = np.nan
    simulator = experiments(record.with_channel(POSITION, "m", holes))[0].sensed
    residual = simulator.one({"x_axis.viscous": 2.0 * VISCOUS})
    assert np.all(residual[0, 100:150] == 0.0)
    assert np.all(np.isfinite(residual))
    assert np.any(residual[0, 200:] != 0.0)


def test_a_run_that_grows_beyond_all_bounds_is_lost_and_not_a_number_at_fault() -> None:
    simulator = pair(Hidden())[0].sensed
    residual = simulator.one({"x_axis.mass": 1e-3, "x_axis.viscous": 1e6})
    assert np.all(np.isfinite(residual))
    assert np.max(np.abs(residual)) == pytest.approx(LOST * simulator.floors[0])


@pytest.mark.parametrize("seconds", [0.3, 2.0], ids=["large numbers", "beyond all numbers"])
def test_the_noise_of_a_lost_run_has_finite_shapes(seconds: float) -> None:
    """A run that grows without bounds is a known outcome: nothing warns, and nothing overflows that is squared."""
    simulator = experiments(recording(count=round(seconds / PERIOD)))[0].sensed
    growing = {"x_axis.mass": 0.05, "x_axis.viscous": -60.0}
    for coloured in (False, True):
        (shapes,) = simulator.noise_shapes(growing, coloured=coloured)
        assert np.all(np.isfinite(shapes.shapes))
    assert np.all(np.isfinite(simulator.impulse_responses(growing)[1]))


def test_the_difference_of_two_lost_channels_is_no_number_and_no_warning() -> None:
    simulator = pair(Hidden())[0].sensed
    lost = np.full((2, simulator.samples), np.inf)
    twice = type(simulator)(simulator.plan, (POSITION, "x_axis.position"), np.zeros_like(lost), np.ones(2), (RedundantSensor(1, 0),))
    assert np.all(np.isnan(twice.as_seen(lost)[1]))
    assert np.all(np.abs(twice.residual_of(twice.as_seen(lost))) > 0.5 * LOST)


def test_a_kick_of_the_speed_moves_the_table_by_its_run_out() -> None:
    simulator = pair(Hidden())[0].sensed
    states, impulse_responses, motion = simulator.impulse_responses({"x_axis.mass": MASS, "x_axis.viscous": VISCOUS})
    assert states == ["x_axis.speed", "x_axis.travel"]
    assert motion.shape == (1, simulator.samples)
    speed, travel = impulse_responses[:, 0]
    assert speed[-1] == pytest.approx(1e-3 * MASS / VISCOUS, rel=1e-6)
    assert travel == pytest.approx(np.full(simulator.samples, 1e-3))


def test_a_second_sensor_of_one_motion_shows_its_difference() -> None:
    first, second = np.array([0.0, 1.0, 2.0]), np.array([0.5, 1.5, 2.8])
    simulator = pair(Hidden())[0].sensed
    twice = type(simulator)(
        simulator.plan, (POSITION, "x_axis.position"), np.array([first, second]), np.array([3.0, 4.0]), (RedundantSensor(1, 0),)
    )
    # less the mean of it: where a sensor has its zero says nothing
    assert twice.seen == pytest.approx(np.array([first, [-0.1, -0.1, 0.2]]))
    assert twice.zeros() == {1: (0, pytest.approx(0.6))}
    assert twice.from_zero_of(np.array([first, first]))[1] == pytest.approx(first + 0.6)
    assert twice.seen_floors == pytest.approx([3.0, 5.0])


def test_a_tachometer_is_expected_to_show_the_speed_of_the_place() -> None:
    time = np.arange(1000) * PERIOD
    sight = RedundantSensor(1, 0, gain=2.0, rate=True)
    expected = sight.expected(np.sin(2.0 * np.pi * time), PERIOD)
    assert expected[50:-50] == pytest.approx((4.0 * np.pi * np.cos(2.0 * np.pi * time))[50:-50], abs=0.02)


def test_a_rig_finds_the_second_sight_of_two_channels_of_one_motion() -> None:
    record = recording(count=500)
    record = record.with_channel("x_axis.position", "m", record[POSITION])
    given = machine()
    both = type(given)(given.assembly, (FORCE,), (POSITION, "x_axis.position"), given.uncertain, given.resolution)
    assert [(sight.row, sight.first, sight.rate) for sight in experiments(record, of=both)[0].sensed.redundant_sensors] == [(1, 0, False)]


def test_small_changes_of_a_value_show_through_a_converter(tmp_path: Path) -> None:
    """Twelve bits of a tachometer did not show how a spindle began, and a sound one was told to warm up."""
    text = """
    lesson: A spindle with a tachometer behind a converter
    machine: torque_spindle
    add: {tachometer_adc: {component: ADConverter, units: {signal: rad/s}, set: {bits: 8}}}
    wires: {tachometer_adc.voltage: tachometer.voltage, tachometer_adc.sensor_gain: tachometer.gain}
    """
    file = tmp_path / "lesson.yaml"
    file.write_text(dedent(text), encoding="utf-8")
    assembly = prepare(load_lesson(file), load_registry(installed=False)).machinery
    time = np.arange(400) * 1e-3
    channels = {
        "spindle.torque": Channel("spindle.torque", "N*m", 0.01 * np.sin(9.0 * time)),
        "tachometer_adc.reading": Channel("tachometer_adc.reading", "rad/s", 30.0 + 0.0 * time),
    }
    machine = RecordedMachine(assembly, ("spindle.torque",), ("tachometer_adc.reading",), {}, {})
    (experiment,) = build_experiments(machine, [("turning", Record(time, channels, {"sample_period": 1e-3}))], [])
    runs = experiment.sensed.outputs(["spindle.rotation"], np.array([[30.0], [30.0 + 1e-4]]))
    assert np.all(np.abs(runs[1][0] - runs[0][0] - 1e-4)[1:20] < 2e-5)


@pytest.mark.parametrize(("effect", "value"), [(ChannelTimeShift, -6.4 * PERIOD), (ClockSkew, -0.01)])
def test_a_channel_that_is_early_is_read_ahead_of_the_run(effect: type[Effect], value: float) -> None:
    """The last three samples do not tell what comes in twelve milliseconds; beyond the last one the residual stays."""
    record, number = recording(count=1500, noise=1e-8), np.arange(1500.0)
    ahead = 6.4 if effect is ChannelTimeShift else 0.01 * number
    early = record.with_channel(POSITION, "m", CubicSpline(number, record[POSITION])(np.minimum(number + ahead, 1499.0)))
    first, _ = build_experiments(machine(), [("a", early), ("b", early)], [effect])
    (name,) = first.candidates[0].parameters
    late, right = (first.sensed.one({"x_axis.mass": MASS, "x_axis.viscous": VISCOUS, name: shift})[0] for shift in (0.0, value))
    assert np.max(np.abs(late)) > 1e-3
    assert np.max(np.abs(right)) < 5e-6
    assert np.ptp(right[-5:]) < 1e-12


def test_a_shift_by_much_of_a_recording_explains_none_of_it() -> None:
    """What comes after the last sample is no match: an explanation that shifts all of a recording there would leave nothing."""
    experiment, _ = build_experiments(machine(), [("a", recording(count=500)), ("b", recording(count=500))], [ChannelTimeShift])
    (name,) = experiment.candidates[0].parameters
    right, far = (experiment.sensed.one({name: shift})[0] for shift in (0.0, -400.0 * PERIOD))
    assert np.std(far) > 100.0 * np.std(right)


def test_a_second_sensor_that_is_early_is_read_ahead_of_the_first(tmp_path: Path) -> None:
    """How fast the table was is recorded: the second sensor shows what the first one does three samples later."""
    record, number = recording(count=800, noise=1e-8), np.arange(800.0)
    scale = np.interp(number + 3.0, number, record[POSITION])
    one = machine().assembly
    parts = (*one.parts, Part("x_scale", LinearEncoder, {"resolution": RESOLUTION}))
    wires = (*one.wires, Wire("x_scale.measured", "x_axis.position"))
    two = replace(machine(), assembly=replace(one, parts=parts, wires=wires), compare=(POSITION, "x_scale.position"))
    both = record.with_channel("x_scale.position", "m", scale)
    first, _ = build_experiments(two, [("a", both), ("b", both)], [ChannelTimeShift])
    candidate = next(one for one in first.candidates if one.at == "x_scale")
    slower = {"x_axis.mass": MASS, "x_axis.viscous": 1.3 * VISCOUS}
    late, right = (first.sensed.one({**slower, candidate.parameters[0]: shift})[1, 10:-4] for shift in (0.0, -3.0 * PERIOD))
    assert np.std(late) > 1e-4
    assert np.std(right) < 3e-6


def test_a_lost_run_is_lost_however_early_its_channel_is() -> None:
    experiment, _ = build_experiments(machine(), [("a", recording(count=500)), ("b", recording(count=500))], [ChannelTimeShift])
    growing = {"x_axis.mass": 1e-3, "x_axis.viscous": 1e6, experiment.candidates[0].parameters[0]: -5.0 * PERIOD}
    assert np.max(np.abs(experiment.sensed.one(growing))) == pytest.approx(LOST * experiment.sensed.floors[0])
