"""Both interpolators: times, points on the path, changes of speed while cutting."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lathesim.components.accelerating_interpolators import ConstantAccelerationInterpolator, ramp_time, ramp_way
from lathesim.components.interpolator import ConstantVelocityInterpolator
from lathesim.path_columns import TAP_OUT, THREAD, THREAD_ON
from tests.components.paths import EXAMPLE_1, RPM, SAMPLE_PERIOD, Walk, line, polyline, row

BOTH = pytest.mark.parametrize("component", [ConstantVelocityInterpolator, ConstantAccelerationInterpolator])


def walk(component: type, path: list[list[float]], **inputs: float) -> list[dict[str, float]]:
    return Walk(component, {"path": path}).to_the_end(**inputs)


def test_example_1_takes_18_480_seconds_at_constant_velocity() -> None:
    assert len(walk(ConstantVelocityInterpolator, EXAMPLE_1)) - 1 == 3696  # Liu and Landers (2004), Table 1: 18.48 s


def test_example_1_takes_28_830_seconds_with_ramps() -> None:
    samples = walk(ConstantAccelerationInterpolator, EXAMPLE_1)
    assert len(samples) - 1 == 5766  # published as 27.8 s, a misprint of 28.8 s


@BOTH
def test_first_reference_is_the_start_and_each_block_ends_on_its_point(component: type) -> None:
    samples = walk(component, EXAMPLE_1)
    assert (samples[0]["x_reference"], samples[0]["z_reference"], samples[0]["feed_speed"]) == (0.0, 0.0, 0.0)
    points = {(round(s["x_reference"] * 1000, 9), round(s["z_reference"] * 1000, 9)) for s in samples}
    assert {(15, 10), (15, 30), (17, 40), (17, 50), (20, 50), (20, 0), (0, 0)} <= points


def test_a_block_is_cut_into_samples_of_equal_length() -> None:
    samples = walk(ConstantVelocityInterpolator, polyline((0, 10, 180)))  # 10 mm at 3 mm/s: 666.7 samples, so 667
    steps = [b["z_reference"] - a["z_reference"] for a, b in itertools.pairwise(samples)]
    assert len(steps) == 667
    assert max(steps) == pytest.approx(0.01 / 667, rel=1e-9) == min(steps)


@BOTH
@settings(max_examples=6)
@given(feed=st.floats(60, 3000), x=st.floats(0.1, 4), z=st.floats(0.1, 4), override=st.floats(0.2, 2))
def test_any_line_ends_on_its_point_and_never_turns_back(component: type, feed: float, x: float, z: float, override: float) -> None:
    samples = walk(component, polyline((x, z, feed)), feed_override=override)
    ways = [math.hypot(s["x_reference"], s["z_reference"]) for s in samples]
    assert all(b >= a - 1e-15 for a, b in itertools.pairwise(ways))
    assert (samples[-1]["x_reference"], samples[-1]["z_reference"]) == (x / 1000, z / 1000)
    assert max(s["feed_speed"] for s in samples) <= feed / 60e3 * override * (1 + 1e-9)


def test_ramp_is_a_trapezoid_or_a_triangle() -> None:
    assert ramp_time(0.020, 0.0, 0.002, 0.01) == pytest.approx(10.0 + 0.2)
    assert ramp_time(0.050, 0.0, 0.12, 0.01) == pytest.approx(2 * math.sqrt(5.0))
    assert ramp_way(0.2, 0.020, 0.0, 0.002, 0.01) == pytest.approx(0.0002)
    assert ramp_way(10.2, 0.020, 0.0, 0.002, 0.01) == 0.020


@given(way=st.floats(1e-4, 0.1), start=st.floats(0, 0.05), speed=st.floats(1e-3, 0.05), acceleration=st.floats(0.01, 5))
def test_a_ramp_covers_its_way_without_a_jump(way: float, start: float, speed: float, acceleration: float) -> None:
    whole = ramp_time(way, start, speed, acceleration)
    places = [ramp_way(whole * i / 200, way, start, speed, acceleration) for i in range(201)]
    assert places[0] == pytest.approx(0.0, abs=1e-12)
    assert places[-1] == pytest.approx(way)
    longest = max(start, speed) * whole / 200 * 1.01 + 1e-12
    assert all(-1e-12 <= b - a <= longest for a, b in itertools.pairwise(places))


@BOTH
def test_feed_override_slows_a_block_under_way(component: type) -> None:
    bench = Walk(component, {"path": polyline((0, 10, 600))})
    for _ in range(101):
        bench.sample()
    halved = bench.to_the_end(feed_override=0.5)
    assert halved[50]["feed_speed"] == pytest.approx(0.005, rel=0.02)
    assert halved[-1]["z_reference"] == 0.010


@BOTH
def test_feed_hold_stops_and_goes_on(component: type) -> None:
    bench = Walk(component, {"path": polyline((0, 2, 60))})
    for _ in range(60):
        bench.sample()
    for _ in range(40):
        held = bench.sample(feed_override=0.0)
    assert held["feed_speed"] == 0.0
    assert bench.sample()["z_reference"] == held["z_reference"]
    assert bench.to_the_end(feed_override=1.0)[-1]["z_reference"] == 0.002


def test_feed_per_revolution_follows_the_actual_spindle() -> None:
    path = [line((0.0, 0.0), (0.0, 0.1), feed=0.2e-3, feed_mode=1.0, spindle_mode=1.0, spindle_speed=1000 * RPM)]
    bench = Walk(ConstantVelocityInterpolator, {"path": path})
    bench.sample(spindle_speed=0.0)
    assert bench.sample()["feed_speed"] == 0.0
    assert bench.sample(spindle_speed=500 * RPM)["feed_speed"] == pytest.approx(0.2e-3 * 500 / 60, rel=1e-3)
    assert bench.sample(spindle_speed=-900 * RPM)["feed_speed"] == pytest.approx(0.2e-3 * 900 / 60, rel=1e-3)
    assert bench.sample()["feed_per_revolution"] == pytest.approx(0.2e-3 * 900 / 1000, rel=1e-3)  # per turn asked for


def test_a_process_controller_commands_the_feed_in_cutting_blocks_only() -> None:
    bench = Walk(ConstantVelocityInterpolator, {"path": polyline((0, 1, 0), (0, 3, 120))})
    bench.sample(feed_command=0.3e-3)
    assert bench.sample()["feed_speed"] > 0.09  # the rapid takes no notice
    cutting = [s for s in bench.to_the_end() if s["cutting_block"] > 0.5]
    assert cutting[3]["feed_per_revolution"] == pytest.approx(0.3e-3, rel=0.01)


def test_constant_surface_speed_turns_faster_towards_the_axis_up_to_its_limit() -> None:
    path = [line((0.02, 0.0), (0.0, 0.0), feed=0.01, spindle_mode=2.0, spindle_speed=2.0, spindle_limit=300.0, direction=-1.0)]
    samples = walk(ConstantVelocityInterpolator, path)
    assert samples[0]["spindle_reference"] == pytest.approx(-100.0)  # 2 m/s at 20 mm, M04
    assert samples[-1]["spindle_reference"] == -300.0


def test_points_of_an_arc_lie_on_the_true_circle() -> None:
    quarter = row(
        kind=2.0, length=0.01 * math.pi / 2, start_x=0.0, start_z=0.01, end_x=0.01, end_z=0.0, radius=0.01, sweep=math.pi / 2, feed=0.005
    )
    samples = walk(ConstantVelocityInterpolator, [quarter])
    for sample in samples:
        assert math.hypot(sample["x_reference"], sample["z_reference"]) == pytest.approx(0.01, rel=1e-12)
        assert sample["direction_x"] ** 2 + sample["direction_z"] ** 2 == pytest.approx(1.0)
        along = sample["direction_x"] * sample["x_reference"] + sample["direction_z"] * sample["z_reference"]
        assert along == pytest.approx(0.0, abs=1e-15)
    assert samples[1]["x_velocity"] > 0.0  # counter-clockwise, +z right and +x up: upward at first


def test_dwell_waits_and_keeps_the_direction() -> None:
    path = [*polyline((0, 1, 600)), row(kind=3.0, start_z=0.001, end_z=0.001, dwell=0.052)]
    samples = walk(ConstantVelocityInterpolator, path)
    assert len(samples) - 1 == 20 + 11
    assert (samples[-1]["direction_x"], samples[-1]["direction_z"]) == (0.0, 1.0)
    assert samples[-1]["path_kind"] == 3.0


def test_segments_without_length_cost_no_sample() -> None:
    stop = row(kind=4.0, start_z=0.001, end_z=0.001)
    samples = walk(ConstantVelocityInterpolator, [row(kind=4.0), *polyline((0, 1, 600)), stop, stop])
    assert len(samples) - 1 == 20
    assert walk(ConstantVelocityInterpolator, [row(kind=4.0)])[0]["finished"] == 1.0


def test_progress_rises_to_one() -> None:
    shares = [s["progress"] for s in walk(ConstantVelocityInterpolator, EXAMPLE_1)]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert SAMPLE_PERIOD == 0.005


@BOTH
def test_the_spindle_override_scales_spindle_and_surface_speed(component: type) -> None:
    surface = [line((0.01, 0.0), (0.01, 0.02), feed=1e-3, spindle_mode=2.0, spindle_speed=2.0, direction=1.0)]
    for path in (polyline((10, 20, 60)), surface):
        plain, faster = (Walk(component, {"path": path}, spindle_override=share).sample()["spindle_reference"] for share in (1.0, 1.5))
        assert faster == pytest.approx(1.5 * plain)
        assert plain > 0.0


TURN = 2.0 * math.pi


def threads(*rows: tuple[float, float, float], direction: float = 1.0, **more: float) -> list[list[float]]:
    """Return a path along Z from 0 through rows of (z [mm], lead [mm], feed mode)."""
    path, here = [], 0.0
    for z, lead, mode in rows:
        turning = {"spindle_mode": 1.0, "spindle_speed": direction * 300.0 * RPM, "direction": direction}
        path.append(line((0.01, here), (0.01, z / 1000.0), feed=lead / 1000.0, feed_mode=mode, **turning, **more))
        here = z / 1000.0
    return path


def cut(component: type, path: list[list[float]], turned: Callable[[float], float], samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Return turns of the spindle and z [mm] of each sample."""
    bench = Walk(component, {"path": path})
    bench.sample(spindle_angle=TURN * turned(0.0))
    turns = np.array([turned((count + 1) * SAMPLE_PERIOD) for count in range(samples)])
    return turns, np.array([1000.0 * bench.sample(spindle_angle=TURN * here)["z_reference"] for here in turns])


