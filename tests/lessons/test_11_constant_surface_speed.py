"""Lesson 11: facing with a constant spindle speed and with a constant surface speed, its goals and golden channels."""

import numpy as np
import pytest

from tests.lessons.lesson_runs import Runs

GOALS = {
    "fixed": "-+-",
    "fast": "+-+",
    "constant": "-+-",
    "constant_slow": "-+-",
}
"""Case -> whether each goal is met (+) or missed (-), in the order of the lesson."""

AT = (0.5, 1.0, 2.0, 3.0, 4.0, 4.5)
GOLDEN = {
    "x_axis.position": (2e-05, (0.016043, 0.018129, 0.014863, 0.010333, 0.004535, 0.002309)),
    "z_axis.position": (8e-06, (0.0130669, 0.0157322, 0.0159989, 0.0159987, 0.0160019, 0.0152419)),
    "spindle.speed": (1.0, (115.4, 137.4, 173.2, 246.5, 251.4, 251.6)),
    "cutting.cutting_speed": (0.02, (1.851, 2.492, 2.574, 2.547, 1.14, 0.581)),
    "cutting_force.cutting_force": (40.0, (0.0, 0.0, 323.0, 317.0, 424.0, 164.0)),
    "tool_wear.flank_wear": (1e-08, (0.0, 2e-09, 3.17e-07, 6.9e-07, 8.19e-07, 8.21e-07)),
    "interpolator.spindle_reference": (0.5, (129.85, 141.04, 177.73, 251.33, 251.33, 251.33)),
}
"""Golden channels of case ``constant``: tolerance and values at the times of ``AT`` [SI]."""


@pytest.fixture(scope="module")
def runs() -> Runs:
    return Runs("11_constant_surface_speed")


def test_the_goals_and_the_golden_channels_are_as_stated(runs: Runs) -> None:
    runs.check_goals(GOALS)
    runs.check_golden(GOLDEN, AT, "constant")


def test_at_a_constant_spindle_speed_the_cutting_speed_falls_with_the_radius(runs: Runs) -> None:
    record = runs.record("fixed")
    cutting = record["cutting.engaged"] > 0.5
    speed, radius = record["cutting.cutting_speed"][cutting], record["x_axis.position"][cutting]
    assert speed / radius == pytest.approx(np.full(len(speed), 1000.0 * 2.0 * np.pi / 60.0), rel=0.06)


def test_a_constant_surface_speed_holds_until_the_spindle_can_no_more(runs: Runs) -> None:
    record = runs.record("constant")
    cutting, radius = record["cutting.engaged"] > 0.5, record["x_axis.position"]
    limit = 2.5 / (2400.0 * 2.0 * np.pi / 60.0)  # the radius at which 150 m/min asks for 2400 rpm
    held = cutting & (radius > 1.1 * limit) & (radius < 0.017)
    assert record["cutting.cutting_speed"][held] == pytest.approx(np.full(np.count_nonzero(held), 2.5), rel=0.06)
    beyond = cutting & (radius < 0.8 * limit)
    assert record["interpolator.spindle_reference"][beyond] == pytest.approx(np.full(np.count_nonzero(beyond), 251.327), abs=0.01)
    assert record["cutting.cutting_speed"][beyond].max() < 2.2


def test_holding_the_speed_beats_a_fast_spindle_in_wear_and_a_slow_one_in_time(runs: Runs) -> None:
    assert runs.value("cycle_time", "constant") < 0.6 * runs.value("cycle_time", "fixed")
    assert runs.value("parts_per_edge", "constant") > 2.0 * runs.value("parts_per_edge", "fast")
