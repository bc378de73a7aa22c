"""Lesson 5: a spindle that slows down under load, and one that does not; its goals and golden channels."""

import pytest

from tests.lessons.lesson_runs import Runs

GAIN, DROOP = 26.09, 1.0436
"""Speed per volt [rad/s/V] and speed lost per torque [rad/s/(N m)]: K = Kt Ka/(R D), Kd = 1/D, D = B + Kt (Ka Kmtach + Kv)/R."""

GOALS = {
    "P": "-+-",
    "P_double": "-+-",
    "P_high": "---",
    "PI": "-++",
}
"""Case -> whether each goal is met (+) or missed (-), in the order of the lesson."""

AT = (0.5, 1.0, 2.0, 4.0, 6.0, 8.0, 10.0)
GOLDEN = {
    "spindle.speed": (0.5, (84.8, 85.0, 85.02, 77.36, 76.34, 76.35, 79.54)),
    "spindle.current": (1.5, (5.5, 5.1, 5.1, 48.7, 55.7, 55.7, 37.0)),
    "load.torque": (0.6, (0.0, 0.0, 0.0, 22.11, 26.76, 24.45, 12.04)),
    "spindle_dac.voltage": (0.01, (3.265, 3.265, 3.265, 3.851, 3.954, 3.954, 3.7)),
    "z_axis.position": (3e-05, (0.004761, 0.006923, 0.010554, 0.016549, 0.022538, 0.028616, 0.034337)),
    "cutting.feed": (1e-05, (0.0, 0.0, 0.0, 0.000206, 0.000266, 0.000241, 0.000121)),
    "x_axis.current": (3.0, (-1.1, 0.0, -0.4, -1.2, -2.8, -2.3, 0.6)),
}
"""Golden channels of case ``P``: tolerance and values at the times of ``AT`` [SI]."""


@pytest.fixture(scope="module")
def runs() -> Runs:
    return Runs("05_spindle_droop")


def test_the_goals_and_the_golden_channels_are_as_stated(runs: Runs) -> None:
    runs.check_goals(GOALS)
    runs.check_golden(GOLDEN, AT, "P")


@pytest.mark.parametrize(("variant", "gain"), [("P", 0.08), ("P_double", 0.16)])
def test_the_droop_is_that_of_the_equations(variant: str, gain: float, runs: Runs) -> None:
    record = runs.record(variant)
    wanted = 1200.0 * 2.0 * 3.141592653589793 / 60.0
    idle = GAIN * gain * wanted / (1.0 + GAIN * gain)
    assert record["spindle.speed"][350] == pytest.approx(idle, rel=0.01)
    cutting = record["cutting.engaged"] > 0.5
    middle = slice(int(cutting.argmax()) + 400, int(cutting.argmax()) + 700)
    torque = record["load.torque"][middle].mean()
    assert record["spindle.speed"][middle].mean() == pytest.approx(idle - DROOP * torque / (1.0 + GAIN * gain), rel=0.01)


def test_an_integral_takes_the_droop_away(runs: Runs) -> None:
    assert runs.value("mean_spindle_droop", "PI") < 0.01 * runs.value("mean_spindle_droop", "P")
    assert runs.value("cycle_time", "PI") < runs.value("cycle_time", "P") - 3.0


def test_the_current_carries_the_load(runs: Runs) -> None:
    record = runs.record("PI")
    cutting = record["cutting.engaged"] > 0.5
    middle = slice(int(cutting.argmax()) + 300, int(cutting.argmax()) + 600)
    torque = 0.5 * record["spindle.current"][middle].mean() - 0.03 * record["spindle.speed"][middle].mean()
    assert torque == pytest.approx(record["load.torque"][middle].mean(), rel=0.03)
