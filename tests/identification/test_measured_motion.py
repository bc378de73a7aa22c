"""What a replay takes from the recorded motion, and how fast a part moved between the counts of its encoder."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from lathesim.components.axes import EmpiricalAxis
from lathesim.components.contour_error import ContourError
from lathesim.components.sensors import ADConverter, DAConverter, LinearEncoder, Tachometer
from lathesim.components.servo_controllers import SpindleController
from lathesim.components.spindles import EmpiricalSpindle
from lathesim.diagnosis.location import passed_through
from lathesim.diagnosis.recording_checks.command_consistency import contradicted
from lathesim.effects.backlash_and_screw import Backlash
from lathesim.engine.assembly import Assembly, Part, Wire
from lathesim.engine.run import run
from lathesim.engine.wiring import wire
from lathesim.identification.catalogue import insert_candidates
from lathesim.identification.replay import experiment as problem
from lathesim.identification.replay.converter_rounding import plain_replay
from lathesim.identification.replay.experiment import Experiment, RecordedMachine
from lathesim.identification.replay.measured_motion import counted_motion, measured_output, recorded_motion, smooth, velocity_of
from lathesim.identification.replay.open_loop import drive, follow
from lathesim.lessons.insertion import insert_effect
from lathesim.lessons.lesson import load_machine
from lathesim.lessons.simulate import check_machine
from lathesim.plugins import Registry
from lathesim.record import Record
from tests.diagnosis.pushed_table import PERIOD, POSITION, machine
from tests.shipped_machine import shipped_machine

TIME = np.arange(2000) * PERIOD
PLACE = 0.05 * np.sin(2.0 * math.pi * 1.5 * TIME)
SPEED = 0.05 * 2.0 * math.pi * 1.5 * np.cos(2.0 * math.pi * 1.5 * TIME)
INSIDE = slice(50, -50)


def test_smoothing_has_no_lag() -> None:
    assert np.max(np.abs(smooth(PLACE, PERIOD) - PLACE)[INSIDE]) < 1e-6


def test_smoothing_takes_noise_away() -> None:
    noise = np.random.default_rng(0).standard_normal(len(TIME))
    assert np.std(smooth(noise, PERIOD)) < 0.75


@pytest.mark.parametrize("count", [3, 17, 151, 2000])
def test_smoothing_is_a_low_pass_of_second_order_both_ways(count: int) -> None:
    walk, rate = np.cumsum(np.random.default_rng(0).standard_normal(count)), 1.0 / PERIOD
    cutoff = min(100.0, 0.2 * rate)
    sections = butter(2, cutoff / (0.5 * rate), output="sos")
    expected = sosfiltfilt(sections, walk, padlen=min(count - 2, int(3 * rate / cutoff)))
    assert np.array_equal(smooth(walk, PERIOD), expected)


def test_rows_that_are_filtered_together_are_filtered_as_each_by_itself() -> None:
    rows = np.cumsum(np.random.default_rng(3).standard_normal((3, 200)), axis=1)
    assert np.array_equal(velocity_of(rows, PERIOD), [velocity_of(row, PERIOD) for row in rows])


def test_the_velocity_of_a_quantised_position() -> None:
    seen = np.round(PLACE / 1e-6) * 1e-6
    assert np.max(np.abs(velocity_of(seen, PERIOD) - SPEED)[INSIDE]) < 2e-3 * np.max(np.abs(SPEED))


def test_an_encoder_tells_position_and_velocity_of_its_host() -> None:
    motion = recorded_motion(machine().assembly, {POSITION: PLACE})
    assert set(motion) == {"x_axis.position", "x_axis.velocity"}
    assert motion["x_axis.velocity"][INSIDE] == pytest.approx(SPEED[INSIDE], abs=1e-3)


def test_a_recorded_velocity_tells_the_position_too() -> None:
    motion = recorded_motion(machine().assembly, {"x_axis.velocity": SPEED})
    moved = motion["x_axis.position"] - motion["x_axis.position"][100]
    in_one_sample = float(np.max(np.abs(SPEED))) * PERIOD
    assert moved[INSIDE] == pytest.approx((PLACE - PLACE[100])[INSIDE], abs=in_one_sample)


def test_a_channel_with_holes_tells_nothing() -> None:
    holes = PLACE.copy()
    holes[10] = np.nan
    assert recorded_motion(machine().assembly, {POSITION: holes}) == {}


def test_a_sensor_shows_its_host_past_effects_in_between() -> None:
    assembly = insert_effect(machine().assembly, Backlash, "x_encoder")
    assembly = insert_effect(machine().assembly, Backlash, "x_encoder")
    assert measured_output(assembly, POSITION) == "x_axis.position"
    assert measured_output(assembly, "x_axis.velocity") == "x_axis.velocity"


def test_the_volts_of_a_tachometer_are_no_speed() -> None:
    """A bench recorded while it turned began at the volts of its tachometer, taken for radians a second."""
    laboratory = shipped_machine("torque_spindle")
    gain = next(part.component for part in laboratory.parts if part.name == "tachometer").declarations["gain"].default  # type: ignore[attr-defined]
    turned = 40.0 * np.arange(2000) * laboratory.sample_period
    alone = recorded_motion(laboratory, {"tachometer.voltage": np.full(2000, 40.0 * gain)})
    assert alone["spindle.speed"] == pytest.approx(40.0)
    assert alone["spindle.angle"] == pytest.approx(turned)
    # a gain may be wrong: the encoder tells the speed where there is one
    for names in (("spindle_encoder.angle", "tachometer.voltage"), ("tachometer.voltage", "spindle_encoder.angle")):
        values = {"spindle_encoder.angle": turned, "tachometer.voltage": np.full(2000, 44.0 * gain)}
        both = recorded_motion(laboratory, {name: values[name] for name in names})
        assert both["spindle.speed"][INSIDE] == pytest.approx(40.0)
        assert both["spindle.angle"][INSIDE] == pytest.approx(turned[INSIDE])


def test_a_cut_goes_on_at_the_speed_that_a_tachometer_showed() -> None:
    """The force of a lathe drifted away with the speed of its replayed spindle."""
    laboratory = shipped_machine("torque_spindle")
    gain = next(part.component for part in laboratory.parts if part.name == "tachometer").declarations["gain"].default  # type: ignore[attr-defined]
    assert counted_motion(laboratory, {"tachometer.voltage": np.full(2000, 40.0 * gain)})["spindle.speed"] == pytest.approx(40.0)


def test_a_converter_behind_a_tachometer_tells_the_speed_too() -> None:
    lathe = shipped_machine("two_axis_lathe_analytical")
    converter = next(part.name for part in lathe.parts if part.name == "tachometer_adc")
    motion = recorded_motion(lathe, {f"{converter}.reading": np.full(2000, 40.0)})
    assert motion["spindle.speed"] == pytest.approx(40.0)


def test_the_voltage_of_a_controller_is_no_place() -> None:
    """A controller reads an encoder and gives a command: followed back through both it was taken for the way of the table."""
    axis = shipped_machine("cascade_axis")
    motion = recorded_motion(axis, {"x_controller.voltage": 300.0 * SPEED, "x_encoder.position": PLACE})
    assert motion["x_axis.position"][INSIDE] == pytest.approx(PLACE[INSIDE], abs=1e-5)
    assert recorded_motion(axis, {"x_controller.voltage": 300.0 * SPEED}) == {}


def test_the_rate_that_an_encoder_makes_of_its_counts_is_the_speed() -> None:
    """A log of a drive often has nothing else: as long as nobody knew whose speed it was, no friction could sense the recorded motion."""
    laboratory = shipped_machine("torque_spindle")
    motion = recorded_motion(laboratory, {"spindle_encoder.rate": np.full(2000, 40.0)})
    assert motion["spindle.speed"] == pytest.approx(40.0)


def test_a_part_that_measures_nothing_shows_itself() -> None:
    """The contour error of a lathe is worked out of two axes: no machine part stands behind it."""
    lathe = shipped_machine("two_axis_lathe_analytical")
    names = [f"{part.name}.{part.component.ports['reading']}" for part in lathe.parts if part.component is ContourError]
    assert names
    assert [measured_output(lathe, name) for name in names] == names


MACHINES = Path(__file__).parents[2] / "lesson_configs" / "machines"
AXES = ("cascade_axis", "force_axis", "voltage_axis", "torque_spindle")
FEED_RATE = 2e-3


def assembly_of(name: str, registry: Registry) -> Assembly:
    return check_machine(load_machine(MACHINES / f"{name}.yaml"), registry).assembly


def followed(assembly: Assembly, outputs: tuple[str, ...]) -> dict[str, str]:
    """Return what takes the recorded motion instead of the simulated one: input -> output."""
    before = {item.target: item.source for item in assembly.wires}
    after = follow(assembly, {output: np.zeros(10) for output in outputs})
    return {item.target: before[item.target] for item in after.wires if item.source.startswith("followed_")}


def test_stock_and_cut_of_a_lathe_take_the_recorded_motion(registry: Registry) -> None:
    filled, _ = insert_candidates(assembly_of("two_axis_lathe", registry), registry.effects.values())  # type: ignore[arg-type]
    found = followed(filled, ("x_axis.position", "z_axis.position", "x_axis.velocity", "z_axis.velocity"))
    assert {"stock.x_position", "stock.z_position"} <= set(found)
    assert {target.partition(".")[0] for target in found} <= {"stock", "cutting", "load", "surface_finish"}


@pytest.mark.parametrize("name", AXES)
def test_no_sensor_drive_or_effect_of_an_axis_does(name: str, registry: Registry) -> None:
    """A scale that was shown the recorded motion of its table had no error any more."""
    filled, candidates = insert_candidates(assembly_of(name, registry), registry.effects.values())  # type: ignore[arg-type]
    assert candidates
    moving = [part for part in filled.parts if {"displacement", "flow"} <= set(part.component.ports)]
    outputs = tuple(f"{part.name}.{part.component.ports[role]}" for part in moving for role in ("displacement", "flow"))
    assert followed(filled, outputs) == {}


def test_a_feed_is_as_steady_as_its_counts_allow() -> None:
    """One count of 1 um a sample of 2 ms is 0.5 mm/s: a quarter of the feed, and next to nothing of it once smoothed."""
    time = np.arange(5000) * PERIOD
    noise = 0.3e-6 * np.random.default_rng(1).standard_normal(len(time))
    feed = counted_motion(machine().assembly, {POSITION: FEED_RATE * time + noise})["x_axis.velocity"][500:-500]
    assert np.std(feed) < 0.005 * FEED_RATE
    assert np.mean(feed) == pytest.approx(FEED_RATE, rel=1e-3)


def test_a_quick_motion_is_smoothed_no_more_than_it_has_to_be() -> None:
    time = np.arange(5000) * PERIOD
    place = 0.01 * np.sin(2.0 * math.pi * 3.0 * time) + 1e-8 * np.random.default_rng(1).standard_normal(len(time))
    feed = counted_motion(machine().assembly, {POSITION: place})["x_axis.velocity"]
    speed = 0.01 * 2.0 * math.pi * 3.0 * np.cos(2.0 * math.pi * 3.0 * time)
    assert np.max(np.abs(feed - speed)[200:-200]) < 0.01 * np.max(np.abs(speed))


def test_no_recorded_signal_is_a_suspect(registry: Registry) -> None:
    """The chain of a force named the recorded way of the slide among the parts that make it."""
    lathe = assembly_of("two_axis_lathe", registry)
    after = follow(lathe, {"x_axis.position": np.zeros(10), "z_axis.velocity": np.zeros(10)})
    parts = passed_through(wire(replace(after, finish="")), "cutting_force.cutting_force")
    assert "cutting" in parts
    assert not any(name.startswith("followed_") for name in parts)
    assert any(part.name.startswith("followed_") for part in after.parts)


SLOW, SAMPLES = 5e-3, 2000
REFERENCE, SPINDLE_SPEED = "controller.reference", "spindle.speed"


def spindle() -> Assembly:
    """Return a spindle whose speed is read in steps of 20 rpm."""
    parts = (
        Part("tachometer", Tachometer),
        Part("adc", ADConverter.with_units({"signal": "rad/s"}), {"bits": 10.0}),
        Part("controller", SpindleController),
        Part("dac", DAConverter, {"bits": 12.0}),
        Part("spindle", EmpiricalSpindle),
    )
    fed = {
        "tachometer.speed": SPINDLE_SPEED, "adc.voltage": "tachometer.voltage", "adc.sensor_gain": "tachometer.gain",
        "controller.measured": "adc.reading", "dac.command": "controller.voltage", "spindle.voltage": "dac.voltage",
    }  # fmt: skip
    wires = (Wire(REFERENCE, constant=0.0), *[Wire(target, source) for target, source in fed.items()])
    return Assembly(parts, wires, SLOW, 0.5 * SLOW, record=(SPINDLE_SPEED,))


def test_what_a_converter_rounds_does_not_add_up_in_an_integral(monkeypatch: pytest.MonkeyPatch) -> None:
    time = SLOW * np.arange(SAMPLES)
    asked = 100.0 + 10.0 * np.sign(np.sin(0.9 * time)) + 3.0 * np.sin(2.3 * time)
    made = run(wire(drive(spindle(), {REFERENCE: asked})), duration=(SAMPLES - 1) * SLOW)
    record = Record(time, {}, {}).with_channel(SPINDLE_SPEED, "rad/s", made[SPINDLE_SPEED]).with_channel(REFERENCE, "rad/s", asked)
    experiment = Experiment(RecordedMachine(spindle(), (REFERENCE,), (SPINDLE_SPEED,), {}, {}), record, "run", (), spindle())
    parts = passed_through(experiment.sensed.plan, experiment.sensed.channels[0])
    assert {"adc", "dac", "controller"} <= set(parts)
    assert not any(name.startswith(("rounding_", "rounded_")) for name in parts)
    step = 20.0 / 1023.0 / Tachometer.declarations["gain"].default
    assert np.std(experiment.sensed.one({})[0]) < 0.1 * step
    monkeypatch.setattr(problem, "plain_replay", lambda *given, **_: {})
    assert np.std(replace(experiment).sensed.one({})[0]) > step


def test_nothing_is_run_where_no_sensor_is_rounded() -> None:
    parts = tuple(part for part in spindle().parts if part.name in ("dac", "spindle"))
    wires = (Wire("dac.command", constant=1.0), Wire("spindle.voltage", "dac.voltage"))
    assert plain_replay(Assembly(parts, wires, SLOW, SLOW), [], 10, [SPINDLE_SPEED]) == {}


def test_a_feed_that_swings_between_two_voltages_is_known_from_them() -> None:
    """Steps of 78 mV make 1.5 mm/s of this drive; the encoder's count of 1 um is 0.2 mm/s a sample."""
    volts = 0.08 + 0.078 * np.sign(np.sin(2.0 * np.pi * 11.0 * SLOW * np.arange(SAMPLES)))
    parts = (Part("x_axis", EmpiricalAxis, {"disturbance_gain": 0.0}), Part("x_encoder", LinearEncoder, {"resolution": 1e-6}))
    wires = (Wire("x_axis.voltage", constant=0.0), Wire("x_encoder.measured", "x_axis.position"))
    outputs = ("x_encoder.position", "x_axis.position", "x_axis.velocity")
    bare = Assembly(parts, wires, SLOW, 0.5 * SLOW, record=outputs)
    made = run(wire(drive(bare, {"x_axis.voltage": volts})), duration=(SAMPLES - 1) * SLOW)
    recorded = {"x_encoder.position": made["x_encoder.position"]}
    plainly = {name: 1.02 * made[name] for name in outputs[1:]}  # the gain of the lesson is a little off
    alone, beside = (counted_motion(bare, recorded, modelled)["x_axis.velocity"] for modelled in (None, plainly))
    off = [float(np.std((speed - made["x_axis.velocity"])[200:-200])) for speed in (alone, beside)]
    assert off[1] < 0.1 * off[0]


