"""Lesson 10: feed, nose radius, roughness and force; its goals and golden channels."""

import math

import pytest

from tests.lessons.lesson_runs import Runs

GOALS = {
    "start": "--+",
    "slow": "+-+",
    "fast": "-+-",
    "round_nose": "++-",
    "sharp_nose": "--+",
}
"""Case -> whether each goal is met (+) or missed (-), in the order of the lesson."""

AT = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
GOLDEN = {
    "x_axis.position": (8e-06, (0.0157566, 0.0160011, 0.0160036, 0.0160015, 0.0160011, 0.0160036)),
    "z_axis.position": (3e-05, (0.013361, 0.019433, 0.025426, 0.03143, 0.037428, 0.043429)),
    "surface_finish.roughness": (1e-08, (0.0, 1.397e-06, 1.407e-06, 1.405e-06, 1.405e-06, 1.405e-06)),
    "cutting_force.cutting_force": (40.0, (0.0, 1286.0, 1293.0, 1337.0, 1376.0, 1268.0)),
    "cutting.feed": (1e-05, (0.0, 0.000294, 0.000297, 0.000308, 0.000318, 0.00029)),
    "load.power": (60.0, (0.0, 2577.0, 2600.0, 2688.0, 2766.0, 2548.0)),
}
"""Golden channels of case ``round_nose``: tolerance and values at the times of ``AT`` [SI]."""


@pytest.fixture(scope="module")
def runs() -> Runs:
    return Runs("10_feed_and_roughness")


def test_the_goals_and_the_golden_channels_are_as_stated(runs: Runs) -> None:
    runs.check_goals(GOALS)
    runs.check_golden(GOLDEN, AT, "round_nose")


@pytest.mark.parametrize(("variant", "feed", "nose"), [("start", 0.2e-3, 0.8e-3), ("slow", 0.1e-3, 0.8e-3), ("round_nose", 0.3e-3, 2e-3)])
def test_the_roughness_is_that_of_the_formula(variant: str, feed: float, nose: float, runs: Runs) -> None:
    assert runs.value("mean_surface_roughness", variant) == pytest.approx(feed * feed / (32.0 * nose), rel=0.01)
    assert runs.value("max_surface_roughness", variant) == pytest.approx(feed * feed / (32.0 * nose), rel=0.07)


def test_half_the_feed_takes_twice_the_time_and_a_quarter_of_the_roughness(runs: Runs) -> None:
    assert runs.value("contact_time", "slow") == pytest.approx(2.0 * runs.value("contact_time", "start"), rel=0.02)
    assert runs.value("mean_surface_roughness", "slow") == pytest.approx(runs.value("mean_surface_roughness", "start") / 4.0, rel=0.01)


def test_the_force_grows_with_the_feed_to_a_power_below_one(runs: Runs) -> None:
    forces = [runs.value("mean_cutting_force", variant) for variant in ("slow", "fast")]
    assert math.log(forces[1] / forces[0]) / math.log(3.0) == pytest.approx(0.891, abs=0.03)


def test_the_roughness_is_kept_along_the_finished_part(runs: Runs) -> None:
    from lathesim.analysis.turned_part import roughness_along

    surface = roughness_along(runs.record("start"))
    turned = (surface.z > 0.017) & (surface.z < 0.043)
    assert surface.roughness[turned] == pytest.approx(0.2e-3**2 / (32.0 * 0.8e-3), rel=0.05)
