"""Lesson 6: corners at full speed and with braking, its goals and golden channels."""

import numpy as np
import pytest

from tests.lessons.lesson_runs import Runs

GOALS = {
    "constant_velocity": "-+",
    "half_feed": "--",
    "brisk": "-+",
    "gentle": "--",
    "high_gain": "-+",
    "gentle_high_gain": "+-",
}
"""Case -> whether each goal is met (+) or missed (-), in the order of the lesson."""

AT = (2.0, 4.0, 6.0, 8.0, 10.0, 12.0)
GOLDEN = {
    "x_axis.position": (8e-06, (0.0113095, 0.0140006, 0.0141733, 0.0160007, 0.0170003, 0.0184725)),
    "z_axis.position": (2e-05, (0.009694, 0.015024, 0.019997, 0.023101, 0.026836, 0.03)),
    "contour.contour_error": (8e-06, (0.0, -6e-07, -3.1e-06, -7e-07, -3e-07, 3e-07)),
    "interpolator.feed_speed": (2e-05, (0.007178, 0.002987, 0.002679, 0.002984, 0.002978, 0.000999)),
    "x_dac.voltage": (0.0049, (0.3248, -0.0024, 0.1001, -0.0024, 0.0024, 0.0366)),
    "z_dac.voltage": (0.0098, (0.2808, 0.1587, 0.0024, 0.1587, 0.1587, 0.0024)),
}
"""Golden channels of case ``gentle_high_gain``: tolerance and values at the times of ``AT`` [SI]."""


@pytest.fixture(scope="module")
def runs() -> Runs:
    return Runs("06_interpolators_and_corners")


def test_the_goals_and_the_golden_channels_are_as_stated(runs: Runs) -> None:
    runs.check_goals(GOALS)
    runs.check_golden(GOLDEN, AT, "gentle_high_gain")


def test_a_corner_is_cut_by_about_speed_over_loop_gain(runs: Runs) -> None:
    lag = 3e-3 / (224.5 * 18.78e-3)
    assert runs.value("max_contour_error", "constant_velocity") == pytest.approx(lag, rel=0.1)
    assert runs.value("max_contour_error", "half_feed") == pytest.approx(lag / 2.0, rel=0.1)
    assert runs.value("max_contour_error", "high_gain") == pytest.approx(lag / 2.0, rel=0.1)


def test_the_gentle_interpolator_stops_at_every_corner(runs: Runs) -> None:
    for variant, stops in (("constant_velocity", False), ("gentle", True)):
        record = runs.record(variant)
        rows = record["interpolator.segment_number"]
        last = np.flatnonzero(np.diff(rows) > 0.5)
        feeding = last[record["interpolator.cutting_block"][last] > 0.5]
        assert (record["interpolator.feed_speed"][feeding] < 1e-9).all() == stops


def test_going_slow_everywhere_costs_more_than_braking_at_corners(runs: Runs) -> None:
    assert runs.value("max_contour_error", "half_feed") == pytest.approx(runs.value("max_contour_error", "gentle"), rel=0.1)
    assert runs.value("cycle_time", "gentle") < runs.value("cycle_time", "half_feed") - 2.0