def test_a_command_that_follows_from_what_a_converter_read_is_no_fault_of_the_recording() -> None:
    """What the converter made of the noise before it went into the command, and was not recorded: here half of it."""
    time = SLOW * np.arange(SAMPLES)
    asked, command = np.full(SAMPLES, 100.0), "dac.voltage"
    rng = np.random.default_rng(1)
    record = Record(time, {}, {}).with_channel(SPINDLE_SPEED, "rad/s", asked).with_channel(REFERENCE, "rad/s", asked)
    record = record.with_channel(command, "V", 3.83 + 0.05 * rng.standard_normal(SAMPLES))
    machine = RecordedMachine(spindle(), (REFERENCE,), (SPINDLE_SPEED, command), {}, {})
    assert contradicted(Experiment(machine, record, "run", (), spindle()), {}) == ""
    direct = tuple(part for part in spindle().parts if part.name not in ("tachometer", "adc"))
    wires = [item for item in spindle().wires if item.target.partition(".")[0] not in ("tachometer", "adc", "controller")]
    wires += [Wire(REFERENCE, constant=0.0), Wire("controller.measured", SPINDLE_SPEED)]
    without = replace(spindle(), parts=direct, wires=tuple(wires))
    assert f"of {command} does not follow" in contradicted(Experiment(replace(machine, assembly=without), record, "run", (), without), {})
