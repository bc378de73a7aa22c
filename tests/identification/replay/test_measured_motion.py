"""How a part really moved, from what its sensor recorded: without lag, and with the velocity of the position."""

import math

import numpy as np
import pytest

from lathesim.components.contour_error import ContourError
from lathesim.effects.backlash_and_screw import Backlash
from lathesim.identification.replay.measured_motion import counted_motion, measured_output, recorded_motion, smooth, velocity_of
from lathesim.lessons.insertion import insert_effect
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
    parts = {part.name: part for part in assembly.parts}
    wires = {wire.target: wire for wire in assembly.wires}
    assert measured_output(parts, wires, POSITION) == "x_axis.position"
    assert measured_output(parts, wires, "x_axis.velocity") == "x_axis.velocity"


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
    parts = {part.name: part for part in lathe.parts}
    wires = {wire.target: wire for wire in lathe.wires}
    names = [f"{part.name}.{part.component.ports['reading']}" for part in lathe.parts if part.component is ContourError]
    assert names
    assert [measured_output(parts, wires, name) for name in names] == names
