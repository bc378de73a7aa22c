"""Lesson 13 against Table 2 of Liu and Landers (2004), what its controllers do, and its golden channels."""

import numpy as np
import pytest

from tests.lessons.lesson_runs import Runs

REFERENCE = {"none": 13.170, "nonlinear": 8.615, "linearization": 9.025}
"""Case -> cycle time [s] of an independent simulator with the settings of the lesson."""

GOALS = {
    "none": "-+",
    "nonlinear": "+-",
    "linearization": "+-",
    "log_transform": "--",  # it breaks down before the tool cuts
    "adaptive": "+-",
    "adaptive_slow": "-+",
    "radial_force": "+-",
    "torque": "+-",
    "power": "+-",
}
"""Case -> whether each goal is met (+) or missed (-), in the order of the lesson."""

AT = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
GOLDEN = {
    "x_axis.position": (8e-06, (0.01477, 0.0150008, 0.0153096, 0.0156054, 0.0158898, 0.0161887, 0.0169193)),
    "z_axis.position": (2e-05, (0.011224, 0.014145, 0.017381, 0.020337, 0.023212, 0.02622, 0.033228)),
    "cutting_force.cutting_force": (20.0, (0.0, 0.0, 819.0, 567.0, 309.0, 304.0, 0.0)),
    "process_controller.feed_command": (2e-06, (0.0001552, 0.0001983, 0.0001854, 0.0001731, 0.0001752, 0.0001889, 0.0002587)),
    "dynamometer_adc.reading": (20.0, (0.0, 0.0, 818.0, 567.0, 309.0, 304.0, 0.0)),
    "surface_finish.roughness": (3e-08, (0.0, 0.0, 1.295e-06, 1.132e-06, 1.157e-06, 1.343e-06, 2.515e-06)),
    "spindle.speed": (0.5, (104.85, 104.83, 104.82, 105.05, 104.93, 104.87, 104.84)),
    "load.torque": (0.4, (0.0, 0.0, 12.53, 8.84, 4.91, 4.92, 0.0)),
    "load.power": (40.0, (0.0, 0.0, 1313.0, 929.0, 516.0, 516.0, 0.0)),
    "cutting.depth_of_cut": (2e-05, (0.0, 0.0, 0.00169, 0.001395, 0.00111, 0.000811, 8.1e-05)),
}
"""Golden channels of case ``nonlinear``: tolerance and values at the times of ``AT`` [SI]."""


@pytest.fixture(scope="module")
def runs() -> Runs:
    return Runs("13_process_control")


def test_the_goals_and_the_golden_channels_are_as_stated(runs: Runs) -> None:
    runs.check_goals(GOALS)
    runs.check_golden(GOLDEN, AT, "nonlinear")


def test_without_control_the_published_time_and_roughness_are_met_exactly(runs: Runs) -> None:
    assert runs.value("cycle_time", "none") == 13.17
    assert runs.value("max_surface_roughness", "none") == pytest.approx(0.541e-6, rel=1e-3)


@pytest.mark.parametrize("variant", REFERENCE)
def test_the_cycle_times_are_within_two_percent_of_the_reference(variant: str, runs: Runs) -> None:
    assert runs.value("cycle_time", variant) == pytest.approx(REFERENCE[variant], rel=0.02)


def test_the_log_transform_is_unstable_with_time_and_reason_and_the_data_are_kept(runs: Runs) -> None:
    record = runs.record("log_transform")
    reason = "ln F is required of a force that is not above zero, while smallest_measured is 0."
    assert record.status.startswith(f"failed: process_controller is unstable at t = 0.165 s: {reason}")
    assert "measured = 0 N" in record.status
    assert record.time[-1] == pytest.approx(0.16)
    assert np.isfinite(record["process_controller.feed_command"]).all()
    assert record["process_controller.feed_command"][1] == -1.0
    assert record["x_axis.position"][-1] > 1e-3


def test_with_a_floor_the_log_transform_lives(runs: Runs) -> None:
    settings = (("process_controller.smallest_measured", "1 N"),)
    record = runs.record("log_transform", settings)
    assert record.status == "complete"
    assert record["process_controller.feed_command"].max() == 5e-4  # in the air it goes straight to its limit


def test_the_adaptive_controller_is_slower_than_the_nonlinear_and_faster_than_none(runs: Runs) -> None:
    assert runs.value("cycle_time", "nonlinear") < runs.value("cycle_time", "adaptive") < runs.value("cycle_time", "none")


def test_one_pole_gives_the_published_time_and_none_the_roughness_with_it(runs: Runs) -> None:
    assert runs.value("cycle_time", "adaptive_slow") == pytest.approx(11.37)
    assert runs.value("max_surface_roughness", "adaptive_slow") == pytest.approx(1.404e-6, rel=0.02)
    slower = {"process_controller__pole": "0.9998"}
    assert runs.value("max_surface_roughness", "adaptive_slow", **slower) == pytest.approx(0.837e-6, rel=0.03)
    assert runs.value("cycle_time", "adaptive_slow", **slower) > 12.0


def test_the_adaptive_controller_leaves_the_air_cut_alone(runs: Runs) -> None:
    record = runs.record("adaptive")
    feed = record["process_controller.feed_command"]
    air = (record["interpolator.cutting_block"] > 0.5) & (record["cutting.engaged"] < 0.5)
    assert feed[air].max() <= 0.12e-3 * (1 + 1e-9)
    assert feed.max() <= 5e-4


@pytest.mark.parametrize(
    ("variant", "channel", "unit", "reference"),
    [
        ("adaptive", "cutting_force.cutting_force", "N", 500.0),
        ("radial_force", "cutting_force.radial_force", "N", 250.0),
        ("torque", "load.torque", "N*m", 8.0),
        ("power", "load.power", "W", 800.0),
    ],
)
def test_what_is_controlled_is_held_while_there_is_something_to_cut(
    variant: str, channel: str, unit: str, reference: float, runs: Runs
) -> None:
    record = runs.record(variant)
    assert record.unit(channel) == record.unit("dynamometer_adc.reading") == unit
    deep = (record["cutting.engaged"] > 0.5) & (record["cutting.depth_of_cut"] > 1.2e-3) & (record["cutting.depth_of_cut"] < 1.5e-3)
    assert record[channel][deep].mean() == pytest.approx(reference, rel=0.15)


def test_a_limited_feed_meets_both_goals(runs: Runs) -> None:
    settings = {"process_controller__largest_feed": "0.2 mm"}
    assert runs.value("cycle_time", "nonlinear", **settings) < 10.0
    assert runs.value("max_surface_roughness", "nonlinear", **settings) < 1.6e-6
