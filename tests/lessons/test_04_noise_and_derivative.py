"""Lesson 4: what a derivative does to noise, its goals and golden channels."""

import numpy as np
import pytest

from tests.lessons.lesson_runs import Runs

GOALS = {
    "P": "-+",
    "PD": "+-",
    "PD_noisy": "--",
    "PD_small": "-+",
    "high_gain": "+-",
}
"""Case -> whether each goal is met (+) or missed (-), in the order of the lesson."""

AT = (1.0, 2.0, 3.0, 4.0, 4.5)
GOLDEN = {
    "x_axis.position": (4e-06, (0.0160008, 0.016, 0.0160001, 0.0170002, 0.017001)),
    "z_axis.position": (4e-06, (0.0113276, 0.0153274, 0.0193314, 0.0223286, 0.024329)),
    "contour.contour_error": (4e-06, (-8e-07, 0.0, -1e-07, -2e-07, -1e-06)),
    "x_sensor.voltage": (0.0004, (1.60001, 1.60008, 1.59993, 1.69983, 1.70025)),
    "x_dac.voltage": (0.1, (0.0, 0.0, -0.03, 0.0, -0.05)),
    "cutting.depth_of_cut": (4e-06, (0.0, 0.002, 0.0019999, 0.0009998, 0.000999)),
}
"""Golden channels of case ``PD``: tolerance and values at the times of ``AT`` [SI]."""


@pytest.fixture(scope="module")
def runs() -> Runs:
    return Runs("04_noise_and_derivative")


def test_the_goals_and_the_golden_channels_are_as_stated(runs: Runs) -> None:
    runs.check_goals(GOALS)
    runs.check_golden(GOLDEN, AT, "PD")


def test_the_derivative_damps_the_corners(runs: Runs) -> None:
    assert runs.value("rms_contour_error", "PD") < 0.6 * runs.value("rms_contour_error", "P")


def test_the_unrest_of_the_voltage_can_be_worked_out_by_hand(runs: Runs) -> None:
    noise = 1e-3 / 100.0  # 1 mV at 100 mV/mm, in metres
    period = 0.005
    second_difference = np.sqrt(6.0) * 50.0 * noise / period  # Kd (n - 2 n_1 + n_2)/T
    difference = np.sqrt(2.0) * 3000.0 * noise  # Kp (n - n_1)
    assert runs.value("x_voltage_unrest", "PD_noisy") == pytest.approx(second_difference + difference, rel=0.2)


def test_five_times_the_noise_makes_five_times_the_unrest(runs: Runs) -> None:
    assert 4.0 < runs.value("x_voltage_unrest", "PD_noisy") / runs.value("x_voltage_unrest", "PD") < 5.5


def test_a_derivative_makes_a_gain_possible_that_would_swing_without_it(runs: Runs) -> None:
    bare = {"x_controller__derivative_gain": "0 V*s/mm", "z_controller__derivative_gain": "0 V*s/mm"}
    assert runs.value("rms_contour_error", "high_gain") < 0.4 * runs.value("rms_contour_error", "high_gain", **bare)


def test_the_run_can_be_repeated(runs: Runs) -> None:
    again = Runs("04_noise_and_derivative").record("PD")
    assert (again["x_sensor.voltage"] == runs.record("PD")["x_sensor.voltage"]).all()
