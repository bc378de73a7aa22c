"""Controllers, converters and sensors."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lathesim.components.contour_controllers import CrossCouplingController
from lathesim.components.contour_error import ContourError
from lathesim.components.sensors import ADConverter, DAConverter, LinearEncoder, Tachometer, nearest_level
from lathesim.components.servo_controllers import PositionController, SpindleController
from lathesim.components.signals import RecordedSignal
from tests.components.paths import Walk


def test_controller_is_pid() -> None:
    bench = Walk(PositionController, proportional=100.0, integral=10.0, derivative_gain=1.0, measured=0.0)
    assert bench.sample(reference=0.01)["voltage"] == pytest.approx(100 * 0.01 + 10 * 0.01 * 0.005)  # no slope at the first sample
    second = bench.sample(reference=0.02)
    assert second["voltage"] == pytest.approx(100 * 0.02 + 10 * 0.03 * 0.005 + 0.01 / 0.005)
    assert second["error"] == 0.02


def test_integral_stops_while_the_voltage_is_saturated() -> None:
    bench = Walk(PositionController, proportional=100.0, integral=1000.0, measured=0.0)
    for _ in range(200):
        assert bench.sample(reference=1.0)["voltage"] == 10.0
    assert bench.discrete["error_sum"] == 0.0
    assert bench.sample(reference=-0.001)["voltage"] < 0.0  # comes back at once, nothing is wound up


def test_integral_goes_on_where_it_leads_back_from_saturation() -> None:
    bench = Walk(PositionController, proportional=0.0, integral=1000.0, measured=0.0, correction=12.0)
    bench.sample(reference=-0.1)
    assert bench.discrete["error_sum"] == pytest.approx(-0.1 * 0.005)


def test_cross_coupling_is_added_before_saturation() -> None:
    bench = Walk(PositionController, reference=0.0, measured=0.0)
    assert bench.sample(correction=4.0)["voltage"] == 4.0
    assert bench.sample(correction=40.0)["voltage"] == 10.0


def test_spindle_controller_has_the_same_law() -> None:
    bench = Walk(SpindleController, measured=0.0)
    assert bench.sample(reference=50.0) == {"voltage": pytest.approx(0.08 * 50 + 0.4 * 50 * 0.005), "error": 50.0}


def test_levels_of_a_converter() -> None:
    # Liu and Landers (2004): resolution (V_max - V_min)/(2^n - 1); zero volts is no level of a symmetric range
    quantum = 20.0 / 255.0
    assert nearest_level(0.0, -10.0, 10.0, 8.0) == pytest.approx(quantum / 2)
    assert nearest_level(-99.0, -10.0, 10.0, 8.0) == -10.0
    assert nearest_level(99.0, -10.0, 10.0, 8.0) == 10.0
    assert {nearest_level(v / 10, 0.0, 1.0, 1.0) for v in range(11)} == {0.0, 1.0}


@given(voltage=st.floats(-12, 12), bits=st.integers(1, 16))
def test_a_level_is_never_further_than_half_a_step(voltage: float, bits: int) -> None:
    quantum = 20.0 / (2**bits - 1)
    level = nearest_level(voltage, -10.0, 10.0, float(bits))
    inside = min(max(voltage, -10.0), 10.0)
    assert abs(level - inside) <= quantum / 2 + 1e-9
    assert ((level + 10.0) / quantum) == pytest.approx(round((level + 10.0) / quantum), abs=1e-6)
    assert nearest_level(level, -10.0, 10.0, float(bits)) == pytest.approx(level, abs=1e-12)


def test_converters_hold_their_level() -> None:
    assert Walk(DAConverter).sample(command=3.0)["voltage"] == nearest_level(3.0, -10.0, 10.0, 8.0)
    reading = Walk(ADConverter, sensor_gain=0.5).sample(voltage=1.0)
    assert reading["level"] == nearest_level(1.0, -10.0, 10.0, 12.0)
    assert reading["reading"] == 2.0 * reading["level"]


@given(position=st.floats(-1, 1), resolution=st.floats(1e-7, 1e-3))
def test_encoder_counts_to_the_nearest(position: float, resolution: float) -> None:
    reading = Walk(LinearEncoder, resolution=resolution).sample(measured=position)["position"]
    assert abs(reading - position) <= resolution / 2 * (1 + 1e-9)
    assert reading / resolution == pytest.approx(round(reading / resolution), abs=1e-6)


def test_encoder_without_resolution_is_exact() -> None:
    assert Walk(LinearEncoder, resolution=0.0).sample(measured=0.1234567891)["position"] == 0.1234567891


def test_tachometer_adds_its_noises() -> None:
    bench = Walk(Tachometer, gain=0.02, noise=0.1, bias=0.5, ripple=0.2, ripples=4.0)
    assert bench.sample(speed=100.0, angle=math.pi / 8, chance=-1.0)["voltage"] == pytest.approx(2.0 + 0.5 - 0.1 + 0.2)
    assert Walk(Tachometer, gain=0.02).sample(speed=100.0, chance=3.0)["voltage"] == 2.0


def contour(x: float, z: float, **values: float) -> dict[str, float]:
    return Walk(ContourError, x_reference=0.0, z_reference=0.0, x_position=x, z_position=z, **values).sample()


def test_contour_error_of_a_line_is_its_distance() -> None:
    slope = {"direction_x": 0.6, "direction_z": 0.8}
    assert contour(0.0, 0.005, **slope)["contour_error"] == pytest.approx(0.003)  # 5 mm ahead in z: 3 mm beside the line
    assert contour(0.006, 0.008, **slope)["contour_error"] == pytest.approx(0.0)  # along the line costs nothing
    assert contour(0.0, -0.001, direction_x=1.0, direction_z=0.0)["contour_error"] == pytest.approx(-0.001)  # the corner of Example 1


def test_contour_error_of_an_arc_is_positive_outside() -> None:
    circle = {"centre_x": 0.0, "centre_z": -0.01, "radius": 0.01, "direction_x": 1.0, "direction_z": 0.0}
    assert contour(0.0, 0.001, **circle)["contour_error"] == pytest.approx(0.001)
    assert contour(0.0, -0.001, **circle)["contour_error"] == pytest.approx(-0.001)


@given(x=st.floats(-2e-3, 2e-3), z=st.floats(-2e-3, 2e-3), angle=st.floats(0, 2 * math.pi), turn=st.sampled_from([-1.0, 0.0, 1.0]))
def test_a_push_along_the_normal_leads_back(x: float, z: float, angle: float, turn: float) -> None:
    direction_x, direction_z = math.sin(angle), math.cos(angle)
    values = {"direction_x": direction_x, "direction_z": direction_z}
    if turn:
        values |= {"centre_x": turn * 0.02 * direction_z, "centre_z": -turn * 0.02 * direction_x, "radius": 0.02}
    error = contour(x, z, **values)
    back = contour(x + error["deviation"] * error["normal_x"], z + error["deviation"] * error["normal_z"], **values)
    assert back["contour_error"] == pytest.approx(0.0, abs=1e-15)
    assert abs(error["contour_error"]) == abs(error["deviation"])


def test_cross_coupling_splits_its_voltage_along_the_normal() -> None:
    bench = Walk(CrossCouplingController, proportional=250.0, integral=10.0)
    voltages = bench.sample(deviation=0.001, normal_x=0.8, normal_z=-0.6)
    assert voltages["voltage"] == pytest.approx(0.25 + 10 * 0.001 * 0.005)
    assert voltages["x_voltage"] == pytest.approx(0.8 * voltages["voltage"])
    assert voltages["z_voltage"] == pytest.approx(-0.6 * voltages["voltage"])
    for _ in range(100):
        bench.sample(deviation=1.0)
    assert bench.sample(deviation=-0.0005)["voltage"] < 0.0


def test_a_recorded_signal_is_held_or_joined_by_lines() -> None:
    rows = {"samples": [[0.0, 1.0], [0.01, 2.0], [0.02, 4.0]]}
    held, joined = Walk(RecordedSignal, rows), Walk(RecordedSignal, rows, interpolation=1.0)
    assert [held.sample()["signal"] for _ in range(6)] == [1.0, 1.0, 2.0, 2.0, 4.0, 4.0]
    # the walk's clock moves on after the update, so lines are seen half a row later
    assert [joined.sample()["signal"] for _ in range(5)] == pytest.approx([1.5, 2.0, 3.0, 4.0, 4.0])
