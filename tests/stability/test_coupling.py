"""Receptances of beams and of assemblies against a worked example; a rod that is cut and put together again; inverse coupling."""

from __future__ import annotations

import numpy as np
import pytest

from lathesim.errors import LessonError
from lathesim.stability.beams import Material, assembly_tip, base_from_tip, coupled_tip, cylinder, euler_bernoulli, prism, timoshenko

STEEL = Material(200e9, 7800.0, 0.01, 0.3)
TOOL, HOLDER = cylinder(0.020, 0.100, STEEL), prism(0.030, 0.030, 0.150, STEEL)

EULER = {
    100: (-1.284940e-05 - 8.966943e-10j, -7.066026e-05, -4.253392e-04),
    500: (-4.218944e-07 - 1.026411e-09j, -8.757972e-07, 3.700949e-05),
    1000: (-6.298040e-09 - 1.710313e-09j, 1.813148e-06, 6.100355e-05),
    2000: (-4.875905e-07 - 2.669427e-08j, -8.362283e-06, -1.338113e-04),
    3000: (-5.384904e-08 - 4.271173e-10j, -5.196822e-07, 1.160456e-05),
    5000: (5.829426e-09 - 9.198676e-10j, 7.516118e-07, 4.573216e-05),
}
TIMOSHENKO = {
    100: (-1.267235e-05 - 9.260538e-10j, -6.949745e-05, -4.175097e-04),
    500: (-4.114389e-07 - 1.068101e-09j, -8.093487e-07, 3.764088e-05),
    1000: (2.207321e-09 - 1.846055e-09j, 1.892421e-06, 6.205339e-05),
    2000: (-3.619829e-07 - 1.402277e-08j, -5.878949e-06, -8.409431e-05),
    3000: (-4.877063e-08 - 4.130896e-10j, -3.965865e-07, 1.540414e-05),
    5000: (4.928123e-08 - 8.034296e-09j, 2.314218e-06, 1.030828e-04),
}


@pytest.mark.parametrize(("model", "table", "within"), [("euler_bernoulli", EULER, 1e-5), ("timoshenko", TIMOSHENKO, 1e-4)])
def test_a_cylinder_on_a_prism(model: str, table: dict[int, tuple[complex, float, float]], within: float) -> None:
    for frequency, (h, n, p) in table.items():
        tip = assembly_tip([TOOL, HOLDER], float(frequency), model=model)
        assert abs(tip[0, 0] - h) <= within * abs(h), frequency
        assert tip[1, 0].real == pytest.approx(n, rel=within)
        assert tip[1, 1].real == pytest.approx(p, rel=within)


@pytest.mark.parametrize("outer", [0.120, 0.050, 0.030])
@pytest.mark.parametrize("model", ["euler_bernoulli", "timoshenko"])
def test_a_rod_that_is_cut_and_joined_is_the_rod(model: str, outer: float) -> None:
    receptances = euler_bernoulli if model == "euler_bernoulli" else timoshenko
    frequency = np.array([100.0, 500.0, 1500.0, 3000.0, 5000.0])
    whole = receptances(cylinder(0.02, 0.200, STEEL), frequency)[0]
    joined = assembly_tip([cylinder(0.02, outer, STEEL), cylinder(0.02, 0.200 - outer, STEEL)], frequency, model=model)
    assert np.abs(joined / whole - 1.0).max() < 1e-12


def test_a_tube_on_a_wall_with_the_shear_of_a_hollow_circle() -> None:
    tube = cylinder(0.040, 0.100, Material(200e9, 7800.0, 1e-3, 0.3), 0.034)
    assert tube.shear == pytest.approx(0.5362, abs=5e-5)
    assert cylinder(0.040, 0.100, STEEL).shear == pytest.approx(7.8 / 8.8, rel=1e-12)
    frequency = np.linspace(3070.0, 3100.0, 61)
    tip = assembly_tip([tube], frequency, base=np.zeros((2, 2), dtype=complex))[:, 0, 0]
    assert frequency[np.argmax(np.abs(tip))] == pytest.approx(3085.0, rel=5e-4)


@pytest.mark.parametrize("receptances", [euler_bernoulli, timoshenko])
def test_receptances_are_reciprocal(receptances: object) -> None:
    first, across, back, second = receptances(TOOL, 800.0)  # type: ignore[operator]
    for one, other in ((first, first.T), (second, second.T), (across, back.T)):
        assert np.abs(one / other - 1.0).max() < 1e-10


def test_the_base_is_found_back_from_the_tip() -> None:
    base = timoshenko(HOLDER, 1700.0)[0]
    parts = timoshenko(TOOL, 1700.0)
    assert np.abs(base_from_tip(parts, coupled_tip(parts, base)) / base - 1.0).max() < 1e-10


def test_a_soft_joint_makes_the_tip_softer_and_a_stiff_one_is_rigid() -> None:
    base, parts = timoshenko(HOLDER, 50.0)[0], timoshenko(TOOL, 50.0)
    stiff = coupled_tip(parts, base, np.diag([1e15, 1e15]))
    assert np.abs(stiff / coupled_tip(parts, base) - 1.0).max() < 1e-4


def test_what_is_no_beam_is_refused() -> None:
    with pytest.raises(LessonError, match="bore"):
        cylinder(0.02, 0.1, STEEL, bore=0.03)
    with pytest.raises(LessonError, match="length"):
        prism(0.02, 0.02, 0.0, STEEL)
    with pytest.raises(LessonError, match="no parts"):
        assembly_tip([], 100.0)