@BOTH
def test_threads_of_other_leads_and_far_shorter_than_a_sample_stay_on_their_leads_through_the_joints(component: type) -> None:
    rows = [(4.0, 2.0, THREAD), *((4.0 + 0.003 * count, 2.0 + 0.01 * count, THREAD_ON) for count in range(1, 101)), (0.3, 1.0, THREAD_ON)]
    turns, z = cut(component, threads(*rows), lambda time: 0.37 + 5.0 * time, 400)
    ends = [0.0, *(end for end, _, _ in rows)]
    lasting = np.cumsum([0.0, *(abs(end - begin) / lead for begin, (end, lead, _) in zip(ends, rows, strict=False))])
    np.testing.assert_allclose(z, np.interp(turns, 1.0 + lasting, ends), atol=1e-9)


@BOTH
def test_a_thread_behind_a_spindle_that_reverses_waits_for_its_index_in_the_other_sense(component: type) -> None:
    path = threads((4.0, 2.0, THREAD), direction=-1.0)
    turns, z = cut(component, path, lambda time: 3.3 + 4.0 * time - 10.0 * time * time, 400)
    assert turns.max() == pytest.approx(3.7, abs=1e-4)  # turns on to 3.7, then back: the first index is at 3 turns
    back = np.arange(len(turns)) > np.argmax(turns)
    np.testing.assert_allclose(z[back], np.clip(2.0 * (3.0 - turns[back]), 0.0, 4.0), atol=1e-9)
    assert not z[~back].any()


