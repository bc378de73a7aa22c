"""Lesson 3: an integral that winds up, and one that does not; its goals and golden channels."""

import numpy as np
import pytest

from tests.lessons.lesson_runs import Runs

GOALS = {
    "windup": "-+",
    "anti_windup": "-+",
    "no_integral": "-+",
    "slow_rapids": "--",
}
"""Case -> whether each goal is met (+) or missed (-), in the order of the lesson."""

AT = (0.5, 1.0, 2.0, 4.0, 8.0, 14.0, 18.0)
GOLDEN = {
    "x_axis.position": (8e-06, (0.0249738, 0.0272667, 0.0185043, 0.0170886, 0.0161865, 0.016012, 0.0160024)),
    "z_axis.position": (8e-06, (0.0055761, 0.0096306, 0.0117615, 0.0157616, 0.0237617, 0.0357614, 0.0437617)),
    "contour.contour_error": (8e-06, (0.0013946, -0.0112667, -0.0025043, -0.0010886, -0.0001865, -1.2e-05, -2.4e-06)),
    "x_dac.voltage": (0.0015, (3.0, -3.0, -0.0623, -0.0799, -0.0901, -0.0886, -0.0872)),
    "x_controller.voltage": (0.03, (17.044, -3.218, -0.062, -0.08, -0.091, -0.088, -0.088)),
    "x_controller.error": (8e-06, (0.0338495, -0.011267, -0.002504, -0.001089, -0.000186, -1.2e-05, -2e-06)),
}
"""Golden channels of case ``windup``: tolerance and values at the times of ``AT`` [SI]."""


@pytest.fixture(scope="module")
def runs() -> Runs:
    return Runs("03_integral_windup")


def test_the_goals_and_the_golden_channels_are_as_stated(runs: Runs) -> None:
    runs.check_goals(GOALS)
    runs.check_golden(GOLDEN, AT, "windup")


def test_the_controller_that_does_not_know_asks_for_more_than_there_is(runs: Runs) -> None:
    asked = np.abs(runs.record("windup")["x_controller.voltage"]).max()
    assert asked > 12.0
    assert runs.value("max_x_voltage", "windup") == 3.0
    assert np.abs(runs.record("anti_windup")["x_controller.voltage"]).max() == 3.0


def test_the_wound_up_integral_takes_seconds_to_empty(runs: Runs) -> None:
    late = runs.record("windup").time >= 4.0
    for variant, smallest, largest in (("windup", 1.0e-3, 1.2e-3), ("anti_windup", 0.0, 0.1e-3)):
        error = np.abs(runs.record(variant)["x_controller.error"][late])[0]
        assert smallest < error < largest


def test_without_an_integral_the_radial_force_leaves_an_error(runs: Runs) -> None:
    record = runs.record("no_integral")
    sample = 2000
    force = record["load.x_disturbance"][sample]
    left = 10e-6 * force / (18.78e-3 * 449.0)  # Kd F / (K Kp)
    assert -record["x_axis.position"][sample] + 0.016 == pytest.approx(left, abs=5e-6)
    assert abs(runs.record("anti_windup")["x_axis.position"][3000] - 0.016) < 5e-6
