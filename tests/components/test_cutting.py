"""Cut surface, cutting forces and tool wear against their closed forms."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lathesim.components.cutting_forces import CuttingLoad, LinearForce, NonlinearForce
from lathesim.components.stock import CuttingGeometry, Stock, SurfaceFinish
from lathesim.components.tool_wear import TaylorWear, tool_materials
from tests.components.paths import Walk


def stock(**values: float) -> tuple[Walk, list[float]]:
    """A stock of 18 mm radius from z = 15 to 75 mm in cells of 1 mm."""
    removed = [0.0] * 60
    return Walk(Stock, {"removed": removed}, **values), removed


def move(bench: Walk, start: tuple[float, float], end: tuple[float, float], samples: int = 50) -> list[dict[str, float]]:
    """Move the tip straight from (x, z) to (x, z) [mm]."""
    shares = [i / samples for i in range(samples + 1)]
    return [
        bench.sample(x_position=(start[0] + s * (end[0] - start[0])) / 1000, z_position=(start[1] + s * (end[1] - start[1])) / 1000)
        for s in shares
    ]


def radii(removed: list[float]) -> list[float]:
    return [round(18.0 - depth * 1000, 6) for depth in removed]


@pytest.mark.parametrize(("start", "end"), [((15, 10), (15, 35)), ((15, 35), (15, 10))])
def test_turning_carves_towards_plus_and_minus_z(start: tuple[float, float], end: tuple[float, float]) -> None:
    bench, removed = stock()
    move(bench, start, end)
    assert radii(removed) == [15.0] * 20 + [18.0] * 40


def test_a_taper_is_carved_at_the_middle_of_each_cell() -> None:
    bench, removed = stock()
    move(bench, (15, 15), (17, 35))
    assert radii(removed)[:20] == [pytest.approx(15.05 + 0.1 * cell) for cell in range(20)]


def test_the_tool_sees_the_material_ahead_and_its_bounds() -> None:
    bench, _ = stock()
    samples = move(bench, (15, 14), (15, 20), 60)
    assert samples[3]["uncut_radius"] == 0.0 == samples[3]["inside_stock"]
    assert (samples[-1]["uncut_radius"], samples[-1]["inside_stock"]) == (0.018, 1.0)
    back = move(bench, (15, 20), (15, 16), 40)
    assert back[-1]["uncut_radius"] == pytest.approx(0.015)  # nothing is left behind
    assert back[-1]["inside_stock"] == 1.0


def test_removed_volume_is_that_of_the_ring() -> None:
    bench, _ = stock()
    volume = move(bench, (15, 10), (15, 35))[-1]["removed_volume"]
    assert volume == pytest.approx(math.pi * (0.018**2 - 0.015**2) * 0.020)


@pytest.mark.parametrize(("free_end", "z", "cut"), [(-1.0, 17.0, slice(0, 2)), (1.0, 73.0, slice(58, 60))])
def test_facing_takes_the_layer_at_the_free_end(free_end: float, z: float, cut: slice) -> None:
    bench, removed = stock(free_end=free_end)
    samples = move(bench, (20, z), (0, z), 400)
    assert samples[100]["facing_width"] == pytest.approx(0.002)
    assert radii(removed)[cut] == [0.0, 0.0]
    assert sum(radius == 0.0 for radius in radii(removed)) <= 3


@settings(max_examples=8)
@given(points=st.lists(st.tuples(st.floats(5, 20), st.floats(0, 90)), min_size=2, max_size=8))
def test_material_is_only_ever_taken_away(points: list[tuple[float, float]]) -> None:
    bench, removed = stock()
    volumes, before = [0.0], list(removed)
    for start, end in itertools.pairwise(points):
        volumes.append(move(bench, start, end, 20)[-1]["removed_volume"])
        assert all(0.0 <= a <= b <= 0.018 for a, b in zip(before, removed, strict=True))
        before = list(removed)
    assert volumes == sorted(volumes)
    assert volumes[-1] == pytest.approx(sum(math.pi * (0.018**2 - (0.018 - gone) ** 2) * 0.001 for gone in removed), abs=1e-15)


CUT = {
    "x_position": 0.015,
    "x_velocity": 0.0,
    "z_velocity": 0.002,
    "spindle_speed": 1000 * 2 * math.pi / 60,
    "uncut_radius": 0.018,
    "material_radius": 0.018,
    "facing_width": 0.0,
    "inside_stock": 1.0,
    "cutting_block": 1.0,
}


def geometry(**values: float) -> dict[str, float]:
    return Walk(CuttingGeometry, **(CUT | values)).sample()


def test_geometry_of_example_1() -> None:
    cut = geometry()
    assert cut["depth_of_cut"] == pytest.approx(0.003)
    assert cut["feed"] == pytest.approx(0.12e-3)  # 120 mm/min at 1000 rpm
    assert cut["cutting_speed"] == pytest.approx(94.25 / 60, rel=1e-3)
    assert (cut["in_contact"], cut["engaged"], cut["rapid_contact"]) == (1.0, 1.0, 0.0)


def test_contact_counts_in_feed_blocks_only_and_rapids_warn() -> None:
    rapid = geometry(cutting_block=0.0)
    assert (rapid["in_contact"], rapid["engaged"], rapid["rapid_contact"], rapid["depth_of_cut"]) == (0.0, 0.0, 1.0, 0.0)
    air = geometry(uncut_radius=0.015, material_radius=0.015)
    assert (air["in_contact"], air["engaged"], air["depth_of_cut"]) == (1.0, 0.0, 0.0)
    assert geometry(inside_stock=0.0, material_radius=0.0)["in_contact"] == 0.0


def test_feed_is_along_the_path_and_ends_where_the_tool_leaves() -> None:
    assert geometry(x_velocity=0.002, z_velocity=0.002)["feed"] == pytest.approx(math.sqrt(2) * 0.12e-3)
    assert geometry(x_velocity=0.002, z_velocity=0.0)["feed"] == 0.0
    facing = geometry(x_velocity=-0.002, z_velocity=0.0, facing_width=0.001)
    assert (facing["depth_of_cut"], facing["feed"]) == (0.001, pytest.approx(0.12e-3))


def test_a_standing_spindle_cuts_nothing() -> None:
    assert geometry(spindle_speed=0.0)["feed"] == 0.0


def test_linear_force_is_pressure_times_area() -> None:
    forces = Walk(LinearForce, cutting_pressure=2e9, thrust_pressure=1e9, lead_angle=math.radians(30)).sample(
        depth_of_cut=0.002, feed=0.12e-3
    )
    assert forces["cutting_force"] == pytest.approx(480.0)
    assert (forces["longitudinal_force"], forces["radial_force"]) == (pytest.approx(120.0), pytest.approx(240.0 * math.cos(math.pi / 6)))


def test_nonlinear_force_is_equation_38() -> None:
    forces = Walk(NonlinearForce).sample(depth_of_cut=0.002, feed=0.12e-3, cutting_speed=94.0 / 60)
    assert forces["cutting_force"] == pytest.approx(7705 * 0.12**0.891 * 2**0.877 * 94**-0.273, rel=1e-9)
    published = 2864.63 * 2**0.69 * 0.12**0.75 - 4.28 * 94  # equation (35), the measurement it was fitted to
    assert forces["cutting_force"] == pytest.approx(published, rel=0.2)
    thrust = math.hypot(1907.0 * 2**0.74 * 0.12**0.79 - 3.08 * 94, 1464.28 * 2**0.08 * 0.12**1.09 + 0.02 * 94)
    assert math.hypot(forces["longitudinal_force"], forces["radial_force"]) == pytest.approx(thrust, rel=0.2)


@pytest.mark.parametrize("component", [LinearForce, NonlinearForce])
def test_without_a_cut_there_is_no_force(component: type) -> None:
    cut = {"depth_of_cut": 0.001, "feed": 1e-4, "cutting_speed": 1.0, "in_contact": 1.0}
    for name in ("depth_of_cut", "feed", "in_contact"):
        assert set(Walk(component, **(cut | {name: 0.0})).sample().values()) == {0.0}


def load(**values: float) -> dict[str, float]:
    forces = {"cutting_force": 500.0, "longitudinal_force": 200.0, "radial_force": 100.0, "part_radius": 0.015, "spindle_speed": 100.0}
    return Walk(CuttingLoad, **(forces | {"x_velocity": 0.0, "z_velocity": 0.0} | values)).sample()


def test_turning_pushes_back_along_z_and_out_along_x() -> None:
    cut = load(z_velocity=0.002)
    assert cut["z_disturbance"] == pytest.approx(200.0, rel=1e-6)
    assert cut["x_disturbance"] == pytest.approx(-100.0, rel=1e-6)
    assert load(z_velocity=-0.002, free_end=1.0)["z_disturbance"] == pytest.approx(-200.0, rel=1e-6)
    assert load(z_velocity=-0.002, free_end=1.0)["x_disturbance"] == pytest.approx(-100.0, rel=1e-6)


def test_facing_pushes_back_along_x_and_off_the_face() -> None:
    cut = load(x_velocity=-0.002)
    assert cut["x_disturbance"] == pytest.approx(-200.0, rel=1e-6)
    assert cut["z_disturbance"] == pytest.approx(100.0, rel=1e-6)  # towards the free end at smaller z


def test_torque_and_power_of_the_spindle() -> None:
    cut = load(z_velocity=0.002)
    assert cut["torque"] == pytest.approx(0.015 * 500.0, rel=1e-5)  # equation (22)
    assert cut["power"] == pytest.approx(cut["torque"] * 100.0)
    assert load(spindle_speed=-100.0)["torque"] == pytest.approx(-7.5, rel=1e-5)
    assert load(spindle_speed=-100.0)["power"] > 0.0


def test_roughness_of_example_2() -> None:
    along = [0.0] * 60
    bench = Walk(SurfaceFinish, {"along_z": along}, nose_radius=0.832e-3)
    cut = bench.sample(feed=0.12e-3, in_contact=1.0, z_position=0.0205)
    assert cut["roughness"] == pytest.approx(0.541e-6, rel=1e-3)  # Liu and Landers (2004), Table 2, case I
    assert along[5] == cut["roughness"]
    assert sum(along) == cut["roughness"]
    assert bench.sample(in_contact=0.0)["roughness"] == 0.0


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