@BOTH
def test_a_thread_begins_at_its_start_angle_behind_the_index(component: type) -> None:
    turns, z = cut(component, threads((4.0, 2.0, THREAD), start_angle=0.75 * TURN), lambda time: 0.9 + 5.0 * time, 600)
    np.testing.assert_allclose(z, np.clip(2.0 * (turns - 1.75), 0.0, 4.0), atol=1e-9)


@BOTH
def test_without_an_angle_a_chain_goes_on_at_the_speed_of_the_spindle(component: type) -> None:
    bench = Walk(component, {"path": threads((4.0, 2.0, THREAD), (7.0, 3.0, THREAD_ON), (4.0, 3.0, TAP_OUT))})
    bench.sample()
    samples = bench.to_the_end(spindle_speed=TURN * 5.0)
    way = np.abs(np.diff([1000.0 * sample["z_reference"] for sample in samples]))
    assert way[:70] == pytest.approx(np.full(70, 2.0 * 5.0 * SAMPLE_PERIOD))
    assert way[90:110] == pytest.approx(np.full(20, 3.0 * 5.0 * SAMPLE_PERIOD))
    assert len(samples) * SAMPLE_PERIOD == pytest.approx(4.0 / 5.0, abs=2.0 * SAMPLE_PERIOD)
    assert samples[-1]["z_reference"] == pytest.approx(0.004)
