"""Tool wear by Taylor's law, its table of materials, and what it does to the forces."""

from __future__ import annotations

import math

import pytest

from lathesim.components.cutting_forces import NonlinearForce
from lathesim.components.tool_wear import TaylorWear, tool_materials
from tests.components.paths import Walk

MINUTE = 60.0


def wear_after(minutes: float, speed: float, **values: float) -> dict[str, float]:
    bench = Walk(TaylorWear, sample_period=1.0, cutting_speed=speed / 60.0, in_contact=1.0, **values)
    for _ in range(round(minutes * 60)):
        sample = bench.sample()
    return sample


def test_the_constant_is_the_speed_with_a_life_of_one_minute() -> None:
    worn = wear_after(1.0, 700.0)
    assert worn["used_life"] == pytest.approx(1.0)
    assert worn["flank_wear"] == pytest.approx(0.3e-3)


def test_half_the_speed_lives_sixteen_times_as_long() -> None:
    assert wear_after(1.0, 350.0)["life"] == pytest.approx(2.0**4 * MINUTE)  # n = 0.25


def test_shares_of_life_add_up_over_changing_speeds() -> None:
    bench = Walk(TaylorWear, sample_period=1.0, in_contact=1.0)
    for _ in range(30):
        bench.sample(cutting_speed=700.0 / 60.0)
    for _ in range(16 * 30):
        worn = bench.sample(cutting_speed=350.0 / 60.0)
    assert worn["used_life"] == pytest.approx(1.0)


def test_nothing_wears_out_of_the_cut() -> None:
    assert Walk(TaylorWear, cutting_speed=20.0, in_contact=0.0).sample() == {
        "used_life": 0.0,
        "flank_wear": 0.0,
        "life": 0.0,
        "force_factor": 1.0,
    }


def test_wear_raises_the_force_where_it_is_told_to() -> None:
    assert wear_after(1.0, 700.0)["force_factor"] == 1.0
    factor = wear_after(1.0, 700.0, force_growth=1000.0)["force_factor"]
    assert factor == pytest.approx(1.3)
    cut = {"depth_of_cut": 0.001, "feed": 1e-4, "cutting_speed": 2.0, "in_contact": 1.0}
    sharp, worn = (Walk(NonlinearForce, wear_factor=share, **cut).sample()["cutting_force"] for share in (1.0, factor))
    assert worn == pytest.approx(1.3 * sharp)


def test_every_material_has_a_source_and_sensible_constants() -> None:
    table = tool_materials()
    assert len({(entry.work, entry.tool) for entry in table}) == len(table) >= 8
    assert all(entry.source for entry in table)
    assert all(0.05 < entry.taylor_exponent < 1.0 for entry in table)
    constants = {entry.tool: entry.taylor_constant for entry in table if entry.work == "steel"}
    assert constants["high-speed steel"] < constants["cemented carbide"] < constants["coated carbide"] < constants["ceramic"]
    assert constants["coated carbide"] == pytest.approx(700.0 / 60.0)


@pytest.mark.parametrize(
    ("tool", "criterion", "lives"),
    [
        ("cermet TiN-TaN", 0.2, {200.0: ((5.0, 0.161), (10.0, 0.244)), 300.0: ((1.0, 0.155), (2.5, 0.265))}),
        ("ceramic TiCN-30TiB2", 0.14, {300.0: ((2.5, 0.105), (5.0, 0.14)), 400.0: ((1.0, 0.099), (2.5, 0.188))}),
    ],
)
def test_the_constants_worked_out_from_measurements(
    tool: str, criterion: float, lives: dict[float, tuple[tuple[float, float], tuple[float, float]]]
) -> None:
    """Speed [m/min] -> minutes and wear [mm] before and after the criterion, of the bearing steel SUJ2 in KIT-AMEL/aist_machining_data."""
    times = {}
    for speed, ((early, less), (late, more)) in lives.items():
        times[speed] = early + (criterion - less) / (more - less) * (late - early)
    (slow, long), (fast, short) = times.items()
    exponent = math.log(fast / slow) / math.log(long / short)
    (entry,) = (item for item in tool_materials() if item.tool == tool)
    assert entry.checked
    assert entry.taylor_exponent == pytest.approx(exponent, abs=0.001)
    assert entry.taylor_constant * MINUTE == pytest.approx(slow * long**exponent, rel=0.003)
