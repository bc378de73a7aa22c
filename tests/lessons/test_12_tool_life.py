"""Lesson 12: the cheapest and the quickest cutting speed, its goals and golden channels."""

import math

import pytest

from tests.lessons.lesson_runs import Runs

RADIUS = 0.017
CHANGE = 1.0
EDGE = 2.0
"""Minutes for a tool change, and minutes of the machine that an edge costs (2 dollar at 60 dollar an hour)."""

GOALS = {
    "slow": "--",
    "start": "--",
    "cheap": "-+",
    "quick": "+-",
    "hasty": "--",
}
"""Case -> whether each goal is met (+) or missed (-), in the order of the lesson."""

AT = (2.0, 5.0, 8.0, 12.0, 16.0, 19.0)
GOLDEN = {
    "z_axis.position": (3e-05, (0.010985, 0.02246, 0.033963, 0.049305, 0.064652, 0.074692)),
    "cutting.cutting_speed": (0.01, (2.048, 2.048, 2.048, 2.049, 2.049, 2.24)),
    "tool_wear.flank_wear": (5e-08, (0.0, 1.372e-06, 3.511e-06, 6.364e-06, 9.217e-06, 1.1312e-05)),
    "tool_wear.life": (0.5, (0.0, 420.88, 420.65, 420.53, 420.59, 0.0)),
    "economy.part_cost": (0.0005, (0.03333, 0.09705, 0.16845, 0.26364, 0.35884, 0.42979)),
    "economy.time_per_part": (0.02, (2.0, 5.274, 8.702, 13.273, 17.843, 21.262)),
}
"""Golden channels of case ``cheap``: tolerance and values at the times of ``AT`` [SI]."""


@pytest.fixture(scope="module")
def runs() -> Runs:
    return Runs("12_tool_life")


def test_the_goals_and_the_golden_channels_are_as_stated(runs: Runs) -> None:
    runs.check_goals(GOALS)
    runs.check_golden(GOLDEN, AT, "cheap")


def best_speed(lost: float) -> float:
    """Return the spindle speed [1000 rpm] that Gilbert's formula calls best when each edge costs ``lost`` minutes."""
    speed = 200.0 / ((1.0 / 0.25 - 1.0) * lost) ** 0.25  # m/min
    return speed / (2.0 * math.pi * RADIUS) / 1000.0


@pytest.mark.slow
@pytest.mark.parametrize(("metric", "lost"), [("part_cost", CHANGE + EDGE), ("time_per_part", CHANGE)])
def test_the_best_speed_is_that_of_the_formula(metric: str, lost: float, runs: Runs) -> None:
    best = best_speed(lost)
    values = [runs.value(metric, interpolator__spindle_override=f"{share * best:.4f}") for share in (0.85, 1.0, 1.15)]
    assert values[1] < values[0] and values[1] < values[2]


def test_the_life_of_the_edge_follows_taylor(runs: Runs) -> None:
    record = runs.record("start")
    speed, life = record["cutting.cutting_speed"][2000], record["tool_wear.life"][2000]
    assert speed * 60.0 * (life / 60.0) ** 0.25 == pytest.approx(200.0, rel=1e-3)


def test_one_and_a_half_times_the_speed_leaves_a_fifth_of_the_life(runs: Runs) -> None:
    lives = [runs.record("start", (("interpolator.spindle_override", share),))["tool_wear.life"].max() for share in ("1", "1.5")]
    assert lives[0] / lives[1] == pytest.approx(1.5**4, rel=0.05)


def test_the_cost_adds_up(runs: Runs) -> None:
    record = runs.record("cheap")
    used = record["tool_wear.used_life"][-1]
    assert record["economy.time_per_part"][-1] == pytest.approx(record.time[-1] + 60.0 * used)
    assert record["economy.part_cost"][-1] == pytest.approx(record["economy.time_per_part"][-1] / 60.0 + 2.0 * used)
