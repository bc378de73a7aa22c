"""Units as people write them, converted by what is wanted."""

import math

import pytest

from lathesim.errors import UnitError
from lathesim.unit_table import KNOWN_UNITS, known_angle_power
from lathesim.units import angle_power, convertible, quantity, registry

TURN = 2.0 * math.pi


@pytest.mark.parametrize(
    ("text", "unit", "si"),
    [
        ("5 mm/rev", "m/rad", 5e-3 / TURN),
        ("5 mm/turn", "m/rad", 5e-3 / TURN),
        ("0.2 in/rev", "m/rad", 5.08e-3 / TURN),
        ("0.2 mm/rev", "m", 0.2e-3),
        ("0.008 in/rev", "m", 0.2032e-3),
        ("0.008 ipr", "m", 0.2032e-3),
        ("20 in/min", "m/s", 20 * 0.0254 / 60),
        ("20 ipm", "m/s", 20 * 0.0254 / 60),
        ("2 in", "m", 0.0508),
        ("1500 rev/min", "rad/s", 50 * math.pi),
        ("1500 rpm", "Hz", 25.0),
        ("25 Hz", "rad/s", 50 * math.pi),
        ("1500 1/min", "rad/s", 50 * math.pi),
        ("6 1/min", "1/s", 0.1),
        ("20 1/s", "rad/s", 20.0),
        ("50 Hz", "Hz", 50.0),
        ("90 deg", "rad", math.pi / 2),
        ("3 kN", "N", 3000.0),
        ("5 g", "kg", 0.005),
        ("0.5 g", "m/s^2", 4.903325),
        ("500 mg", "m/s^2", 4.903325),
        ("1 um/count", "m", 1e-6),
        ("12 counts", "1", 12.0),
    ],
)
def test_a_unit_means_what_a_person_at_a_lathe_means_by_it(text: str, unit: str, si: float) -> None:
    assert quantity(text, unit) == pytest.approx(si, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("5 mm", "m/rad", "'5 mm' is given in mm, but m/rad is wanted. Say per which angle: mm/rev or mm/rad."),
        ("12 counts", "m", "'12 counts' is given in counts, but m is wanted. Give the length of one count as 'resolution'."),
        ("12 counts", "rad", "'12 counts' is given in counts, but rad is wanted. Give the angle of one count as 'resolution'."),
        (
            "10000 counts/rev",
            "rad",
            "'10000 counts/rev' is given in counts/rev, but rad is wanted. Give the angle of one count, as in '0.036 deg'.",
        ),
        ("2 mm/s", "N", "'2 mm/s' is given in mm/s, but N is wanted. Use a unit like N."),
        ("2 mm/revv", "m", "'mm/revv' is no unit. Write units as in 'mm', 'm/s', 'N*s/m', 'V/mm', 'rpm'."),
    ],
)
def test_what_could_be_meant_in_two_ways_is_refused(text: str, unit: str, message: str) -> None:
    with pytest.raises(UnitError) as error:
        quantity(text, unit)
    assert str(error.value) == message


def test_what_converts() -> None:
    assert convertible("g", "m/s^2") and convertible("g", "kg") and convertible("mm/rev", "m")
    assert not convertible("mm", "m/rad") and not convertible("V", "N")


def test_the_angle_of_every_unit_of_the_table_is_what_pint_says() -> None:
    angle_power.cache_clear()
    angles = {"radian": 1, "degree": 1, "turn": 1, "revolutions_per_minute": 1, "kilorevolutions_per_minute": 1}
    for unit in KNOWN_UNITS:
        names = dict(registry().parse_units(unit)._units)
        assert known_angle_power(unit) in (None, sum(power * angles.get(name, 0) for name, power in names.items())), unit
